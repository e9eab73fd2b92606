"""The tables and findings of a comparison, as plain text that every kind of report shows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.bench.comparison.problem_set import SHOWN
from taskopt.bench.comparison.results import PLACE, Figures, Results, all_figures, figures

_ALMOST_ALL = 0.99  # share of claimed and of right answers from which findings name a resolver
_NAMED = 6  # resolvers that a finding names


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: What it shows.
        note: Explanation of its columns; "" for none.
        heading: Headings of the columns.
        rows: Texts, as many in each row as there are headings.
    """

    title: str
    note: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(rows: Results) -> Iterator[Table]:
    """Make the tables of a comparison.

    Args:
        rows: All rows.

    Yields:
        The tables in the order of the report.
    """
    yield _shares("All sets but the badly scaled ones: claims and accuracy", rows.well_scaled)
    yield _times("All sets but the badly scaled ones: times", rows.well_scaled)
    for name in rows.names("set"):
        yield _shares(f"Set {name}: claims and accuracy", rows.where(set=name))
        yield _times(f"Set {name}: times", rows.where(set=name))
    yield _sets(rows)
    yield _solvers(rows)


def findings(rows: Results) -> Iterator[str]:
    """Say in sentences what the rows show; every number in them comes from the rows.

    Args:
        rows: All rows.

    Yields:
        Sentences.
    """
    some = rows.well_scaled if len(rows.well_scaled) else rows
    found = all_figures(some)
    reliable = [one for one in found if min(one.claimed, one.right) >= _ALMOST_ALL and one.refuted == 0.0]
    accurate = sorted(reliable, key=lambda one: one.distance[2])[:3]
    if accurate:
        text = ", ".join(f"{_of(one)} (largest {_digits(one.distance[2])})" for one in accurate)
        yield f"Most accurate, of those that claim at least 99 % and are right in as many: {text}."
    for setting in ("cold", "warm"):
        quick = sorted((one for one in reliable if one.setting == setting), key=lambda one: one.mean)
        if quick:
            text = ", ".join(f"{one.resolver} ({_micro(one.mean)} µs)" for one in quick[:3])
            yield f"Quickest {setting} among the same, by the mean of the processor time: {text}."
    false = sorted((one for one in found if one.refuted > 0.0), key=lambda one: -one.refuted)
    if false:
        text = ", ".join(f"{_of(one)} ({_share(one.refuted)})" for one in false[:_NAMED])
        more = f", and {len(false) - _NAMED} more" if len(false) > _NAMED else ""
        yield f"Claims that are refuted, by share of the problems: {text}{more}."
    yield from _closed_form(rows)
    yield from _undecided(rows)


def _closed_form(rows: Results) -> Iterator[str]:
    """Say where the pseudo-inverse has the optimum."""
    pinv = rows.where(resolver="pinv", setting="cold")
    if not len(pinv):
        return
    right = {name: figures(pinv.where(set=name)).right for name in pinv.names("set")}
    enough = [name for name, share in right.items() if share == 1.0]
    part = [f"{name} {_share(share)}" for name, share in right.items() if 0.0 < share < 1.0]
    yield (
        f"The closed form (pinv) has the exact optimum in all problems of: {', '.join(enough) or 'no set'}; "
        f"in a part of: {', '.join(part) or 'none'}; in no other."
    )


def _undecided(rows: Results) -> Iterator[str]:
    """Say for how many claims the judge cannot tell, and how often it refutes an answer of active-set."""
    own = rows.where(resolver="active-set")
    if len(own):
        refuted = figures(own).refuted
        yield f"Of the answers of active-set, {_share(refuted)} are refuted."
    worst = {name: figures(rows.where(set=name)).undecided for name in rows.names("set")}
    name = max(worst, key=lambda one: worst[one])
    yield f"The judge cannot tell for at most {_share(worst[name])} of the answers to a set ({name})."
    split = {name: figures(rows.where(set=name)).conditional for name in rows.names("set")}
    name = max(split, key=lambda one: split[one])
    if split[name]:
        yield (
            f"For up to {_share(split[name])} of the answers to a set ({name}) the proof holds on a "
            "condition: that rows which depend on others up to rounding depend on them exactly, as "
            "those of a robot do."
        )


_AIMS = (
    "The exact optimum is that of strict levels. wqp/ promises another one, that of its weighted "
    "problem, and pqp/ that of its projected one: their claims are judged by that, their distance and "
    "right by strict levels. wqp@R/ has the ratio R between the weights of levels. pinv, dls, transpose "
    "and srtp claim nothing, and keep no limits; srtp keeps priorities, and does not minimise lower "
    "levels; sns claims nothing, and scales levels instead of minimising "
    "them. daqp-hierarchy is judged by strict levels, which it claims."
)
"""What the ways of resolving aim at, and by what each is judged."""


