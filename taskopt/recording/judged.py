"""What is proven about the answers of one resolver: counts of verdicts, and the largest error bound."""

from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taskopt.hierarchy.proof import UNDECIDED, Verdict
from taskopt.recording.batch import Batch

_TOLD = {  # verdicts of which the first tick is told, with their words
    Verdict.REFUTED: "refuted",
    Verdict.UNDECIDED: "undecided",
    Verdict.PROVEN_IF: "undecided but for a condition",
    Verdict.REFUTED_IF: "undecided, and not the optimum on a condition",
}


class ErrorBound(NamedTuple):
    """The largest finite bound on the error of an unknown.

    Attributes:
        value: The bound, in `unit`.
        unknown: The name of the unknown.
        unit: Its unit, such as "rad/s", or "rad/s²" at order 2.
        t: The time of the tick [s].
    """

    value: float
    unknown: str
    unit: str
    t: float

    def __str__(self) -> str:
        return f"{self.value:.1e} {self.unit} of {self.unknown} at {self.t:g} s"


@dataclass
class JudgedTicks:
    """The verdicts on the answers of one resolver, accumulated batch by batch.

    Attributes:
        counts: The number of judged ticks by verdict.
        claimed: The number of judged ticks at which the resolver claims an optimum, by verdict.
        bound: The largest finite error bound; None if no answer has one.
        unbounded: The number of judged ticks without a finite error bound.
        first: The time [s] and the reason of the first answer with each verdict other than PROVEN.
    """

    counts: Counter[Verdict] = field(default_factory=Counter)
    claimed: Counter[Verdict] = field(default_factory=Counter)
    bound: ErrorBound | None = None
    unbounded: int = 0
    first: dict[Verdict, tuple[float, str]] = field(default_factory=dict)

    @property
    def ticks(self) -> int:
        """The number of judged ticks."""
        return self.counts.total()

    @property
    def proven(self) -> int:
        """The number of answers whose error bound is below what was asked for."""
        return self.counts[Verdict.PROVEN]

    @property
    def refuted(self) -> int:
        """The number of answers that are certainly further from the optimum than was asked for."""
        return self.counts[Verdict.REFUTED]

    @property
    def undecided(self) -> int:
        """The number of all other judged answers."""
        return sum(self.counts[verdict] for verdict in UNDECIDED)

    def add(self, batch: Batch) -> None:
        """Add a batch.

        Args:
            batch: Consecutive steps of one resolver.
        """
        for step, verdict, bound in zip(batch.steps, batch.verdicts, batch.error_bound, strict=True):
            if verdict is None:
                continue
            self.counts[verdict] += 1
            self.claimed[verdict] += step.resolution.claimed
            if verdict in _TOLD and verdict not in self.first:
                self.first[verdict] = step.t, step.resolution.certificate.judgement.reason
            worst = int(np.argmax(bound))
            if not np.isfinite(bound[worst]):
                self.unbounded += 1
            elif self.bound is None or bound[worst] > self.bound.value:
                name, unit = batch.layout.unknowns[worst], batch.layout.unit(worst)
                self.bound = ErrorBound(float(bound[worst]), name, unit, step.t)

    def sentences(self, ticks: int) -> list[str]:
        """Say how many ticks were judged, the largest error bound, and what is refuted or undecided.

        Args:
            ticks: The number of all ticks.

        Returns:
            The sentences; the first one is there for every run.
        """
        bound = f"largest error bound {self.bound or 'none'}"
        without = f", {self.unbounded} ticks without a bound" if self.unbounded else ""
        lines = [f"{self.ticks} of {ticks} ticks judged: {bound}{without}"]
        for verdict, word in _TOLD.items():
            if verdict in self.first:
                t, reason = self.first[verdict]
                lies = f", {self.claimed[verdict]} of them claimed" if self.claimed[verdict] else ""
                lines.append(f"{self.counts[verdict]} ticks {word}{lies}, first at {t:g} s: {reason}")
        return lines
