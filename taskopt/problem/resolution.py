"""The answer to a hierarchy: x, what each task still lacks, what binds, and the proof."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.problem.certificate import RESIDUALS, TOLERANCE, Certificate
from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.layout import Layout


class Status(Enum):
    """What a resolver says of its own answer; the value is the advice. A claim, not a proof."""

    SOLVED = "it claims an optimum; the certificate decides"
    FORMULA = "a closed form that knows no limits; it claims nothing"
    ITERATION_LIMIT = "it stopped before it was done; scale the rows, or ask for less accuracy"
    INFEASIBLE = "the hard limits contradict each other; relax one of them"
    FAILED = "it gave up, or its answer is not a number; look at the rows it was given"


class Active(NamedTuple):
    """One row that holds the answer back: its name, the side, and its price at the level it binds."""

    name: str
    side: str  # "lower", "upper"
    multiplier: float  # y > 0 at the upper bound, y < 0 at the lower
    level: int  # the first level with a multiplier here; level_count + 1 is the norm

    def __str__(self) -> str:
        return f"{self.name} {self.side}"


def answer_size(layout: Layout) -> int:
    """Length of an answer: x (n), multipliers (levels + 1)(n + M), certificate (levels + 1) 4."""
    return layout.n + (layout.level_count + 1) * (layout.n + layout.row_count + len(RESIDUALS))


@dataclass(eq=False)
class Resolution:
    """x with its multipliers and certificate, and the hierarchy it answers.

    `answer` is a flat array (see `answer_size`), `state` (n + M) is -1 where a lower bound is in the
    final active set, +1 for an upper one, else 0. Everything else is derived when asked for.
    """

    problem: Hierarchy
    answer: Array
    state: StateArray
    status: Status
    iterations: int = 0

    @cached_property
    def x(self) -> Array:
        """The unknowns, (n,)."""
        return self.answer[: self.problem.n]

    @property
    def v(self) -> Array:
        """The unknowns of a robot's first-order stack: joint velocities, (nv,) [rad/s, m/s]."""
        return self.x

    @cached_property
    def multipliers(self) -> Array:
        """(levels + 1, n + M): what box and rows cost each level, the last row for the norm."""
        layout = self.problem.layout
        width = layout.n + layout.row_count
        stop = layout.n + (layout.level_count + 1) * width
        return self.answer[layout.n : stop].reshape(layout.level_count + 1, width)

    @cached_property
    def certificate(self) -> Certificate:
        """KKT residuals by level; for a closed form, of an answer that claims nothing."""
        levels = self.problem.layout.level_count + 1
        return Certificate(self.answer[-levels * len(RESIDUALS) :].reshape(levels, len(RESIDUALS)))

    @property
    def claimed(self) -> bool:
        """Whether the resolver says that this is the optimum."""
        return self.status is Status.SOLVED

    def certified(self, tolerance: float = TOLERANCE) -> bool:
        """Whether we could prove that this is the optimum."""
        return self.certificate.proves(tolerance)

    @cached_property
    def active(self) -> tuple[Active, ...]:
        """Rows in the final active set, by name: limits first, then inequality tasks."""
        return tuple(self._active_row(int(i)) for i in np.flatnonzero(self.state))

    @cached_property
    def residuals(self) -> dict[str, Array]:
        """What each task lacks, A x minus the nearest point of [lower, upper], by name."""
        value = self.problem.A @ self.x
        lack = value - np.clip(value, self.problem.lower, self.problem.upper)
        return {b.name: lack[b.rows] for b in self.problem.layout.blocks if b.level > 0}

    def explain(self) -> str:
        """What is met, what is not, and which limits keep it so, in words and numbers."""
        from taskopt.problem.explanation import explain

        return explain(self)

    def _active_row(self, i: int) -> Active:
        n = self.problem.n
        upper = self.state[i] > 0
        name = self.problem.bound_name(i, upper) if i < n else self.problem.layout.row_names[i - n]
        prices = self.multipliers[:, i]
        level = int(np.argmax(np.abs(prices) > 1e-9 * max(1.0, float(np.abs(prices).max()))))
        return Active(name, "upper" if upper else "lower", float(prices[level]), level + 1)