def limits_of_comparison(rows: Results) -> Iterator[str]:
    """Say what the comparison does not show.

    Args:
        rows: All rows.

    Yields:
        Sentences.
    """
    here = rows.conditions["machine"]
    yield f"All times are from one machine: {here['cpu']}, {here['cores']} cores, {here['system']}."
    yield (
        "hqp/ and wqp/ call a solver through code of ours in Python, which takes longer than most solvers: "
        "their times compare ways of resolving as this library offers them, not solvers alone."
    )
    yield (
        "The judge, the exact references and active-set are by the same authors; they share the declaration "
        "of a hierarchy only. Rational references share nothing with the resolvers."
    )
    yield _AIMS
    yield (
        f"Each problem is timed {rows.conditions['repeats']} times (once if it takes more than 20 ms), after "
        "an untimed answer to the first one, and the median counts; a time limit or another load of the "
        "machine can change answers of solvers that adapt to time (osqp, highs)."
    )
    yield "The sets are small, and each is of one kind; a mean over all of them depends on which there are."


def _shares(title: str, rows: Results) -> Table:
    """Make the table of claims and accuracy."""
    note = (
        "Shares of the problems. claimed: says that it has the optimum, or that there is none; proven, "
        "on condition, undecided, refuted: our judge on that claim, on condition where rows that depend on "
        "others up to rounding must depend on them exactly; right: within 1e-8 of the exact strict optimum, "
        "among the problems where that is known; distance: ‖x − x*‖∞ / max(1, ‖x*‖∞), median, 95 % "
        "and largest; "
        "failed: crashed, missed the deadline, or was not tried after that."
    )
    heading = (
        "resolver", "setting", "problems", "claimed", "proven", "on condition", "undecided", "refuted",
        "right",
        "distance p50", "p95", "largest", "failed",
    )  # fmt: skip
    lines = (
        (
            one.resolver, one.setting, str(one.answers), _share(one.claimed), _share(one.proven),
            _share(one.conditional), _share(one.undecided), _share(one.refuted), _share(one.right),
            *map(_digits, one.distance),
            str(one.failed),
        )
        for one in all_figures(rows)
    )  # fmt: skip
    return Table(title, note, heading, tuple(lines))


def _times(title: str, rows: Results) -> Table:
    """Make the table of times."""
    note = (
        "In µs. mean: shifted geometric mean of the processor time, shift 10 µs; ratio: to the least mean; "
        "inside: wall clock inside the package of the solver, of which the rest is our code around it; "
        "misses: answers that take longer than 1 ms of wall clock."
    )
    heading = (
        "resolver", "setting", "cpu mean", "ratio", "cpu p50", "cpu p95", "cpu p99", "inside p50",
        "wall p50", "wall p99",
        "wall largest", "misses",
    )  # fmt: skip
    found = [one for one in all_figures(rows) if np.isfinite(one.mean)]
    least = min((one.mean for one in found), default=1.0)
    lines = (
        (
            one.resolver, one.setting, _micro(one.mean), f"{one.mean / least:.3g}", *map(_micro, one.cpu),
            _inside(one), *map(_micro, one.wall), _share(one.missed),
        )
        for one in sorted(found, key=lambda one: one.mean)
    )  # fmt: skip
    return Table(title, note, heading, tuple(lines))


def _sets(rows: Results) -> Table:
    """Make the table of the sets."""
    lines = []
    for key, about in rows.conditions["sets"].items():
        sizes = about["unknowns"].values()
        own = rows.where(set=key)
        known = sorted({str(kind) for kind in own.names("reference")}) if len(own) else []
        span = f"{min(sizes)}–{max(sizes)}" if min(sizes) < max(sizes) else str(min(sizes))
        version, checksum = str(about["version"]), about["checksum"][:SHOWN]
        count = f"{about['problems']} in {about['sequences']}"
        lines.append((about["name"], version, checksum, count, span, ", ".join(known), about["description"]))
    heading = ("set", "version", "checksum", "problems in sequences", "unknowns", "references", "description")
    return Table("Sets", "", heading, tuple(lines))


def _solvers(rows: Results) -> Table:
    """Make the table of versions, and of solvers that are not there."""
    late = "takes seconds for a problem: tried by --full, or if it is named"
    left_out = rows.conditions.get("left_out", [])  # which older rows do not have
    there = [
        (name, number, late if name in left_out else "")
        for name, number in rows.conditions["versions"].items()
    ]
    gone = [(name, "not installed", f"pip install {pip}") for name, pip in rows.conditions["missing"].items()]
    note = "Of the solvers that are not installed, some need a licence or a compiler."
    return Table(
        "Versions, and solvers that were not tried", note, ("package", "version", ""), (*there, *gone)
    )


