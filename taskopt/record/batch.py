"""A run of consecutive steps of one resolver as columns, (k, …) each."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.review import Cause, LevelAccount
from taskopt.loop.run import Step

Mask = NDArray[np.bool_]

_BROKEN = 1e-9  # [rad/s, m/s] beyond which a bound is left, not met
_NO_PRICE = 1e-9  # as in `Resolution.active`: a multiplier below it (relative) decides nothing


@dataclass(frozen=True, eq=False)
class Batch:
    """k steps, in order; each column is computed once, when it is first asked for."""

    steps: tuple[Step, ...]

    @property
    def resolver(self) -> str:
        return self.steps[0].resolver

    @property
    def layout(self) -> Layout:
        return self.steps[0].hierarchy.layout

    @cached_property
    def index(self) -> IntArray:
        return np.array([step.index for step in self.steps], dtype=np.int64)

    @cached_property
    def t(self) -> Array:
        """Time [s]."""
        return np.array([step.t for step in self.steps])

    @cached_property
    def time(self) -> Any:
        """Time in whole nanoseconds, so that rows of different columns join."""
        return np.rint(self.t * 1e9).astype(np.int64).astype("timedelta64[ns]")

    @cached_property
    def q(self) -> Array:
        return np.array([step.q for step in self.steps])

    @cached_property
    def q_next(self) -> Array:
        return np.array([step.q_next for step in self.steps])

    @cached_property
    def v(self) -> Array:
        return np.array([step.v for step in self.steps])

    @cached_property
    def seconds(self) -> Array:
        return np.array([step.seconds for step in self.steps])

    @cached_property
    def build_seconds(self) -> Array:
        return np.array([step.build_seconds for step in self.steps])

    @cached_property
    def twin_distance(self) -> Array:
        """‖v − v of the closed form of the same hierarchy‖∞."""
        twin = np.array([step.closed_form for step in self.steps])
        return np.abs(self.v - twin).max(axis=1)

    @cached_property
    def worst(self) -> Array:
        """Largest KKT residual of each tick."""
        return np.array([step.resolution.certificate.worst for step in self.steps])

    @cached_property
    def claimed(self) -> Mask:
        return np.array([step.resolution.claimed for step in self.steps])

    @cached_property
    def certified(self) -> Mask:
        return np.array([step.resolution.certified() for step in self.steps])

    @cached_property
    def accurate(self) -> Mask:
        """Whether each answer is as near as was asked for to its active set solved again."""
        return np.array([step.resolution.accurate for step in self.steps])

    @cached_property
    def levels(self) -> tuple[tuple[LevelAccount, ...], ...]:
        """Ranks and damping of each answer, level by level, the hard rows first."""
        reviews = (step.resolution.review for step in self.steps)
        return tuple(() if review is None else review.levels for review in reviews)

    @cached_property
    def causes(self) -> tuple[tuple[Cause, ...], ...]:
        """Why each answer is apart from its closed form; nothing where it is not."""
        reviews = (step.resolution.review for step in self.steps)
        return tuple(() if review is None else review.causes for review in reviews)

    @cached_property
    def task_names(self) -> tuple[str, ...]:
        return tuple(self.steps[0].errors)

    def error(self, task: str) -> Array:
        """e = x_d − x of a task, (k, m), unweighted."""
        return np.array([step.errors[task] for step in self.steps])

    def target(self, task: str) -> Array:
        """Desired pose of a frame task, (k, 4, 4)."""
        return np.array([step.desired[task] for step in self.steps])

    def actual(self, task: str) -> Array:
        """Actual pose of a frame task, (k, 4, 4)."""
        return np.array([step.actual[task] for step in self.steps])

    def in_force(self, task: str) -> Mask:
        """Whether a task asks for anything, (k,): before its time, and after it, its rows have no bounds."""
        rows = next(block.rows for block in self.layout.blocks if block.level and block.name == task)
        asks = np.isfinite(self.lower[:, rows]) | np.isfinite(self.upper[:, rows])
        return np.asarray(asks.any(axis=1))

    @cached_property
    def frame_tasks(self) -> tuple[str, ...]:
        """Tasks that have a desired and an actual pose."""
        return tuple(name for name in self.steps[0].desired if name in self.steps[0].actual)

    @cached_property
    def distance_limits(self) -> tuple[str, ...]:
        """Limits that keep distances."""
        return tuple(self.steps[0].distances)

    def pairs(self, limit: str) -> tuple[str, ...]:
        """Names of the pairs of a limit that keeps distances."""
        return next(block.row_names for block in self.layout.blocks if block.name == limit)

    def distance(self, limit: str) -> Array:
        """Distance of each pair of a limit, (k, P) [m]."""
        return np.array([step.distances[limit].distance for step in self.steps])

    def witness(self, limit: str) -> Array:
        """Nearest points of each pair of a limit, (k, P, 2, 3) [m]."""
        return np.array([step.distances[limit].witness for step in self.steps])

    def residual(self, task: str) -> Array:
        """‖A x − nearest point of [lower, upper]‖ of a task, (k,)."""
        rows = next(block.rows for block in self.layout.blocks if block.level and block.name == task)
        lack = self._value[:, rows] - np.clip(self._value[:, rows], self.lower[:, rows], self.upper[:, rows])
        return np.linalg.norm(lack, axis=1)

    @cached_property
    def lower(self) -> Array:
        return np.array([step.hierarchy.lower for step in self.steps])

    @cached_property
    def upper(self) -> Array:
        return np.array([step.hierarchy.upper for step in self.steps])

    @cached_property
    def _value(self) -> Array:
        return np.array([step.hierarchy.A @ step.v for step in self.steps])

    @cached_property
    def bounded(self) -> Mask:
        """(k, n + M) whether a row is a limit or an inequality: an equality is always met or missed."""
        rows: Mask = self.lower < self.upper
        rows[:, self.layout.rows_of_level(0)] = True
        return np.hstack([np.ones((len(rows), self.layout.n), dtype=bool), rows])

    @cached_property
    def state(self) -> StateArray:
        """(k, n + M): −1 at a lower bound, +1 at an upper one, 0 free; 0 for equalities."""
        every = np.array([step.resolution.state for step in self.steps])
        return every[:, self._declared] * self.bounded

    @cached_property
    def price(self) -> Array:
        """(k, n + M): multiplier of each row at the first level that it holds back; y > 0: upper."""
        every = np.array([step.resolution.multipliers for step in self.steps])
        size = np.abs(every)
        first = np.argmax(size > _NO_PRICE * np.maximum(1.0, size.max(axis=1, keepdims=True)), axis=1)
        prices = np.take_along_axis(every, first[:, None, :], axis=1)[:, 0]
        return prices[:, self._declared] * self.bounded

    @cached_property
    def _declared(self) -> IntArray:
        """Where the rows of the stack stand in an answer: a resolver may solve a problem with more rows."""
        answered = self.steps[0].resolution.problem.layout
        if answered is self.layout:
            return np.arange(self.layout.n + self.layout.row_count)
        places = {name: i for i, name in enumerate([*answered.unknowns, *answered.row_names])}
        return np.array([places[name] for name in self.row_names])

    @cached_property
    def owner(self) -> IntArray:
        """(k, 2, n): which limit the lower and the upper bound of each unknown come from."""
        return np.array([step.hierarchy.owner for step in self.steps]).astype(np.int64)

    @cached_property
    def row_names(self) -> tuple[str, ...]:
        """Unknowns, then rows: n + M names; bounds on an unknown are told apart by `owner`."""
        return (*self.layout.unknowns, *self.layout.row_names)

    @cached_property
    def broken(self) -> StateArray:
        """(k, n + M): −1 where the answer is below a lower bound, +1 above an upper one, else 0."""
        low = np.array([step.hierarchy.box_lower for step in self.steps])
        high = np.array([step.hierarchy.box_upper for step in self.steps])
        value = np.hstack([self.v, self._value])
        lower, upper = np.hstack([low, self.lower]), np.hstack([high, self.upper])
        over = (value > upper + _BROKEN).astype(np.int8) - (value < lower - _BROKEN).astype(np.int8)
        over[:, self.layout.n + int(self.layout.offsets[1]) :] = 0  # a task may stay unmet
        return over

    @cached_property
    def active_code(self) -> IntArray:
        """(k, n + M): 0 where free, ±(1 + owner) for bounds on unknowns, ±1 for rows."""
        return self._with_owner(self.state)

    @cached_property
    def broken_code(self) -> IntArray:
        """(k, n + M): as `active_code`, where an answer that knows no limits leaves them."""
        return self._with_owner(self.broken)

    def _with_owner(self, side: StateArray) -> IntArray:
        code = side.astype(np.int64)
        n = self.layout.n
        code[:, :n] *= 1 + np.where(code[:, :n] > 0, self.owner[:, 1], self.owner[:, 0])
        return code

    def code_words(self, row: int, code: int) -> str:
        """An active code in words: 'joint velocity upper', 'upper', 'free'."""
        if code == 0:
            return "free"
        side = "upper" if code > 0 else "lower"
        return f"{self.layout.owners[abs(code) - 1]} {side}" if row < self.layout.n else side

    def active_name(self, row: int, code: int) -> str:
        """The name of `Active`: limit, unknown and side, such as 'joint velocity/joint1 upper'."""
        side = "upper" if code > 0 else "lower"
        owner = f"{self.layout.owners[abs(code) - 1]}/" if row < self.layout.n else ""
        return f"{owner}{self.row_names[row]} {side}"

    def every(self, period: float, dt: float) -> IntArray:
        """Positions in the batch of the ticks that fall on multiples of `period` [s]."""
        return np.flatnonzero(self.index % max(1, round(period / dt)) == 0)
