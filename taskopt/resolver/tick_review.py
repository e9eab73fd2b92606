"""The review of one answer: its closed form, the error of x, and the causes of a difference."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import equality_levels
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import Cause, LevelAccount, Review
from taskopt.hierarchy.status import NO_OPTIMUM, Status
from taskopt.hierarchy.tolerances import ACCURACY, DOUBTFUL_KEPT, DOUBTFUL_LOST, SMALLEST_VELOCITY
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.descent import LevelEqualities, TaskPriority, descend

Accounts: TypeAlias = tuple[LevelAccount, ...] | Callable[[Hierarchy], tuple[LevelAccount, ...]]
"""Ranks and damping by level, or a function that finds them for a problem when they are asked for."""


@dataclass(frozen=True, eq=False)
class TickReview(Review):
    """The review of one resolution; nothing is computed before the first access, to keep ticks fast.

    Attributes:
        resolution: The answer under review.
        accuracy: Accuracy of x, relative to its largest entry, that the resolver was asked for.
        own: Ranks and damping that the resolver decided itself; empty if it does not report them.
    """

    resolution: Resolution
    accuracy: float = ACCURACY
    own: Accounts = ()

    @cached_property
    def closed_form(self) -> Array:
        """x (n,) of task priority on the equalities of the same problem, without damping."""
        return task_priority(self.resolution.problem)

    @property
    def levels(self) -> tuple[LevelAccount, ...]:
        """Ranks and damping by level, the hard rows first."""
        return self._own or self._on_active_set.levels

    @cached_property
    def difference(self) -> float:
        """Largest difference from the closed form, ‖x − closed_form‖∞ [rad/s, m/s]."""
        return float(np.abs(self.resolution.x - self.closed_form).max())

    @cached_property
    def error(self) -> float:
        """Relative error of x, by solving again on the final active set; NaN if no optimum is aimed at."""
        if self.resolution.status in NO_OPTIMUM:
            return np.nan
        return _relative_distance(self.resolution.x, self._on_active_set.x)

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """The causes of a difference from the closed form; empty if it is within the accuracy."""
        resolution = self.resolution
        if not _relative_distance(resolution.x, self.closed_form) > self.accuracy:
            return ()
        limits = [Cause("limit", str(a)) for a in resolution.active if a.multiplier != 0.0]
        damped = [_damping_cause(level) for level in self.levels if level.damping > 0.0]
        return (*limits, *damped, *self._other_causes())

    def _other_causes(self) -> tuple[Cause, ...]:
        """Return the other causes of a difference: the formula, doubtful ranks, or the solver's accuracy."""
        if self.resolution.status is Status.FORMULA and not self._own:
            return (Cause("formula", "a formula that does not solve the problem"),)
        if self.resolution.status is Status.FORMULA:
            pairs = zip(self._own, self._unconstrained.levels, strict=True)
            return tuple(_rank_cause(own) for own, cold in pairs if own.rank != cold.rank)
        if not self.error > self.accuracy:
            return ()
        doubtful = [
            level for level in self.levels if level.kept < DOUBTFUL_KEPT or level.dropped > DOUBTFUL_LOST
        ]
        accuracy = Cause("accuracy", f"solver accuracy, {self.error:.1e} of x")
        return tuple(map(_rank_cause, doubtful)) or (accuracy,)

    @cached_property
    def _own(self) -> tuple[LevelAccount, ...]:
        """Ranks and damping that the resolver decided itself."""
        return self.own(self.resolution.problem) if callable(self.own) else self.own

    @cached_property
    def _unconstrained(self) -> TaskPriority:
        """Task priority on the equalities alone."""
        problem = self.resolution.problem
        return descend(equality_levels(problem), problem.norm)

    @cached_property
    def _on_active_set(self) -> TaskPriority:
        """Task priority on the equalities and the active inequalities; the same if none is active."""
        problem, state = self.resolution.problem, self.resolution.state
        return descend(active_levels(problem, state), problem.norm) if state.any() else self._unconstrained


def active_levels(problem: Hierarchy, state: StateArray) -> list[LevelEqualities]:
    """Return the equalities and active inequalities of each level as equalities, the box in level 0.

    An active inequality is an equality of its own level, in least squares.

    Args:
        problem: The hierarchy.
        state: (n + M,) active set, see `Memory`.

    Returns:
        (A, b, weight) of each level, the hard rows first.

    Source:
        Escande, Mansard and Wieber (2014), Sect. 4.
    """
    return [_active_level(problem, state, k) for k in range(problem.layout.level_count + 1)]


def _active_level(problem: Hierarchy, state: StateArray, k: int) -> LevelEqualities:
    """Return (A, b, weight) of level k; level 0 are the hard rows and the box."""
    n, level, rows = problem.n, problem.level(k), problem.layout.rows_of_level(k)
    A, lower, upper, side = level.A, level.lower, level.upper, state[n:][rows]
    weight = level.weight if k else np.ones(len(lower))
    if k == 0:
        A = np.vstack([np.eye(n), A])
        lower, upper = problem.bounds(rows.stop)
        side, weight = np.concatenate([state[:n], side]), np.ones(n + len(weight))
    active = (lower == upper) | (side != 0)
    bound = np.where(side < 0, lower, upper)
    return A[active], bound[active], weight[active]


def _relative_distance(x: Array, other: Array) -> float:
    """Return ‖x − other‖∞ relative to ‖other‖∞, inf where x is not a number."""
    size = max(SMALLEST_VELOCITY, float(np.abs(other).max(initial=0.0)))
    distance = float(np.abs(x - other).max(initial=0.0)) / size
    return distance if np.isfinite(distance) else np.inf


def _damping_cause(level: LevelAccount) -> Cause:
    """Return the damping of a level as a cause."""
    return Cause("damping", f"damping of level {level.level}, k² = {level.damping:.2g}")


def _rank_cause(level: LevelAccount) -> Cause:
    """Return the rank of a level as a cause."""
    return Cause("rank", f"rank of level {level.level}, {level.rank} of {level.rank + level.lost} directions")
