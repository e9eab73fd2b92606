"""A stack: levels of tasks in strict order, limits around them, and a norm."""

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from itertools import accumulate, chain

import numpy as np

from taskopt.arrays import Array, ArrayLike, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import REST, RestDamping
from taskopt.hierarchy.layout import numbered
from taskopt.hierarchy.problem import Hierarchy, checked_norm
from taskopt.hierarchy.rest_layout import groups_of
from taskopt.hierarchy.view import box_of, rows_of
from taskopt.kinematics.addresses import gates_of, parameters_of, rows_of_block
from taskopt.kinematics.binding import (
    bound_limit,
    bound_task,
    damping_of,
    declared_in,
    layout_of,
    named_obstacles,
    require_robot,
    set_dt,
)
from taskopt.kinematics.changes import Changes
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.gate import Gate
from taskopt.kinematics.limit import BoundLimit, Limit, RateLimit
from taskopt.kinematics.limit.base import close_crossed
from taskopt.kinematics.limit.bound_distance import BoundDistance
from taskopt.kinematics.limit.coupling import BoundCoupling
from taskopt.kinematics.parameter import Setting
from taskopt.kinematics.part import Part, RowPart
from taskopt.kinematics.plan import NO_MOTION, base_box, compiled_tick, flawed, motion_of, watch_of
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.second_order import Filler, Narrower, SecondOrder, accelerated, checked_order
from taskopt.kinematics.task import BoundTask, Task
from taskopt.kinematics.task.inertial_self_motion import self_motion_of


@dataclass(frozen=True, eq=False)
class Stack:
    """A declaration of levels of tasks in strict order, and of the limits that come before all of them.

    At order 2 the unknown is the acceleration q̈, constant over a tick. Each task asks for A q̈ = ẍ_d + K_D ė +
    K_P e − J̇ v, with K_P = K² and K_D = 2 K unless it says otherwise, and limits keep what they keep at order
    1. A last level, "self-motion", brings what the others leave free to rest.

    Args:
        levels: Lists of tasks, highest priority first. Tasks of one level are weighed against each other. A
            level is never made worse for the sake of a later one.
        limits: Hard limits, which come before every task. Only the limits of this list are in force; none is
            added by default.
        norm: W (nv, nv), symmetric and positive definite, or its diagonal (nv,). Among the motions that all
            levels leave free, that with the least ½ vᵀ W v is taken. A larger entry makes that velocity
            smaller. Default: the identity. At order 2 it may also be "inertia", the mass matrix M(q) of the
            robot, which changes with the posture.
        damping: Damping that controllers and scenarios add at ticks at which the robot would not come to
            rest, as where a still target is out of reach; see `RestDamping`. None for none. Default:
            `RestDamping()` at order 1, none at order 2.
        order: 1 for velocities as unknowns, 2 for accelerations.
        self_motion: K_v [1/s] of order 2: what all levels leave free dies out as v̇ = −K_v v in the norm W.
            More brings it to rest sooner; it must stay below 1/Δt.

    Raises:
        InvalidValue: There is no level, a level is empty, an entry is not a task or not a limit, or the order
            is neither 1 nor 2.

    Source:
        Equation (3.50) for the norm; (3.98)–(3.104) for order 2, with q̈₀ = −K_v v.
    """

    levels: Sequence[Sequence[Task]]
    limits: Sequence[Limit] = ()
    norm: ArrayLike | str | None = None
    damping: RestDamping | None = field(default=REST, kw_only=True)
    order: int = field(default=1, kw_only=True)
    self_motion: float = field(default=5.0, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.levels, Sequence) or isinstance(self.levels, str):
            raise InvalidValue(f"levels must be a list of lists of tasks, got {self.levels!r}")
        levels = tuple(declared_in(level, "a level", Task) for level in self.levels)
        if not levels or not all(levels):
            raise InvalidValue("a stack needs at least one level, and each level at least one task")
        if not isinstance(self.damping, RestDamping | None):
            raise InvalidValue(
                f"damping must be RestDamping() or None; use LevelDamping for {self.damping!r}"
            )
        checked_order(self.order, self.self_motion, self.norm)
        if self.order == 2 and self.damping is REST:
            object.__setattr__(self, "damping", None)
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "limits", declared_in(self.limits, "limits", Limit))

    def compile(self, robot: Robot, dt: float) -> "Plan":
        """Bind the stack to a robot, and allocate all memory.

        Args:
            robot: The robot.
            dt: Time [s] from one tick to the next.

        Returns:
            The plan.

        Raises:
            UnknownName: The robot lacks a frame or joint.
            InvalidValue: dt ≤ 0; sizes do not fit; gain · dt ≥ 2 in a task, for which Euler steps diverge
                from the target; a task is named as a whole level is, such as "level 1"; or a user's own task
                or limit is incomplete, in which case the message names what it lacks.
        """
        return Plan(self, robot, positive("dt", dt))

    def at(self, configuration: Configuration, dt: float, t: float = 0.0) -> Hierarchy:
        """Return the hierarchy at one configuration, to inspect it; targets begin there, at time 0 s.

        Args:
            configuration: Robot at q.
            dt: Time [s] from one tick to the next.
            t: Time [s].

        Returns:
            The hierarchy, in memory of its own.
        """
        plan = self.compile(configuration.robot, dt)
        plan.start(configuration.q, 0.0)
        return plan.at(configuration.q, t).copy()


