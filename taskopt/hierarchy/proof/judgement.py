"""The words in which an answer is judged, and the record of a judgement."""

from dataclasses import dataclass
from enum import Enum

from taskopt.arrays import Array


class Verdict(Enum):
    """What is proven about an answer; the value of each member is its meaning in words."""

    PROVEN = "every entry is as near to the exact optimum as was asked for"
    PROVEN_IF = "it is, if rows that depend on others up to rounding depend on them exactly"
    REFUTED = "some entry is certainly further from the exact optimum"
    UNDECIDED = "double precision cannot tell"
    REFUTED_IF = "some entry is further from it, if rows that depend on others up to rounding depend exactly"


UNDECIDED = (Verdict.UNDECIDED, Verdict.PROVEN_IF, Verdict.REFUTED_IF)
"""Verdicts that count as undecided: what holds on a condition is neither proven nor refuted."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """The judgement of an answer x.

    Attributes:
        error_bound: Upper bound on |x − x*| for the exact optimum x*, entry by entry, (n,), in the unit of x;
            inf if there is none. With PROVEN_IF it holds under the condition that the verdict states.
        verdict: The verdict.
        rows: Names of the rows that the verdict depends on, or that are undecided.
        reason: The reason, in a sentence.
    """

    error_bound: Array
    verdict: Verdict
    rows: tuple[str, ...]
    reason: str

    @property
    def proven(self) -> bool:
        """True if the verdict is PROVEN."""
        return self.verdict is Verdict.PROVEN
