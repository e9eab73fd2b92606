"""The check of a limit, at random configurations and velocities."""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, Limit, RateLimit
from taskopt.kinematics.part import RowPart
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.kinematics.task import DampingTask
from taskopt.testing.sampling import configurations, is_rate, require, require_unmoved

Outside = Callable[[Configuration], float]
_LONGEST = 0.2  # [rad, m] how far a joint goes in a step if the limit leaves it free
_STEPS = 8
_INSIDE = 1e-9  # [rad, m] and [rad/s, m/s]: rounding


def check_limit(
    limit: Limit,
    robot: Robot,
    *,
    dt: float = 1e-2,
    outside: Outside | None = None,
    count: int = 8,
    seed: int = 0,
) -> None:
    """Check that a limit fulfils the contract of `taskopt.kinematics.limit.base`.

    - Its names, units and sizes agree, and its bounds are no NaN. It leaves the configuration as it was.
    - It only narrows bounds, and writes its owner for the bounds that it narrows and no others.
    - Braking as hard as allowed is inside its bounds and rows; without a limit on acceleration that is v = 0.
    - The plan, which calls kernels in one compiled call, gives the same rows and bounds as the methods.
    - Starting inside the limit, some steps are taken with the largest velocity that it allows towards a
      random corner of the box. After each step braking is still allowed, and `outside` is not positive.

    Args:
        limit: The limit.
        robot: A robot that it fits.
        dt: Time of a step [s].
        outside: Function that returns how far a configuration is outside the limit, a number ≤ 0 for one
            inside. Default: this is not checked.
        count: Number of starts.
        seed: Seed of the random configurations and directions.

    Raises:
        AssertionError: Something does not hold; the message says what, where, and by how much.
        InvalidValue: The limit is incomplete; the message names what it lacks.
    """
    rng = np.random.default_rng(seed)
    plan = Stack([[DampingTask()]], [limit]).compile(robot, dt)
    bound = limit.bind(robot, dt)
    _check_form(bound, limit.name)
    for q in configurations(robot, count, rng):
        if outside is not None and outside(Configuration(robot, q)) > 0.0:
            continue
        plan.start(q, 0.0)
        if isinstance(bound, RateLimit):
            bound.moved(np.zeros(robot.nv))
        direction = rng.choice([-1.0, 1.0], robot.nv)
        for _ in range(_STEPS):
            _check_tick(bound, plan, q, limit.name, rng)
            v = _extreme(plan, q, direction)
            q = robot.integrate(q, v, dt)
            plan.moved(v)
            if isinstance(bound, RateLimit):
                bound.moved(v)
            if outside is not None:
                far = outside(Configuration(robot, q))
                require(far <= _INSIDE, f"a step that '{limit.name}' allows goes {far:.3g} outside", q)


def _check_form(bound: BoundLimit | RowPart, name: str) -> None:
    """Check names, units and owners."""
    if isinstance(bound, RowPart):
        m = len(bound.row_names)
        require(m > 0 and all(bound.row_names), f"a row of '{name}' has no name: {bound.row_names}")
        require(len(set(bound.row_names)) == m, f"row_names of '{name}' are not unique: {bound.row_names}")
        for unit in bound.row_units:
            require(
                is_rate(unit), f"unit '{unit}' of '{name}' is no unit of a rate; such are rad/s, m/s, 1/s"
            )
    if isinstance(bound, BoundLimit):
        unique = len(set(bound.owners)) == len(bound.owners) > 0
        require(unique, f"owners of '{name}' are not unique: {bound.owners}")


