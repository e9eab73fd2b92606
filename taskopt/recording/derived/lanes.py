"""Lanes: when each limit was active or broken, in words, by level and then the longest ones first."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from taskopt.hierarchy.layout import short_names
from taskopt.log.spans import Span, bound_name, codes, runs, spans
from taskopt.recording.derived.answers import Answers


@dataclass(frozen=True)
class Stretch:
    """Consecutive ticks at which one bound was active or broken.

    Attributes:
        first: Place of the first tick among those of the resolver.
        last: Place of the last one.
        side: "lower" or "upper".
        broken: True if what was sent is beyond the bound.
    """

    first: int
    last: int
    side: str
    broken: bool

    @property
    def state(self) -> str:
        """The state of the bound, in words."""
        return f"beyond {self.side}" if self.broken else self.side


@dataclass(frozen=True)
class Lane:
    """One limit of one joint, or one row, that was ever active or broken.

    Attributes:
        name: Name of the bound, such as "joint_velocity/panda_joint4".
        words: The name in words, such as "joint4 velocity".
        level: The first level that it held back, 1 for the first; one more than the number of levels for the
            norm, and for a bound without a price.
        ticks: Number of ticks at which it was active or broken.
        stretches: When, in the order of time.
    """

    name: str
    words: str
    level: int
    ticks: int
    stretches: tuple[Stretch, ...]


def lanes(answers: Answers) -> tuple[Lane, ...]:
    """Find the lanes of a resolver.

    Args:
        answers: Its ticks.

    Returns:
        The lanes, sorted by level, then by the number of their ticks, then by name.
    """
    found: dict[str, list[Stretch]] = {}
    level: dict[str, int] = {}
    last_level = answers.log.layout.level_count + 1
    for span in spans(answers.log, answers.resolver):
        found.setdefault(span.name, []).append(_active(answers, span))
        level[span.name] = min(level.get(span.name, last_level), span.level or last_level)
    for name, stretch in _broken(answers):
        found.setdefault(name, []).append(stretch)
    unknowns = answers.log.layout.unknowns
    short = dict(zip(unknowns, short_names(unknowns), strict=True))
    made = [
        Lane(
            name,
            _words(name, short),
            level.get(name, last_level),
            sum(stretch.last + 1 - stretch.first for stretch in own),
            tuple(sorted(own, key=lambda stretch: (stretch.first, stretch.broken))),
        )
        for name, own in found.items()
    ]
    return tuple(sorted(made, key=lambda lane: (lane.level, -lane.ticks, lane.name)))


def _words(name: str, short: Mapping[str, str]) -> str:
    """Return a name such as "joint_velocity/panda_joint4" as "joint4 velocity"."""
    owner, _, unknown = name.partition("/")
    told = owner.removeprefix("joint_").replace("_", " ")
    return f"{short.get(unknown, unknown)} {told}" if unknown else told


def _active(answers: Answers, span: Span) -> Stretch:
    """Return the stretch of a span."""
    first, last = np.searchsorted(answers.rows, [span.first, span.last]).tolist()
    return Stretch(first, last, span.side, broken=False)


def _broken(answers: Answers) -> Iterator[tuple[str, Stretch]]:
    """Yield the bounds that were broken, with their names."""
    code = codes(answers.log, answers.rows, answers.beyond)
    for i in np.flatnonzero(answers.beyond.any(axis=0)).tolist():
        for first, last in runs(code[:, i]):
            one = int(code[first, i])
            side = "upper" if one > 0 else "lower"
            yield bound_name(answers.log, i, one), Stretch(first, last, side, broken=True)
