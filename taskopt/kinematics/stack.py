"""Levels of tasks in strict order, limits around them, a norm: declared once, filled on every tick."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, chain
from typing import Any

import numpy as np

from taskopt.arrays import Array, ArrayLike, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block, Layout, numbered
from taskopt.hierarchy.problem import Hierarchy, LevelRows, checked_norm
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, Limit, RateLimit, RowLimit
from taskopt.kinematics.limit.distance import BoundDistance
from taskopt.kinematics.plan import KINDS, compiled_tick, fill_tick, flawed
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task import BoundTask, Task
from taskopt.kinematics.task.damping import BoundLevelDamping
from taskopt.kinematics.task.rows import rate_units


@dataclass(frozen=True, eq=False)
class Stack:
    """What the robot is to do: tasks of one level share it by weight, levels come strictly one after another.

    `levels`: lists of tasks, highest priority first. `limits` hold whatever the tasks want; none is in
    force that does not stand here. `norm` is W in ½ v'W v (3.50), which decides what stays free after the
    last level: None (the identity), its diagonal (nv,), or a symmetric positive definite (nv, nv) matrix.
    """

    levels: Sequence[Sequence[Task]]
    limits: Sequence[Limit] = ()
    norm: ArrayLike | None = None

    def __post_init__(self) -> None:
        levels = tuple(_tuple(level, "a level", Task) for level in self.levels)
        if not levels or not all(levels):
            raise InvalidValue("a stack needs at least one level, and each level at least one task")
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "limits", _tuple(self.limits, "limits", Limit))

    def compile(self, robot: Robot, dt: float) -> "Plan":
        """The stack for a robot that takes steps of dt [s], with all memory allocated.

        Raises `UnknownName` for a frame or joint that the robot lacks, and `InvalidValue` for dt ≤ 0, for
        sizes that do not fit, and where gain · dt ≥ 2: there an Euler step lands farther from the target.
        """
        return Plan(self, robot, positive("dt", dt))

    def at(self, configuration: Configuration, dt: float, t: float = 0.0) -> Hierarchy:
        """The hierarchy at a configuration, for a look; references begin there, at time 0 [s]."""
        plan = self.compile(configuration.robot, dt)
        plan.start(configuration.q, 0.0)
        return plan.at(configuration.q, t).copy()


class Plan:
    """A stack compiled for a robot; `at` fills the one hierarchy that it has.

    `tasks`: the tasks as bound to the robot, in order of level; their errors and poses are those of the
    last `at`. `configuration`: the robot as of the last `at`. `limits`: as bound, in order; those that
    keep distances by name in `distance_limits`, each with what the last `at` measured.
    """

    def __init__(self, stack: Stack, robot: Robot, dt: float) -> None:
        self.dt, self.robot = dt, robot
        self.configuration = Configuration(robot, robot.neutral)
        names = iter(numbered(task.name or task.default_name() for task in chain(*stack.levels)))
        bound = [[task.bind(robot, next(names)) for task in level] for level in stack.levels]
        self.tasks: tuple[BoundTask, ...] = tuple(chain(*bound))
        self._dampings = [found for k, level in enumerate(bound, 1) for found in _damping(level, k)]
        self.limits = limits = tuple(limit.bind(robot, dt) for limit in stack.limits)
        boxes = [limit for limit in limits if isinstance(limit, BoundLimit)]
        hard = [limit for limit in limits if isinstance(limit, RowLimit)]
        self.rate_limits = [limit for limit in limits if isinstance(limit, RateLimit)]
        _check_gains(self.tasks, dt)
        owners = chain.from_iterable(_owners(limit) for limit in boxes)
        called = numbered(limit.name for limit in hard)
        named = tuple(zip(called, hard, strict=True))
        self.distance_limits = {name: limit for name, limit in named if isinstance(limit, BoundDistance)}
        self.layout = _layout(robot, named, bound, ("box", *numbered(owners)))
        self.hierarchy = _empty(self.layout, checked_norm(stack.norm, robot.nv))
        self._started = False
        self._prepare(hard, boxes)

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Anchor the references that begin at the start posture q (nq,), at the time t [s]; at rest."""
        self.moved(np.zeros(self.robot.nv))
        self._anchor(q, t)

    def _anchor(self, q: ArrayLike, t: float) -> None:
        self.configuration.update(self.robot.checked_q(q))
        for task in self.tasks:
            task.start(self.configuration, t)
        for part in self._aimed:
            part.aim(t)
        self._started = True

    def moved(self, v: Array) -> None:
        """Tell the limits on acceleration that the robot has the velocity v (nv,) until the next tick."""
        for limit in self.rate_limits:
            limit.moved(v)

    def brakes(self) -> Array:
        """(nv,): towards standstill as hard as the limits on acceleration allow, 0 where there is none."""
        slowest = np.zeros(self.robot.nv)
        for limit in self.rate_limits:
            v = limit.brakes()
            slowest = np.where(np.abs(v) > np.abs(slowest), v, slowest)
        return slowest

    def at(self, q: Array, t: float) -> Hierarchy:
        """The hierarchy at q (nq,) and t [s]: the plan's own, overwritten by the next call.

        The first call starts the references, unless `start` did. Raises `InvalidValue` where q or a
        target is not finite, or q has the wrong size.
        """
        self.aim(q, t)
        flaw = fill_tick(*self.tick)
        for narrow, index in self._narrows:
            narrow(self.configuration, self._bounds, index)
        if flaw or (self._narrows and self._is_flawed()):
            self.blame(t)
        for damping, level, own in self._damps:
            damping.damp(self.hierarchy, level, own)
        return self.hierarchy

    def aim(self, q: Array, t: float) -> None:
        """Move the configuration to q and the targets to t, and fill the rows that have no kernel."""
        if not self._started:
            self._anchor(q, t)
        self.configuration.update(q)
        for aim in self._moving:
            aim(t)
        for fill, rows in self._fills:
            fill(self.configuration, t, rows)

    @property
    def in_one_call(self) -> bool:
        """Whether `fill_tick(*plan.tick)` after `aim` is all of `at`: nothing comes after it from Python."""
        return not self._narrows and not self._damps

    def _prepare(self, hard: Sequence[RowLimit], boxes: Sequence[BoundLimit]) -> None:
        """Write what never changes, and sort the rest: one kernel call, and what Python has to ask."""
        h, n = self.hierarchy, self.robot.nv
        self._bounds = h.buffer[-4 * n :].reshape(4, n)
        self._bounds[0], self._bounds[1] = -np.inf, np.inf
        self._fills, self._narrows, self._aimed = [], [], []
        compiled: list[tuple[Any, int]] = []
        for part, block in zip([*hard, *self.tasks], self.layout.blocks, strict=True):
            rows = LevelRows(*(array[block.rows] for array in (h.A, h.lower, h.upper, h.weight)))
            rows.weight[:] = getattr(part, "weight", 1.0)
            part.prepare(rows)
            if getattr(part, "kind", None) in KINDS:
                compiled.append((part, block.start))
                self._aimed.append(part)
            elif not getattr(part, "constant", False):
                self._fills.append((part.fill, rows))
        blocks = {block.name: block.rows for block in self.layout.blocks if block.level}
        self._damps = [(damping, k, blocks[damping.name]) for damping, k in self._dampings]
        starts = accumulate((len(_owners(limit)) for limit in boxes), initial=1)
        for index, limit in zip(starts, boxes, strict=False):
            if limit.constant:
                limit.narrow(self.configuration, self._bounds, index)
            elif getattr(limit, "kind", None) in KINDS:
                compiled.append((limit, index))
            else:
                self._narrows.append((limit.narrow, index))
        self._moving = [part.aim for part in self._aimed if not part.holds]
        self.tick = compiled_tick(compiled, self.configuration, h)

    def _is_flawed(self) -> bool:
        return flawed(self.hierarchy.buffer, self.robot.nv, self.layout.columns)

    def blame(self, t: float) -> None:
        """Raise `InvalidValue` that names what is not finite."""
        self.robot.checked_q(self.configuration.q)
        for task in self.tasks:
            if task.desired is not None:
                checked_pose(f"target of '{task.name}' at t = {t:.6g} s", task.desired)
        h = self.hierarchy
        for block in self.layout.blocks:
            parts = h.A[block.rows], h.lower[block.rows], h.upper[block.rows]
            if not np.isfinite(parts[0]).all() or _hollow(*parts[1:]):
                raise InvalidValue(
                    f"'{block.name}' is not finite at t = {t:.6g} s; look at its target, the rate of its "
                    "target, and its objective"
                )
        raise InvalidValue(
            f"the limits are not finite at t = {t:.6g} s; look at {', '.join(self.layout.owners[1:])}"
        )