def _check_tick(
    bound: BoundLimit | RowPart, plan: Plan, q: Array, name: str, rng: np.random.Generator
) -> None:
    """Check bounds and rows at one configuration."""
    hierarchy, brakes = plan.at(q, 0.0), plan.brakes()
    own = plan.layout.blocks[0].rows if isinstance(bound, RowPart) else slice(0)
    whole = hierarchy.limits  # its own rows come first, before those of couplings of the robot
    rows = LevelRows(whole.A[own], whole.lower[own], whole.upper[own], whole.weight[own])
    value = rows.A @ brakes
    over = float(np.maximum(rows.lower - value, value - rows.upper).max(initial=0.0))
    require(over <= _INSIDE, f"braking misses a row of '{name}' by {over:.3g}", q)
    over = float(np.maximum(hierarchy.box_lower - brakes, brakes - hierarchy.box_upper).max())
    require(over <= _INSIDE, f"braking misses a bound of '{name}' by {over:.3g}", q)
    configuration = Configuration(plan.robot, q)
    q = configuration.q.copy()  # a quaternion in it is normalised
    if isinstance(bound, RowPart):
        m = len(rows.lower)
        alone = LevelRows(np.zeros_like(rows.A), np.zeros(m), np.zeros(m), np.ones(m))
        bound.prepare(alone)
        bound.fill(configuration, 0.0, alone)
        require_unmoved(configuration, q, f"fill of '{name}'")
        pairs = (alone.A, rows.A), (alone.lower, rows.lower), (alone.upper, rows.upper)
        apart = max(_apart(*pair) for pair in pairs)
        require(apart <= _INSIDE, f"compiled and Python rows of '{name}' differ by {apart:.3g}", q)
    if isinstance(bound, BoundLimit):
        _check_bounds(bound, plan, configuration, name)
        _check_owners(bound, configuration, name, rng.uniform(0.0, 1.0, plan.robot.nv))
        require_unmoved(configuration, q, f"narrow of '{name}'")


def _apart(a: Array, b: Array) -> float:
    """Return the largest difference, which is infinite if only one of two numbers is finite."""
    unequal = a != b
    return float(np.abs(a[unequal] - b[unequal]).max(initial=0.0))


def _check_bounds(bound: BoundLimit, plan: Plan, configuration: Configuration, name: str) -> None:
    """Check that the limit alone gives the bounds and owners that the plan has."""
    hierarchy, n = plan.hierarchy, plan.robot.nv
    alone = np.array([np.full(n, -np.inf), np.full(n, np.inf), np.zeros(n), np.zeros(n)])
    bound.narrow(configuration, alone, 1)
    require(not np.isnan(alone).any(), f"a bound of '{name}' is NaN", configuration.q)
    apart = _apart(alone, np.array([hierarchy.box_lower, hierarchy.box_upper, *hierarchy.owner]))
    what = f"compiled and Python bounds of '{name}' differ by {apart:.3g}"
    require(apart <= _INSIDE, what, configuration.q)


def _check_owners(bound: BoundLimit, configuration: Configuration, name: str, tight: Array) -> None:
    """Check that the limit only narrows |v| ≤ tight, and writes its owner only where it does."""
    none = np.full(tight.size, -1.0)
    narrowed = np.array([-tight, tight, none, none])
    bound.narrow(configuration, narrowed, 1)
    wider = max(float((-tight - narrowed[0]).max()), float((narrowed[1] - tight).max()))
    what = f"'{name}' widens a bound that was tighter by {wider:.3g}"
    require(wider <= 0.0, what, configuration.q)
    for side, before in ((0, -tight), (1, tight)):
        changed, owner = narrowed[side] != before, narrowed[side + 2]
        known = (owner >= 1.0) & (owner < 1.0 + len(bound.owners))
        wrong = np.flatnonzero(np.where(changed, ~known, owner != -1.0))
        where = configuration.robot.velocity_names[int(wrong[0])] if wrong.size else ""
        what = f"'{name}' does not write its owner where it narrows, and only there: see {where}"
        require(not wrong.size, what, configuration.q)


def _extreme(plan: Plan, q: Array, signs: Array) -> Array:
    """Return the farthest allowed velocity on the line from that of braking to a corner of the box."""
    hierarchy, brakes = plan.at(q, 0.0), plan.brakes()
    corner = np.where(signs > 0.0, hierarchy.box_upper, hierarchy.box_lower)
    corner = np.clip(corner, -_LONGEST / plan.dt, _LONGEST / plan.dt)
    limits = hierarchy.limits
    share, along = 1.0, limits.A @ (corner - brakes)
    value = limits.A @ brakes
    for i in np.flatnonzero(along != 0.0):
        room = (limits.upper[i] if along[i] > 0.0 else limits.lower[i]) - value[i]
        share = min(share, max(room / along[i], 0.0))
    return brakes + share * (corner - brakes)
