"""What a log has to tell, in sentences: a summary, one joint, one instant, and why it ended."""

import re
from collections.abc import Iterator

import numpy as np

from taskopt.arrays import IntArray
from taskopt.errors import UnknownName
from taskopt.log.breaches import breaches
from taskopt.log.reading import Log
from taskopt.log.spans import Span, dearest, spans

_NUMBER = re.compile(r"(?<!\w)(?<!level )-?\d+(\.\d+)?(e[+-]?\d+)?(?!\w)")  # not that in "joint1"
_SHOWN = 12  # spans of a summary; --joint shows all of one joint
_MILLI = 1000.0


def summary(log: Log) -> str:
    """Tell what happened in a log.

    Args:
        log: The log.

    Returns:
        The text.
    """
    facts = log.facts
    robot, scenario = facts.get("robot", {}), facts.get("scenario", {})
    names = ", ".join(filter(None, [scenario.get("name"), robot.get("name")]))
    commit = facts["git_commit"] or "unknown"
    lines = [f"{log.path}: {names}", f"started {facts['started']}, schema {facts['schema']}, commit {commit}"]
    if log.missing:
        lines.append(f"missing: {log.missing}")
    if log.end.waits:
        lines.append(f"the loop waited {log.end.waits} times for the writer, {log.end.waited:.3g} s in all")
    if log.end.why:
        lines.append(f"{log.end.end}: {log.end.why}")
    for resolver in log.resolvers:
        lines += ["", *_of_resolver(log, resolver)]
    return "\n".join(lines)


def of_joint(log: Log, joint: str) -> str:
    """Tell when limits held one joint, how long, and at which price.

    Args:
        log: The log.
        joint: Name of an unknown, or a part of it such as "joint4".

    Returns:
        The text.

    Raises:
        UnknownName: No unknown has that name.
    """
    names = [name for name in log.layout.unknowns if joint in name]
    if not names:
        raise UnknownName("joint in this log", joint, log.layout.unknowns)
    lines = []
    for resolver in log.resolvers:
        own = [span for span in spans(log, resolver) if span.name.rpartition("/")[2] in names]
        lines.append(f"{resolver}: {_total(own)}")
        lines += [f"  {span}" for span in own]
        broken = [breach for breach in breaches(log, resolver) if breach.name.rpartition("/")[2] in names]
        lines += [f"  broke {breach}" for breach in broken]
        for span in dearest(own)[:1]:
            lines += [f"  meanwhile {text}" for text in errors(log, np.arange(span.first, span.last + 1))]
    return "\n".join(lines)


def of_tick(log: Log, row: int) -> str:
    """Explain one tick: what was asked for, what was met, what holds it back, and the proof.

    Args:
        log: The log.
        row: Number of the row.

    Returns:
        The text.
    """
    tick = log.tick(row)
    lines = [f"tick {tick.index}, t = {tick.t:.6g} s, {tick.resolver}"]
    if tick.error:
        lines.append(f"It raised an error, and nothing was sent: {tick.error}")
    units = log.layout.unknown_units or ("",) * log.layout.n
    sent = zip(log.layout.unknowns, tick.x, units, strict=True)
    lines.append("sent: " + ", ".join(f"{name} {value:.5g} {unit}".rstrip() for name, value, unit in sent))
    return "\n".join([*lines, tick.resolution.explain(), *errors(log, np.array([row]))])


def why(log: Log) -> str:
    """Tell why a log ended, and what was unusual before.

    Args:
        log: The log.

    Returns:
        The text.
    """
    lines = []
    failed = np.flatnonzero(log.array("failed"))
    for row in failed.tolist():
        tick = log.tick(row)
        lines.append(f"{tick.resolver} raised an error at t = {tick.t:.6g} s: {tick.error}")
    lines += noted(log)
    if log.missing:
        lines.append(log.missing)
    if not len(failed) and not log.missing:
        lines.append(f"the log is complete: {log.end.end}{': ' if log.end.why else ''}{log.end.why}")
    return "\n".join(lines)