class Plan:
    """A stack compiled for a robot, which fills the same hierarchy at every tick.

    Args:
        stack: The declared stack.
        robot: The robot.
        dt: Time [s] from one tick to the next.

    Attributes:
        stack: The declared stack.
        changes: Parameters by address, and the changes that wait for the next tick.
        altered: True if a change waits or is being blended, or if a task has rows that are not fully on, so
            that Python code must follow the kernels.
        tasks: The bound tasks in order of level; their errors and poses are those of the last `at`.
        limits: The bound limits, in order.
        rate_limits: The limits whose bounds depend on the velocity of the last tick.
        rate_tasks: The tasks that depend on the velocity of the last tick.
        distance_limits: The limits on distances, by name; each has the distances of the last `at`.
        obstacles: Shapes of all limits and tasks, by the names that appear in rows, pictures and logs.
        moving: Poses (4, 4) [m] of the obstacles that move, by name, as of the last `at`.
        configuration: Robot at the posture of the last `at`.
        hierarchy: The hierarchy that `at` fills.
        layout: Names and sizes of the hierarchy.
        groups: Groups of rows whose A changes with the posture, (M,), see `taskopt.hierarchy.rest_layout`.
        speed_owners: Numbers of the owners of bounds that depend on the posture and limit speeds only.
        fill: Compiled function that calls the kernels of all parts, see `taskopt.kinematics.plan`.
        tick: Arguments of `fill`.
    """

    def __init__(self, stack: Stack, robot: Robot, dt: float) -> None:
        require_robot(robot)
        self.dt, self.robot = dt, robot
        self.configuration = Configuration(robot, robot.neutral)
        names = iter(numbered(task.name or task.default_name() for task in chain(*stack.levels)))
        levels = [[bound_task(task, robot, next(names)) for task in level] for level in stack.levels]
        norm = checked_norm(stack.norm if stack.order == 1 else None, robot.nv)
        if stack.order == 2:  # the last level has the norm, and leaves nothing free for another one
            levels.append([self_motion_of(stack.norm, robot, stack.self_motion)])
        self.tasks: tuple[BoundTask, ...] = tuple(chain(*levels))
        dampings = [found for k, level in enumerate(levels, 1) for found in damping_of(level, k)]
        limits, self.obstacles = named_obstacles(stack.limits, stack.levels)
        self.limits = tuple(bound_limit(limit, robot, dt) for limit in limits)
        boxes = [limit.box_part() for limit in self.limits if isinstance(limit, BoundLimit)]
        hard = [limit for limit in self.limits if isinstance(limit, RowPart)]
        hard += [BoundCoupling(robot, robot.couplings)] if robot.couplings else []
        self.rate_limits = [limit for limit in self.limits if isinstance(limit, RateLimit)]
        self.rate_tasks = [task for task in self.tasks if task.follows_velocity]
        self.motion: SecondOrder | None = None
        if stack.order == 2:
            self.motion = accelerated(self.tasks, self.limits, self.configuration, dt)
        self._place = self.configuration.update if self.motion is None else self.motion.update
        set_dt(self.tasks, dt)
        owners = chain.from_iterable(limit.owners for limit in boxes)
        named = tuple(zip(numbered(limit.name for limit in hard), hard, strict=True))
        self.distance_limits = {name: limit for name, limit in named if isinstance(limit, BoundDistance)}
        self.moving = {m.name: m.pose for limit in self.distance_limits.values() for m in limit.movers}
        self.layout = layout_of(robot, named, levels, ("box", *numbered(owners)), stack.order)
        self.stack, self._begun = stack, None
        self.groups = groups_of(self.layout, {task.name for task in self.tasks if task.curved})
        self.velocity = np.zeros(robot.nv)
        self._prepare(hard, boxes, norm)
        blocks = {block.name: block for block in self.layout.blocks if block.level}
        self._damps = [(damping, k, blocks[damping.name].rows) for damping, k in dampings]
        self._gates = gates_of(self.tasks, self.hierarchy, blocks, once=self.motion is None)
        self._open_gates: tuple[Gate, ...] = ()
        self.altered = False
        self.changes = Changes(parameters_of(levels, self._gates, self.limits, self._write_base_box))

    def start(self, q: ArrayLike, t: float = 0.0) -> None:
        """Start all targets from a start posture, with the robot at rest.

        Args:
            q: Start posture, (nq,) [rad, m].
            t: Time [s].

        Raises:
            InvalidValue: q has the wrong size or is not finite, or a target or a gradient does not fit its
                task.
        """
        self.moved(np.zeros(self.robot.nv))
        self._anchor(q, t)

    def _anchor(self, q: ArrayLike, t: float) -> None:
        """Start all targets from q."""
        self.robot.require_unchanged()
        self.configuration.update(self.robot.checked_q(q))
        for part in (*self.tasks, *self.limits):
            if isinstance(part, RowPart):
                part.start(self.configuration, t)
        for part in self._aimed:
            part.aim(t)
        self._begun = self.configuration.q.copy(), t

    def __reduce__(self) -> tuple[Callable[..., "Plan"], tuple[object, ...]]:
        blending = any(gate.blending for gate in self._open_gates)
        begun, changes = self._begun, self.changes.recall(blending=blending)
        kept = [part.recall() for part in (*self.tasks, *self.limits)]
        now = self.configuration.q.copy(), self.velocity.copy()
        return _copied, (self.stack, self.robot, self.dt, begun, changes, kept, now)

    def __copy__(self) -> "Plan":
        return deepcopy(self)

    def moved(self, v: Array) -> None:
        """Tell `rate_limits` and `rate_tasks` the velocity that the robot has until the next tick.

        Args:
            v: Velocity, (nv,) [rad/s, m/s].
        """
        for part in (*self.rate_limits, *self.rate_tasks):
            part.moved(v)
        if self.motion is None:
            self.velocity = v
        else:
            self.velocity[:] = v

    def answered(self, x: Array) -> None:
        """Take the answer of a tick: the velocity that the robot has until the next one, or its acceleration.

        Args:
            x: Velocity (nv,) [rad/s, m/s], at order 2 acceleration [rad/s², m/s²].
        """
        self.moved(x if self.motion is None else self.motion.answered(x))

    def next_posture(self, q: Array) -> Array:
        """Return the posture to which the answer of a tick leads; `answered` must have been called.

        Args:
            q: Posture of the tick, (nq,) [rad, m].

        Returns:
            Posture at the next tick, (nq,): q ⊕ v Δt, at order 2 q ⊕ (v Δt + ½ q̈ Δt²).
        """
        mean = self.velocity if self.motion is None else self.velocity - 0.5 * self.dt * self.motion.last
        return self.robot.integrate(q, mean, self.dt)

    def brakes(self) -> Array:
        """Return the answer that brakes as hard as the limits on acceleration allow.

        Returns:
            Velocity (nv,) [rad/s, m/s], 0 for every one that may stop within one tick; at order 2 the
            acceleration that leads to it [rad/s², m/s²].
        """
        slowest = np.zeros(self.robot.nv)
        for limit in self.rate_limits:
            v = limit.brakes()
            slowest = np.where(np.abs(v) > np.abs(slowest), v, slowest)
        return slowest if self.motion is None else (slowest - self.velocity) / self.dt

    def at(self, q: Array, t: float) -> Hierarchy:
        """Fill the hierarchy.

        The first call starts the targets, unless `start` was called before.

        Args:
            q: Configuration, (nq,).
            t: Time [s].

        Returns:
            The plan's own hierarchy, which the next call overwrites.

        Raises:
            InvalidValue: q or a target is not finite, or q has the wrong size.
        """
        self.aim(q, t)
        return self.filled(t)

    def filled(self, t: float) -> Hierarchy:
        """Fill the hierarchy; `aim` must have been called for this tick before.

        Args:
            t: Time [s].

        Returns:
            The plan's own hierarchy.

        Raises:
            InvalidValue: q or a target is not finite.
        """
        flaw = self.fill(*self.tick)
        for narrow, owner in self._narrows:
            narrow(self.configuration, self._bounds, owner)
        if flaw or (self._narrows and self._is_flawed()):
            self.blame(t)
        if self._open_gates:
            self._apply_gates(t)
        for damping, level, own in self._damps:
            damping.damp(self.hierarchy, level, own)
        return self.hierarchy

    def aim(self, q: Array, t: float, *, place: bool = True) -> None:
        """Move the configuration to q and the targets to t, and fill the rows that have no kernel.

        Args:
            q: Configuration, (nq,).
            t: Time [s].
            place: Whether the joints are placed here; False leaves it to `place_joints`.
        """
        if self._begun is None:
            self._anchor(q, t)
        if self.altered:
            self.take_changes(t)
        (self._place if place else self.configuration.take)(q)
        for aim in self._moving:
            aim(t)
        for fill, rows in self._fills:
            fill(self.configuration, t, rows)

    def set(self, changes: Mapping[str, Setting], over: float = 0.0) -> None:
        """Change parameters from the next tick on, see `Controller.set`.

        Args:
            changes: New values by address, such as {"hand.weight": 0.1}.
            over: Time over which the change is blended [s].

        Raises:
            UnknownName: There is no parameter of that address.
            InvalidValue: A parameter does not take its value.
        """
        self.changes.set(changes, over)
        self.altered = True

    def retime(self, dt: float) -> None:
        """Change the time from one tick to the next.

        Args:
            dt: Δt [s].

        Raises:
            InvalidValue: dt ≤ 0, a gain is too large for it, or a user's own limit cannot change its Δt.
        """
        dt = positive("dt", dt)
        set_dt(self.tasks, dt)
        for limit in self.limits:
            if not limit.constant and type(limit).retime is Part.retime:
                raise InvalidValue(
                    f"the limit '{limit.name}' cannot take another Δt: {type(limit).__name__} lacks retime()"
                )
        for part in (*self.limits, *self.tasks):
            part.retime(dt)
        if self.motion is not None:
            self.motion.retime(dt)
        self.dt = dt
        self._write_base_box()

    @property
    def in_one_call(self) -> bool:
        """True if `aim` followed by `fill(*tick)` does the same as `at`, unless the plan is `altered`."""
        return not self._narrows and not self._damps

    def take_changes(self, t: float) -> None:
        """Apply the waiting changes of parameters, and advance those that are blended.

        Args:
            t: Time of the tick [s].
        """
        self.altered = False  # first, so that what another thread sets from here on is not lost
        self.changes.apply(t)
        for part in self._still:
            if not part.fixed_target:
                self._sort_targets()
                break
        for gate in self._gates.values():
            if gate.changed:
                gate.changed = False
                if gate not in self._open_gates and not gate.is_idle(t):
                    self._open_gates = (*self._open_gates, gate)
        if self.changes.waiting or self._open_gates:
            self.altered = True

    def _apply_gates(self, t: float) -> None:
        """Open the bounds of rows that are not fully on; forget gates with nothing to do."""
        for gate in self._open_gates:
            gate.apply(t, self.velocity if self.motion is None else self.motion.last)
        self._open_gates = tuple(gate for gate in self._open_gates if not gate.is_idle(t))

    def _write_base_box(self) -> None:
        """Write the box with which ticks begin, the bounds that do not depend on the posture, and Δt."""
        watch_of(self.tick)[:2] = 0.0 if self.stack.damping is None else self.dt
        bounds = base_box(self.tick)
        bounds[:] = 0.0
        bounds[0], bounds[1] = -np.inf, np.inf
        for narrow, owner in self._constant_bounds:
            narrow(self.configuration, bounds, owner)

    def _prepare(self, hard: Sequence[RowPart], boxes: Sequence[BoundLimit], norm: Array) -> None:
        """Write what never changes, and separate the parts with a kernel from those filled in Python."""
        layout, n = self.layout, self.robot.nv
        hierarchy = Hierarchy.view(layout, np.zeros(layout.size), norm)
        parts = tuple(zip([*hard, *self.tasks], layout.blocks, strict=True))
        for part, block in parts:
            rows = rows_of_block(hierarchy, block)
            rows.weight[:] = part.weight if isinstance(part, BoundTask) else 1.0
            part.prepare(rows)
        starts = accumulate((len(limit.owners) for limit in boxes), initial=1)
        owned = tuple(zip(boxes, starts, strict=False))
        self._constant_bounds = [(limit.narrow, owner) for limit, owner in owned if limit.constant]
        self.speed_owners = tuple(owner for limit, owner in owned if limit.of_speed and not limit.constant)
        varying: list[tuple[Part, int]] = [(part, block.start) for part, block in parts if not part.constant]
        varying += [(limit, owner) for limit, owner in owned if not limit.constant]
        compiled = compiled_tick(
            [(part, place) for part, place in varying if part.kernel is not None],
            self.configuration,
            hierarchy,
            self.groups,
            NO_MOTION if self.motion is None else self.motion.memory,
        )
        self.fill, self.tick, self.hierarchy = compiled
        if self.motion is not None:
            self.velocity = self.motion.use(motion_of(self.tick))
        self._write_base_box()
        self._bounds = box_of(self.hierarchy.buffer, n)
        once = self.motion is None  # at order 2 the rows of constant parts change with the velocity
        fill_of = _fill_of if self.motion is None else self.motion.lifted
        in_python = [(p, block) for p, block in parts if p.kernel is None and not (once and p.constant)]
        self._fills = [(fill_of(part), rows_of_block(self.hierarchy, block)) for part, block in in_python]
        narrow_of = _narrow_of if self.motion is None else self.motion.narrowed
        self._narrows = [
            (narrow_of(limit.narrow), owner)
            for limit, owner in owned
            if limit.kernel is None and not limit.constant
        ]
        self._aimed = [part for part, _ in parts if part.kernel is not None and not part.constant]
        self._sort_targets()

    def _sort_targets(self) -> None:
        """Sort the parts whose targets a kernel reads into those that stand still and those that move."""
        self._still = [part for part in self._aimed if part.fixed_target]
        self._moving = [part.aim for part in self._aimed if not part.fixed_target]

    def _is_flawed(self) -> bool:
        """Return True if the hierarchy holds numbers with which it cannot be solved, such as NaN."""
        h, layout = self.hierarchy, self.layout
        return flawed(rows_of(h.buffer, layout.n, h.norm, layout.offsets, layout.columns))

    def blame(self, t: float) -> None:
        """Raise an error that names the number that is not finite.

        Args:
            t: Time [s].

        Raises:
            InvalidValue: Always.
        """
        self.robot.checked_q(self.configuration.q)
        for task in self.tasks:
            if task.desired is not None:
                checked_pose(f"target of '{task.name}' at t = {t:.6g} s", task.desired)
        for block in self.layout.blocks:
            rows = rows_of_block(self.hierarchy, block)
            empty = not ((rows.lower < np.inf) & (rows.upper > -np.inf)).all()
            if not np.isfinite(rows.A).all() or empty:
                raise InvalidValue(
                    f"'{block.name}' is not finite at t = {t:.6g} s; look at its target, the rate of its "
                    "target, and its objective"
                )
        raise InvalidValue(
            f"the limits are not finite at t = {t:.6g} s; look at {', '.join(self.layout.owners[1:])}"
        )


