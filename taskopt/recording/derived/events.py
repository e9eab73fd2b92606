"""The events of a resolver's ticks: limits, claims, ranks, changes of parameters, sentences, and the end."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from taskopt.log.spans import runs
from taskopt.log.story import kind_of
from taskopt.recording.derived.answers import Answers
from taskopt.recording.derived.lanes import Lane

_TOLD = {  # claims that are events, with Rerun's name of their severity
    "BRAKED": "ERROR", "RELAXED": "WARN", "INFEASIBLE": "ERROR", "ITERATION_LIMIT": "WARN", "FAILED": "ERROR",
}  # fmt: skip


class Event(NamedTuple):
    """An event.

    Attributes:
        place: Place of the tick among those of the resolver.
        severity: "ERROR", "WARN", "INFO" or "DEBUG".
        text: One sentence without the name of the resolver.
    """

    place: int
    severity: str
    text: str


def events(answers: Answers, lanes: Sequence[Lane]) -> list[Event]:
    """List the events.

    Args:
        answers: The ticks.
        lanes: Their lanes.

    Returns:
        The events in the order of time; those of one tick by severity.
    """
    found = [*_of_limits(answers, lanes), *_of_claims(answers), *_of_ranks(answers)]
    found += [*_of_changes(answers), *_of_words(answers)]
    order = ("ERROR", "WARN", "INFO", "DEBUG")
    return sorted(found, key=lambda event: (event.place, order.index(event.severity), event.text))


def _of_limits(answers: Answers, lanes: Sequence[Lane]) -> Iterator[Event]:
    """Yield an event at the beginning and after the end of each stretch of a lane."""
    for lane in lanes:
        for stretch in lane.stretches:
            what = "beyond" if stretch.broken else "at"
            text = f"{lane.words}: {what} its {stretch.side} bound"
            yield Event(stretch.first, "WARN" if stretch.broken else "INFO", text)
            if stretch.last + 1 < len(answers.rows):
                yield Event(stretch.last + 1, "DEBUG", f"{lane.words}: no longer {text.partition(': ')[2]}")


def _of_claims(answers: Answers) -> Iterator[Event]:
    """Yield an event where claims, fallbacks and damping begin, and where damping ends."""
    status = answers.column("status")
    for claim, severity in _TOLD.items():
        for first, last in runs((status == claim).astype(np.int64)):
            yield Event(first, severity, f"the answer is {claim}, for {last + 1 - first} ticks")
    fallback = answers.column("fallback")
    for first, last in runs(np.array([text is not None and text != "" for text in fallback], dtype=np.int64)):
        yield Event(first, "WARN", f"{fallback[first]} answers instead, for {last + 1 - first} ticks")
    if answers.log.damped is not None:
        damped = np.array([value is not None for value in answers.column("damped")], dtype=np.int64)
        for first, last in runs(damped):
            yield Event(
                first, "INFO", f"damped so that the robot comes to rest, for {last + 1 - first} ticks"
            )


def _of_ranks(answers: Answers) -> Iterator[Event]:
    """Yield an event where the rank of a level changes, as far as the resolver remembers ranks.

    A memory is that with which a tick began, so that its ranks are those of the tick before.
    """
    known = answers.column("memory_ranks")
    for place in range(1, len(known) - 1):
        before, after = known[place], known[place + 1]
        if before is None or after is None:
            continue
        for level, (old, new) in enumerate(zip(before, after, strict=True)):
            if old != new and 0 < level <= answers.log.layout.level_count:
                yield Event(place, "INFO" if new > old else "WARN", f"rank of level {level}: {old} → {new}")


def _of_changes(answers: Answers) -> Iterator[Event]:
    """Yield an event for each change of a parameter."""
    for change in answers.log.changes(answers.resolver):
        yield Event(int(np.searchsorted(answers.rows, change.row)), "INFO", f"set {change}")


def _of_words(answers: Answers) -> Iterator[Event]:
    """Yield an event where a sentence of a new kind stands at a tick, for each error, and at the end."""
    before: set[str] = set()
    for place, notes in enumerate(answers.column("notes")):
        kinds = {kind_of(note): note for note in (notes if notes is not None else ())}
        yield from (Event(place, "WARN", note) for kind, note in kinds.items() if kind not in before)
        before = set(kinds)
    errors = answers.column("error")
    for place in np.flatnonzero(answers.failed).tolist():
        yield Event(place, "ERROR", f"a tick raised an error: {errors[place]}")
    why = answers.log.end.why or answers.log.missing
    if why:
        yield Event(len(answers.rows) - 1, "ERROR", f"the log ends here: {why}")