def _of_resolver(log: Log, resolver: str) -> Iterator[str]:
    """Yield sentences on the ticks of one resolver."""
    rows = log.rows(resolver)
    if not len(rows):
        yield f"{resolver}: no tick"
        return
    t, status = log.t[rows], log.array("status")[rows]
    counts = {name: int((status == name).sum()) for name in dict.fromkeys(status.tolist())}
    told = ", ".join(f"{count} {name}" for name, count in counts.items())
    yield f"{resolver}: {len(rows)} ticks from {t[0]:.6g} to {t[-1]:.6g} s; {told}"
    yield from (f"  {text}" for text in errors(log, rows))
    changed = log.changes(resolver)
    yield from (f"  set at {change.t:.6g} s: {change}" for change in changed[:_SHOWN])
    if len(changed) > _SHOWN:
        yield f"  and {len(changed) - _SHOWN} more changes of parameters until {changed[-1].t:.6g} s"
    found = spans(log, resolver)
    if not found:
        yield "  no limit and no inequality was active"
    for name in dict.fromkeys(f"{span.name} {span.side}" for span in found):
        own = [span for span in found if f"{span.name} {span.side}" == name]
        price = ", ".join(f"price up to {span.cost}" for span in dearest(own))
        yield f"  {name}: first at {own[0].begin:.6g} s, {_total(own)}, {price or 'at no price'}"
    yield from (f"  broke {breach}" for breach in breaches(log, resolver))


def _total(own: list[Span]) -> str:
    """Return how often and how long in all."""
    if not own:
        return "never at a limit"
    times = "once" if len(own) == 1 else f"{len(own)} times"
    return f"active {times}, {sum(span.duration for span in own):.4g} s in all"


def errors(log: Log, rows: IntArray) -> Iterator[str]:
    """Yield the largest error of each task over some rows.

    Args:
        log: The log.
        rows: Numbers of rows, (k,).

    Yields:
        A sentence for each task.
    """
    for task in log.facts["tasks"]:
        column = f"error/{task}"
        values, names = log.array(column)[rows], log.names(column)
        units = log.unit(column).split(", ")
        units = units * len(names) if len(units) == 1 else units
        told = []
        for unit in dict.fromkeys(units):
            size = np.linalg.norm(values[:, [u == unit for u in units]], axis=1)
            if np.isfinite(size).any():
                worst = int(np.nanargmax(size))
                value = (
                    f"{_MILLI * size[worst]:.4g} mm" if unit == "m" else f"{size[worst]:.4g} {unit}".rstrip()
                )
                told.append(value if len(rows) == 1 else f"{value} at {log.t[rows[worst]]:.6g} s")
        if told:
            yield f"{task}: error {'' if len(rows) == 1 else 'up to '}{', '.join(told)}"


def kind_of(note: str) -> str:
    """Return what notes have in common that differ in numbers only, other than those of levels and in names.

    Args:
        note: A note.

    Returns:
        The note with # in place of its numbers.
    """
    return _NUMBER.sub("#", note)


def noted(log: Log) -> Iterator[str]:
    """Yield the notes on answers, each with its first time; notes that differ in numbers only are one kind.

    Args:
        log: The log.

    Yields:
        The first note of each kind, and the number of its ticks if there are more; of many kinds the first.
    """
    kinds: dict[str, tuple[str, list[int]]] = {}
    for row, found in enumerate(log.array("notes").tolist()):
        for note in found or ():
            kinds.setdefault(kind_of(note), (note, []))[1].append(row)
    for note, rows in list(kinds.values())[:_SHOWN]:
        more = f", first of {len(rows)} ticks of this kind" if len(rows) > 1 else ""
        yield f"at {log.t[rows[0]]:.6g} s{more}: {note}"