def _narrow_of(narrow: Narrower) -> Narrower:
    """Return the function with which a limit narrows bounds in Python."""

    def narrow_and_close(configuration: Configuration, bounds: Array, owner: int) -> None:
        narrow(configuration, bounds, owner)
        close_crossed(bounds)

    return narrow_and_close


def _fill_of(part: RowPart) -> Filler:
    """Return the function with which a part fills its rows in Python."""
    return part.fill


def _copied(
    stack: Stack,
    robot: Robot,
    dt: float,
    begun: tuple[Array, float] | None,
    changes: Mapping[str, Setting],
    kept: Sequence[object],
    now: tuple[Array, Array],
) -> Plan:
    """Make a plan that continues from the state of another plan.

    Args:
        stack: The declared stack.
        robot: The robot.
        dt: Time [s] from one tick to the next.
        begun: Posture (nq,) [rad, m] and time [s] at which the targets were started, or None before the
            start.
        changes: Values of the parameters, by address.
        kept: State of tasks and limits, see `Part.recall`.
        now: Posture (nq,) [rad, m] and velocity (nv,) [rad/s, m/s] as of the last tick.
    """
    plan = Plan(stack, robot, dt)
    q, v = now
    if begun is not None:
        plan.start(*begun)
        plan.changes.set(changes)
        plan.take_changes(begun[1])
        for part, memory in zip((*plan.tasks, *plan.limits), kept, strict=True):
            part.remember(memory)
        plan.configuration.update(q)
        plan.moved(v)
    return plan
