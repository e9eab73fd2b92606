"""Jumps: changes of an answer from tick to tick that are large beside those of the problem, and their causes.

For matrices that stand still the answer is a Lipschitz continuous function of all bounds and right-hand
sides, so that an answer which changes far more than its problem shows one of few causes (`causes`).
"""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, BoolArray
from taskopt.hierarchy.causes import ADVICE, declared, loses_rank, overshoots, switches, ties
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import FOLLOWS_DATA, LEAST_CHANGE, SMALLEST_JUMP


class Jump(NamedTuple):
    """The change of the answer from one tick to the next.

    Attributes:
        tick: Number of the later tick, from 0.
        unknown: Name of the unknown that changes most, such as a joint.
        size: |x_k − x_(k−1)| of it [rad/s, m/s].
        moved: Largest change of the problem, see `change_of_problem` [rad/s, m/s].
        cause: The cause, a key of `causes.ADVICE`.
    """

    tick: int
    unknown: str
    size: float
    moved: float
    cause: str

    @property
    def ratio(self) -> float:
        """Change of the answer for each unit of change of the problem."""
        return self.size / max(self.moved, LEAST_CHANGE)

    @property
    def is_abrupt(self) -> bool:
        """True if the answer does more than follow its problem."""
        return self.size >= SMALLEST_JUMP and self.ratio > FOLLOWS_DATA

    def __str__(self) -> str:
        return (
            f"{self.unknown} changes by {self.size:.2g} from tick {self.tick - 1} to {self.tick}, "
            f"{self.ratio:.2g} times as much as the problem; {self.cause}: {ADVICE[self.cause]}"
        )


class JumpWatch:
    """Find the largest jumps of a run tick by tick; only the last tick is kept.

    Attributes:
        largest: The largest jump, None before the second tick.
        steepest: The jump that is largest relative to the change of the problem, among those of at least
            `SMALLEST_JUMP`; None if there is none.
    """

    def __init__(self) -> None:
        self.largest: Jump | None = None
        self.steepest: Jump | None = None
        self._previous: Resolution | None = None
        self._tick = -1

    def add(self, resolution: Resolution, in_transition: bool = False) -> float:
        """Compare the next tick with the one before it.

        Args:
            resolution: The answer of the next tick.
            in_transition: True if a task comes or goes at this tick.

        Returns:
            max |x_k − x_(k−1)| [rad/s, m/s]; 0 for the first tick.
        """
        previous, self._previous, self._tick = self._previous, resolution, self._tick + 1
        if previous is None:
            return 0.0
        change = np.abs(resolution.x - previous.x)
        size = float(change.max())
        is_largest = self.largest is None or size > self.largest.size
        if not is_largest and size < SMALLEST_JUMP:
            return size
        moved = change_of_problem(previous, resolution)
        ratio = size / max(moved, LEAST_CHANGE)
        is_steepest = size >= SMALLEST_JUMP and (self.steepest is None or ratio > self.steepest.ratio)
        if is_largest or is_steepest:
            name = resolution.problem.layout.unknowns[int(change.argmax())]
            cause = _cause(previous, resolution, in_transition=in_transition, ratio=ratio)
            jump = Jump(self._tick, name, size, moved, cause)
            self.largest = jump if is_largest else self.largest
            self.steepest = jump if is_steepest else self.steepest
        return size


def change_of_problem(previous: Resolution, now: Resolution) -> float:
    """Return the largest change of what decides the answer, in the unit of the unknowns.

        max over rows of (|Δb| + |ΔA x|) / ‖A‖, over active bounds of |Δb|

    Rows count that are equalities or active at either tick, bounds that are active at either tick. x is the
    previous answer. A bound that becomes finite, or stops being so, does not count: that is a switch.

    Args:
        previous: The answer of one tick.
        now: The answer of the next tick, to a problem of the same stack.

    Returns:
        The change [rad/s, m/s].
    """
    old, new = declared(previous), declared(now)
    before, after, n = old.problem, new.problem, new.problem.n
    low, high = ((old.state == side) | (new.state == side) for side in (-1, 1))
    equal = (before.lower == before.upper) | (after.lower == after.upper)
    low[n:] |= equal
    high[n:] |= equal
    of_box = np.maximum(
        _moved(before.box_lower, after.box_lower, low[:n]),
        _moved(before.box_upper, after.box_upper, high[:n]),
    )
    of_rows = np.maximum(
        _moved(before.lower, after.lower, low[n:]), _moved(before.upper, after.upper, high[n:])
    )
    of_rows += np.abs((after.A - before.A) @ old.x) * (low[n:] | high[n:])
    size = np.linalg.norm(after.A, axis=1)
    size[size == 0.0] = 1.0
    return float(max(of_box.max(initial=0.0), (of_rows / size).max(initial=0.0)))


def _moved(before: Array, after: Array, counts: BoolArray) -> Array:
    """Return |after − before| of the bounds that count; 0 for one that is infinite at either tick."""
    finite = np.isfinite(before) & np.isfinite(after) & counts
    moved = np.zeros(len(after))
    moved[finite] = np.abs(after[finite] - before[finite])
    return moved


def _cause(previous: Resolution, now: Resolution, *, in_transition: bool, ratio: float) -> str:
    """Return the likely cause of a jump, a key of `ADVICE`."""
    abrupt = ratio > FOLLOWS_DATA
    if switches(previous, now):
        return "transition"
    if abrupt and loses_rank(previous, now):
        return "rank"
    if abrupt and ties(previous, now):
        return "tolerance"
    if in_transition:
        return "transition"
    return "gain" if overshoots(previous, now) else "dt"