def _damping(level: Sequence[BoundTask], k: int) -> list[tuple[BoundLevelDamping, int]]:
    """The damping of level k with k, if it has one, made to fit the other tasks."""
    found = [task for task in level if isinstance(task, BoundLevelDamping)]
    others = sum(len(task.row_names) for task in level if task not in found)
    if len(found) > 1 or (found and not others):
        raise InvalidValue(
            f"'{found[0].name}' damps the other tasks of level {k}: one a level, beside at least one task"
        )
    for damping in found:
        damping.fit(others)
    return [(damping, k) for damping in found]


def _owners(limit: BoundLimit) -> tuple[str, ...]:
    """The names that a bound of this limit may go by: its own, or one for each reason."""
    return getattr(limit, "owners", (limit.name,))


def _hollow(lower: Array, upper: Array) -> bool:
    return not ((lower < np.inf) & (upper > -np.inf)).all()


def _tuple(items: Any, what: str, kind: type) -> tuple[Any, ...]:
    """`items` as a tuple of tasks, or of limits; a task also looks like a limit, so it is told apart."""
    of = kind.__name__.lower() + "s"
    if isinstance(items, kind) or not isinstance(items, Sequence):
        raise InvalidValue(f"{what} must be a list of {of}, got {items!r}")
    for item in items:
        if not isinstance(item, kind) or (kind is Limit and isinstance(item, Task)):
            raise InvalidValue(f"{what} must be a list of {of}, got {item!r} in it")
    return tuple(items)


def _check_gains(tasks: Sequence[BoundTask], dt: float) -> None:
    for task in tasks:
        if task.gain.max() * dt >= 2.0:
            raise InvalidValue(
                f"gain {task.gain.max():g} 1/s of '{task.name}' is too large for dt = {dt:g} s: with "
                "gain · dt ≥ 2 each step lands farther from the target; 1/dt reaches it in one"
            )


def _layout(
    robot: Robot,
    hard: Sequence[tuple[str, RowLimit]],
    levels: Sequence[Sequence[BoundTask]],
    owners: tuple[str, ...],
) -> Layout:
    blocks: list[Block] = []
    column: list[int] = []
    tasks = [(k, part.name, part) for k, level in enumerate(levels, 1) for part in level]
    for k, name, part in [*((0, name, limit) for name, limit in hard), *tasks]:
        start = len(column)
        column += part.column
        blocks.append(Block(name, k, start, len(column), part.row_names, part.row_units))
    units = rate_units(robot.coordinate_units)
    return Layout(robot.velocity_names, tuple(blocks), len(levels), owners, tuple(column), units)


def _empty(layout: Layout, norm: Array) -> Hierarchy:
    return Hierarchy.view(layout, np.zeros(layout.size), norm)
