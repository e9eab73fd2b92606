"""The second look at an answer: its closed form, its active set solved again, and why they differ."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import equality_levels
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import Cause, LevelAccount, Review
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY, SMALLEST_VELOCITY
from taskopt.resolver.closed_form import Descent, descend

_NO_OPTIMUM = frozenset({Status.FORMULA, Status.BRAKED})  # they do not aim at one
_NEAR, _NOISE = 1e-8, 1e-13  # singular values between them, relative, are lost to some and kept by others


@dataclass(frozen=True, eq=False)
class TickReview(Review):
    """Nothing is solved until it is asked for: a control loop that never asks never pays.

    `accuracy` is what the resolver was asked for in x; `own` are the ranks and damping that it decided
    itself, empty where it does not tell.
    """

    resolution: Resolution
    accuracy: float = ACCURACY
    own: tuple[LevelAccount, ...] = ()

    @property
    def closed_form(self) -> Array:
        return self._free.x

    @property
    def levels(self) -> tuple[LevelAccount, ...]:
        return self.own or self._held.levels

    @cached_property
    def difference(self) -> float:
        return float(np.abs(self.resolution.x - self.closed_form).max())

    @cached_property
    def error(self) -> float:
        if self.resolution.status in _NO_OPTIMUM:
            return np.nan
        return _apart(self.resolution.x, self._held.x)

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        resolution = self.resolution
        if not _apart(resolution.x, self.closed_form) > self.accuracy:
            return ()
        held = [Cause("limit", str(a)) for a in resolution.active if a.multiplier != 0.0]
        damped = [_damping(level) for level in self.levels if level.damping > 0.0]
        return (*held, *damped, *self._decisions())

    def _decisions(self) -> tuple[Cause, ...]:
        """Where x is not what its active set leads to: a rank that may go either way, else the solver."""
        if self.resolution.status is Status.FORMULA:
            pairs = zip(self.own, self._free.levels, strict=True)
            return tuple(_rank(mine) for mine, cold in pairs if mine.rank != cold.rank)
        if not self.error > self.accuracy:
            return ()
        doubtful = [level for level in self.levels if level.kept < _NEAR or level.dropped > _NOISE]
        return tuple(map(_rank, doubtful)) or (Cause("accuracy", f"solver accuracy, {self.error:.1e} of x"),)

    @cached_property
    def _free(self) -> Descent:
        problem = self.resolution.problem
        return descend(equality_levels(problem), problem.norm)

    @cached_property
    def _held(self) -> Descent:
        """The same as `_free` with what is active as equalities; one of them if nothing is."""
        problem, state = self.resolution.problem, self.resolution.state
        return descend(held_levels(problem, state), problem.norm) if state.any() else self._free


def held_levels(problem: Hierarchy, state: np.ndarray) -> list[tuple[Array, Array, Array]]:
    """(A, b, weight) of the equalities and active inequalities of each level, the box in level 0.

    An active inequality is an equality row of its own level, in least squares. Escande, Mansard and
    Wieber (2014), Sect. 4.
    """
    return [_held(problem, state, k) for k in range(problem.layout.level_count + 1)]


def _held(problem: Hierarchy, state: np.ndarray, k: int) -> tuple[Array, Array, Array]:
    n, level, rows = problem.n, problem.level(k), problem.layout.rows_of_level(k)
    A, lower, upper, side = level.A, level.lower, level.upper, state[n:][rows]
    weight = level.weight if k else np.ones(len(lower))
    if k == 0:
        A = np.vstack([np.eye(n), A])
        lower = np.concatenate([problem.box_lower, lower])
        upper = np.concatenate([problem.box_upper, upper])
        side, weight = np.concatenate([state[:n], side]), np.ones(n + len(weight))
    held = (lower == upper) | (side != 0)
    bound = np.where(side < 0, lower, upper)
    return A[held], bound[held], weight[held]


def _apart(x: Array, other: Array) -> float:
    """‖x − other‖∞ relative to ‖other‖∞; inf where x is not a number."""
    size = max(SMALLEST_VELOCITY, float(np.abs(other).max(initial=0.0)))
    distance = float(np.abs(x - other).max(initial=0.0)) / size
    return distance if np.isfinite(distance) else np.inf


def _damping(level: LevelAccount) -> Cause:
    return Cause("damping", f"damping of level {level.level}, k² = {level.damping:.2g}")


def _rank(level: LevelAccount) -> Cause:
    return Cause("rank", f"rank of level {level.level}, {level.rank} of {level.rank + level.lost} directions")
