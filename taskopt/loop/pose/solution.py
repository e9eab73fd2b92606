"""The result of a search for a posture: the posture, its errors, and the verdict with its reason."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from taskopt.arrays import Array


class Verdict(Enum):
    """The outcome of a search for a posture; the value describes it in words.

    Only SOLVED is proven, namely by the errors. The other three are judgements from the starts that were
    tried.
    """

    SOLVED = "every goal is met, and the limits are kept"
    LIMIT = "limits are in the way: without them the goals are met"
    UNREACHABLE = "no posture comes nearer: several starts end at the same least error"
    LOCAL_MINIMUM = "no start leads to the goals, and none of the ends is confirmed as the nearest"


class GoalError(NamedTuple):
    """The error of one goal; each part is the Euclidean norm of the rows in one unit.

    Attributes:
        position: Norm of the rows in metres [m].
        orientation: Norm of the rows in radians [rad].
        other: Norm of all other rows, in their own unit.
    """

    position: float
    orientation: float
    other: float

    def __str__(self) -> str:
        parts = zip(self, ("m", "rad", ""), strict=True)
        return ", ".join(f"{value:.3g} {unit}".strip() for value, unit in parts if value > 0.0) or "nothing"


@dataclass(frozen=True, eq=False)
class PoseSolution:
    """A posture and the verdict on it.

    Attributes:
        q: The posture, (nq,) [rad, m]; where the goals are not met, the nearest that was found.
        verdict: The outcome of the search.
        reason: The verdict in one sentence, with names and numbers.
        errors: Error of each task at q, by its name.
        limits: Limits that keep the goals from being met at q, by name and side; empty unless the verdict is
            LIMIT.
        starts: Number of starts that were tried.
        iterations: Number of ticks of all starts together.
        at_rest: True if no step at q would improve a level below the goals, or if there is no such level.
    """

    q: Array
    verdict: Verdict
    reason: str
    errors: dict[str, GoalError]
    limits: tuple[str, ...]
    starts: int
    iterations: int
    at_rest: bool

    @property
    def solved(self) -> bool:
        """True if every goal is met and the limits are kept."""
        return self.verdict is Verdict.SOLVED