def difference(first: Results, second: Results) -> Iterator[Table]:
    """Make the tables of what changed from one comparison to another.

    Args:
        first: The rows before.
        second: The rows after.

    Yields:
        Changed conditions; then claims, accuracy and times for each resolver and setting on the problems
        that both have.
    """
    changed = tuple(_changed(first, second))
    yield Table("Conditions that differ", "", ("condition", "first", "second"), changed)
    same = [
        name
        for name, about in first.conditions["sets"].items()
        if second.conditions["sets"].get(name, {}).get("checksum") == about["checksum"]
    ]
    both = _problems(first, same) & _problems(second, same)
    before, after = (rows.select(np.array([key in both for key in _keys(rows)])) for rows in (first, second))
    later = {(one.resolver, one.setting): one for one in all_figures(after)}
    lines = tuple(_change(one, later[one.resolver, one.setting]) for one in all_figures(before))
    note = (
        f"On the {len(both)} answers that both have to the same problems of: {', '.join(same) or 'no set'}."
    )
    heading = (
        "resolver", "setting", "proven", "refuted", "right", "largest distance", "cpu mean [µs]", "ratio",
    )  # fmt: skip
    yield Table("Resolvers", note, heading, lines)


def _keys(rows: Results) -> Iterator[tuple[str, ...]]:
    """Yield what tells one row from another."""
    columns = (rows.columns[name] for name in (*PLACE, "index"))
    yield from zip(*columns, strict=True)


def _problems(rows: Results, sets: Sequence[str]) -> set[tuple[str, ...]]:
    """Return the keys of the rows of some sets."""
    return {key for key in _keys(rows) if key[0] in sets}


def _changed(first: Results, second: Results) -> Iterator[tuple[str, str, str]]:
    """Yield the conditions that differ."""
    for part in ("machine", "versions", "missing"):
        then, now = first.conditions[part], second.conditions[part]
        for key in dict.fromkeys((*then, *now)):
            if then.get(key) != now.get(key):
                yield f"{part}: {key}", str(then.get(key, "–")), str(now.get(key, "–"))
    for name in dict.fromkeys((*first.conditions["sets"], *second.conditions["sets"])):
        sums = [
            rows.conditions["sets"].get(name, {}).get("checksum", "–")[:SHOWN] for rows in (first, second)
        ]
        if sums[0] != sums[1]:
            yield f"set {name}", *sums


def _change(one: Figures, other: Figures) -> tuple[str, ...]:
    """Return the line of a resolver in a difference."""

    def pair(text: str, then: str) -> str:
        """Return one text if nothing changed, else both."""
        return text if text == then else f"{text} → {then}"

    return (
        one.resolver,
        one.setting,
        pair(_share(one.proven), _share(other.proven)),
        pair(_share(one.refuted), _share(other.refuted)),
        pair(_share(one.right), _share(other.right)),
        pair(_digits(one.distance[2]), _digits(other.distance[2])),
        f"{_micro(one.mean)} → {_micro(other.mean)}",
        f"{other.mean / one.mean:.3f}" if np.isfinite(one.mean) and one.mean > 0.0 else "–",
    )


def markdown(table: Table) -> str:
    """Write a table in Markdown.

    Args:
        table: The table.

    Returns:
        Its text, with the title as a heading.
    """
    lines = [_line(table.heading), _line(["---"] * len(table.heading)), *map(_line, table.rows)]
    return "\n".join([f"### {table.title}", "", *([table.note, ""] if table.note else []), *lines, ""])


def _line(cells: Sequence[str]) -> str:
    """Return a row of a table in Markdown."""
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _inside(one: Figures) -> str:
    """Return the time inside the package of a solver; a dash where there is none, or none was measured."""
    return _micro(one.inside) if one.inside > 0.0 else "–"


def _of(one: Figures) -> str:
    """Return resolver and setting."""
    return f"{one.resolver} {one.setting}"


def _share(value: float) -> str:
    """Return a share in per cent, so that 100 % means all and 0 % none; a dash for NaN."""
    if np.isnan(value):
        return "–"
    percent = 100.0 * value
    return f"{percent:.2f} %" if 0.0 < percent < 1.0 or 99.0 < percent < 100.0 else f"{percent:.0f} %"


def _digits(value: float) -> str:
    """Return two digits; a dash for NaN, "none" for an answer that is not there."""
    return "–" if np.isnan(value) else "none" if np.isinf(value) else "0" if value == 0.0 else f"{value:.1e}"


def _micro(seconds: float) -> str:
    """Return a time in µs; a dash for NaN."""
    return "–" if np.isnan(seconds) else f"{1e6 * seconds:.3g}" if seconds < 1e-3 else f"{1e6 * seconds:.0f}"
