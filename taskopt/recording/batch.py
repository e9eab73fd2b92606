"""Consecutive steps of one resolver as columns: one array per quantity, one row per step."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.review import Cause, LevelAccount
from taskopt.hierarchy.tolerances import COUNTED_MULTIPLIER, SHOWN_VIOLATION
from taskopt.loop.run import Step

Nanoseconds = NDArray[np.timedelta64]


@dataclass(frozen=True, eq=False)
class Batch:
    """k consecutive steps as columns, each of which is computed at the first access.

    Rows of the hierarchy are counted as in its multipliers: first the n unknowns, whose bounds form the box,
    then the M rows. The state of a row is −1 at its lower bound, +1 at its upper bound and 0 between them.
    The code of a row is a number that encodes its state and its name. For an unknown, which several limits
    may bound, it is the state times (1 + index of the limit in `layout.owners`); for a row with a label, the
    state times the label; for any other row, the state.

    Attributes:
        steps: The steps, (k,), in the order of time, all of the same resolver.
    """

    steps: tuple[Step, ...]

    @property
    def resolver(self) -> str:
        """The name of the resolver."""
        return self.steps[0].resolver

    @property
    def layout(self) -> Layout:
        """The names and sizes of the hierarchy, the same in every step."""
        return self.steps[0].hierarchy.layout

    @cached_property
    def index(self) -> IntArray:
        """The numbers of the ticks, (k,)."""
        return np.array([step.index for step in self.steps], dtype=np.int64)

    @cached_property
    def t(self) -> Array:
        """The times of the ticks, (k,) [s]."""
        return np.array([step.t for step in self.steps])

    @cached_property
    def time(self) -> Nanoseconds:
        """The times of the ticks in whole nanoseconds, (k,), so that rows of different columns join."""
        return np.rint(self.t * 1e9).astype(np.int64).astype("timedelta64[ns]")

    @cached_property
    def q(self) -> Array:
        """The configurations at which the hierarchies were built, (k, nq) [rad, m]."""
        return np.array([step.q for step in self.steps])

    @cached_property
    def q_next(self) -> Array:
        """The configurations after the Euler steps, (k, nq) [rad, m]."""
        return np.array([step.q_next for step in self.steps])

    @cached_property
    def v(self) -> Array:
        """The velocities, (k, nv) [rad/s, m/s]; at order 2 those after the steps."""
        return np.array([step.v for step in self.steps])

    @cached_property
    def x(self) -> Array:
        """The answers, (k, nv): `v`, at order 2 the accelerations [rad/s², m/s²]."""
        return np.array([step.x for step in self.steps])

    @cached_property
    def seconds(self) -> Array:
        """The times that the resolver took, (k,) [s]."""
        return np.array([step.seconds for step in self.steps])

    @cached_property
    def solver_seconds(self) -> Array:
        """The parts of `seconds` that were spent inside the package of a solver, (k,) [s]."""
        return np.array([step.solver_seconds for step in self.steps])

    @cached_property
    def build_seconds(self) -> Array:
        """The times that kinematics and rows took, (k,) [s]."""
        return np.array([step.build_seconds for step in self.steps])

    @cached_property
    def closed_form_distance(self) -> Array:
        """The largest differences of x from the closed-form answer, (k,) in the unit of x."""
        return np.array([step.closed_form_distance for step in self.steps])

    @cached_property
    def kkt_residual(self) -> Array:
        """The largest KKT residual of each answer, (k,)."""
        return np.array([step.resolution.certificate.worst for step in self.steps])

    @cached_property
    def claimed(self) -> Mask:
        """True where the resolver claims an optimum, (k,)."""
        return np.array([step.resolution.claimed for step in self.steps])

    @cached_property
    def judged(self) -> Mask:
        """True where the answer is judged, (k,); a judgement takes longer than a tick."""
        return np.array([step.judged for step in self.steps])

    @cached_property
    def verdicts(self) -> tuple[Verdict | None, ...]:
        """The verdict on each answer; None where it is not judged."""
        return tuple(step.resolution.certificate.verdict if step.judged else None for step in self.steps)

    @cached_property
    def error_bound(self) -> Array:
        """The bound on the error of each unknown, (k, nv) in the unit of x; NaN where it is not judged.

        It is inf where nothing is proven about the optimum.
        """
        bounds = np.full(self.x.shape, np.nan)
        for k in np.flatnonzero(self.judged).tolist():
            bounds[k] = self.steps[k].resolution.certificate.error_bound
        return bounds

    @cached_property
    def levels(self) -> tuple[tuple[LevelAccount, ...], ...]:
        """The ranks and dampings of each answer, level by level, hard rows first; empty without a review."""
        reviews = (step.resolution.review for step in self.steps)
        return tuple(() if review is None else review.levels for review in reviews)

    @cached_property
    def causes(self) -> tuple[tuple[Cause, ...], ...]:
        """The reasons why each answer differs from its closed-form answer; empty where it does not."""
        reviews = (step.resolution.review for step in self.steps)
        return tuple(() if review is None else review.causes for review in reviews)

    @cached_property
    def task_names(self) -> tuple[str, ...]:
        """The names of the tasks, in order of priority."""
        return tuple(self.steps[0].errors)

    def error(self, task: str) -> Array:
        """Return the unweighted error e = x_d − x of a task.

        Args:
            task: The name of the task, which has m rows.

        Returns:
            The errors, (k, m), each in the unit of its row.
        """
        return np.array([step.errors[task] for step in self.steps])

    def desired(self, task: str) -> Array:
        """Return the desired pose of a frame task.

        Args:
            task: The name of the task, one of `frame_tasks`.

        Returns:
            Homogeneous matrices, (k, 4, 4), in the world frame [m].
        """
        return np.array([step.desired[task] for step in self.steps])

    def actual(self, task: str) -> Array:
        """Return the actual pose of the frame of a frame task.

        Args:
            task: The name of the task, one of `frame_tasks`.

        Returns:
            Homogeneous matrices, (k, 4, 4), in the world frame [m].
        """
        return np.array([step.actual[task] for step in self.steps])

    def in_force(self, task: str) -> Mask:
        """Find the ticks at which a task is in force; outside its time the rows of a task have no bounds.

        Args:
            task: The name of the task.

        Returns:
            True where any row of the task has a bound, (k,).
        """
        rows = self._task_block(task).rows
        asks = np.isfinite(self.lower[:, rows]) | np.isfinite(self.upper[:, rows])
        return np.asarray(asks.any(axis=1))

    @cached_property
    def frame_tasks(self) -> tuple[str, ...]:
        """The names of the tasks that have a desired and an actual pose."""
        return tuple(name for name in self.steps[0].desired if name in self.steps[0].actual)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """The names of the obstacles that move."""
        return tuple(self.steps[0].moving)

    def obstacle(self, name: str) -> Array:
        """Return the pose of an obstacle that moves.

        Args:
            name: The name of the obstacle, one of `moving`.

        Returns:
            Homogeneous matrices, (k, 4, 4), in the world frame [m].
        """
        return np.array([step.moving[name] for step in self.steps])

    @cached_property
    def distance_limits(self) -> tuple[str, ...]:
        """The names of the limits that keep distances between pairs of bodies."""
        return tuple(self.steps[0].distances)

    def pairs(self, limit: str) -> tuple[str, ...]:
        """Return the names of the pairs of bodies that a limit keeps apart.

        Args:
            limit: The name of the limit, one of `distance_limits`.

        Returns:
            The names of its P pairs.
        """
        block = next(block for block in self.layout.blocks if block.name == limit and block.level == 0)
        return block.choices or block.row_names

    def distance(self, limit: str) -> Array:
        """Return the distance of each pair of a limit.

        Args:
            limit: The name of the limit, one of `distance_limits`.

        Returns:
            Signed distances, (k, P) [m], negative where two bodies overlap.
        """
        return np.array([step.distances[limit].distance for step in self.steps])

    def witness(self, limit: str) -> Array:
        """Return the two nearest points of each pair of a limit.

        Args:
            limit: The name of the limit, one of `distance_limits`.

        Returns:
            Points on the first and on the second body, (k, P, 2, 3), in the world frame [m].
        """
        return np.array([step.distances[limit].witness for step in self.steps])

    def held_off(self, limit: str) -> Mask:
        """Find the pairs of a limit that an active row keeps apart.

        Args:
            limit: The name of the limit, one of `distance_limits`.

        Returns:
            True for each such pair, (k, P).
        """
        block = next(block for block in self.layout.blocks if block.name == limit and block.level == 0)
        active = self.state[:, self.layout.n :][:, block.rows] != 0
        if not block.choices:
            return active
        out = np.zeros((len(self.steps), len(block.choices)), dtype=bool)
        ticks, rows = np.nonzero(active)
        out[ticks, self.label[:, block.rows][ticks, rows] - 1] = True
        return out

    def residual(self, task: str) -> Array:
        """Return the distance of A x to the interval [lower, upper] of a task.

        Args:
            task: The name of the task.

        Returns:
            The 2-norms over the rows of the task, (k,).
        """
        rows = self._task_block(task).rows
        value = self._value[:, rows]
        return np.linalg.norm(value - np.clip(value, self.lower[:, rows], self.upper[:, rows]), axis=1)

    @cached_property
    def lower(self) -> Array:
        """The lower bounds of the rows, (k, M)."""
        return np.array([step.hierarchy.lower for step in self.steps])

    @cached_property
    def upper(self) -> Array:
        """The upper bounds of the rows, (k, M)."""
        return np.array([step.hierarchy.upper for step in self.steps])

    @cached_property
    def inequality(self) -> Mask:
        """True for bounds, hard rows and inequality rows of tasks, (k, n + M), and False for equalities."""
        rows: Mask = self.lower < self.upper
        rows[:, self.layout.rows_of_level(0)] = True
        return np.hstack([np.ones((len(rows), self.layout.n), dtype=bool), rows])

    @cached_property
    def state(self) -> StateArray:
        """The final active set of each answer, (k, n + M): −1 lower, +1 upper, 0 inactive or equality."""
        return (
            np.array([step.resolution.state[self._declared(step)] for step in self.steps]) * self.inequality
        )

    @cached_property
    def multiplier(self) -> Array:
        """The multiplier of each row at the first level where it is not zero, (k, n + M).

        It is positive at an upper bound, negative at a lower bound and zero for equality rows.
        """
        answers = [step.resolution.multipliers[:, self._declared(step)] for step in self.steps]
        multipliers = np.array(answers)
        size = np.abs(multipliers)
        least = COUNTED_MULTIPLIER * np.maximum(1.0, size.max(axis=1, keepdims=True))
        first = np.argmax(size > least, axis=1)
        chosen = np.take_along_axis(multipliers, first[:, None, :], axis=1)[:, 0]
        return chosen * self.inequality

    @cached_property
    def owner(self) -> IntArray:
        """The limits behind lower and upper bounds, (k, 2, n): indices into `layout.owners`."""
        return np.array([step.hierarchy.owner for step in self.steps]).astype(np.int64)

    @cached_property
    def label(self) -> IntArray:
        """The labels of the rows, (k, M): numbers of their names, counted from 1; 0 for their own names."""
        return np.array([step.hierarchy.label for step in self.steps]).astype(np.int64)

    @cached_property
    def row_names(self) -> tuple[str, ...]:
        """The n names of the unknowns, then the M names of the rows."""
        return (*self.layout.unknowns, *self.layout.row_names)

    @cached_property
    def violated(self) -> StateArray:
        """The bounds and hard rows that x violates, (k, n + M): −1 below `lower`, +1 above `upper`."""
        box_lower = np.array([step.hierarchy.box_lower for step in self.steps])
        box_upper = np.array([step.hierarchy.box_upper for step in self.steps])
        value = np.hstack([self.x, self._value])
        lower, upper = np.hstack([box_lower, self.lower]), np.hstack([box_upper, self.upper])
        side = (value > upper + SHOWN_VIOLATION).astype(np.int8) - (value < lower - SHOWN_VIOLATION).astype(
            np.int8
        )
        side[:, self.layout.n + int(self.layout.offsets[1]) :] = 0  # a task need not be met
        return side

    @cached_property
    def active_code(self) -> IntArray:
        """The codes of `state`, (k, n + M)."""
        return self._with_owner(self.state)

    @cached_property
    def violated_code(self) -> IntArray:
        """The codes of `violated`, (k, n + M)."""
        return self._with_owner(self.violated)

    def code_words(self, row: int, code: int) -> str:
        """Describe a code without the name of its row.

        Args:
            row: The index of the row, 0 ≤ row < n + M.
            code: An entry of `active_code` or `violated_code` for that row.

        Returns:
            Words such as "joint_velocity upper", "upper" or "free".
        """
        if code == 0:
            return "free"
        side = "upper" if code > 0 else "lower"
        if row < self.layout.n:
            return f"{self.layout.owners[abs(code) - 1]} {side}"
        choices = self.layout.block_of(row - self.layout.n).choices
        return f"{choices[abs(code) - 1]} {side}" if choices else side

    def active_name(self, row: int, code: int) -> str:
        """Name an active bound as `str(Active)` does.

        Args:
            row: The index of the row, 0 ≤ row < n + M.
            code: A nonzero entry of `active_code` or `violated_code` for that row.

        Returns:
            The limit, the unknown or row, and the side, such as "joint_velocity/joint1 upper".
        """
        side, n = "upper" if code > 0 else "lower", self.layout.n
        if row < n:
            return f"{self.layout.owners[abs(code) - 1]}/{self.row_names[row]} {side}"
        label = abs(code) if self.layout.block_of(row - n).choices else 0
        return f"{self.layout.row_name(row - n, label)} {side}"

    def ticks_every(self, period: float, dt: float) -> IntArray:
        """Find the steps that fall on multiples of a period.

        Args:
            period: The period [s].
            dt: The time step of the run [s].

        Returns:
            Indices in the batch, each from 0 to k − 1. The ticks do not depend on how a run is cut into
            batches.
        """
        return np.flatnonzero(self.index % max(1, round(period / dt)) == 0)

    @cached_property
    def _value(self) -> Array:
        """The product A x of every row, (k, M)."""
        return np.array([step.hierarchy.A @ step.x for step in self.steps])

    def _declared(self, step: Step) -> IntArray | slice:
        """The places of the stack's rows in an answer, whose problem may have more rows, as of damping."""
        answered = step.resolution.source.layout
        if answered is self.layout:
            return slice(None)
        if answered not in self._places:
            positions = {name: i for i, name in enumerate([*answered.unknowns, *answered.row_names])}
            self._places[answered] = np.array([positions[name] for name in self.row_names])
        return self._places[answered]

    @cached_property
    def _places(self) -> dict[Layout, IntArray]:
        """The places that `_declared` found, by layout."""
        return {}

    def _task_block(self, task: str) -> Block:
        """Find the rows of a task by its name; a limit of the same name is at level 0."""
        return next(block for block in self.layout.blocks if block.level and block.name == task)

    def _with_owner(self, side: StateArray) -> IntArray:
        """Multiply the sides by the labels of the rows, and by 1 + the index of the limit of each bound."""
        code = side.astype(np.int64)
        n = self.layout.n
        code[:, :n] *= 1 + np.where(code[:, :n] > 0, self.owner[:, 1], self.owner[:, 0])
        code[:, n:] *= np.maximum(self.label, 1)
        return code
