"""The contract of a limit, tried at random configurations and velocities."""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit import BoundLimit, Limit, RateLimit
from taskopt.kinematics.part import RowPart
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.kinematics.task import DampingTask
from taskopt.testing.sampling import configurations, require

Outside = Callable[[Configuration], float]
_FAST = 10.0  # [rad/s, m/s] how fast a joint is driven that the limit leaves free
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
    """Check that a limit keeps what `taskopt.kinematics.limit.base` promises.

    - Its names, units and sizes agree, and its bounds are no NaN.
    - It only narrows bounds, and writes its owner where it does, and nowhere else.
    - Braking as hard as allowed is inside its bounds and rows; without a limit on acceleration that is v = 0.
    - The plan, which calls kernels in one compiled call, gives the same bounds as the methods.
    - From configurations inside, the largest velocity that it allows in a random direction is taken for some
      steps. After each step braking is still allowed, and `outside` is not positive.

    Args:
        limit: The limit.
        robot: A robot that it fits.
        dt: Time of a step [s].
        outside: By how much a configuration is outside what the limit keeps, ≤ 0 inside. Default: it is not
            tried.
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
        for _ in range(8):
            _check_narrow(bound, plan, q, limit.name, rng)
            v = _extreme(plan, q, rng)
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
            require(unit == "" or unit.endswith("/s"), f"unit '{unit}' of '{name}' is no unit of a rate")
    if isinstance(bound, BoundLimit):
        unique = len(set(bound.owners)) == len(bound.owners) > 0
        require(unique, f"owners of '{name}' are not unique: {bound.owners}")


def _check_narrow(
    bound: BoundLimit | RowPart, plan: Plan, q: Array, name: str, rng: np.random.Generator
) -> None:
    """Check bounds and rows at one configuration: narrower, owned, with braking inside, as in the plan."""
    hierarchy, brakes = plan.at(q, 0.0), plan.brakes()
    value = hierarchy.limits.A @ brakes
    over = float(np.maximum(hierarchy.limits.lower - value, value - hierarchy.limits.upper).max(initial=0.0))
    require(over <= _INSIDE, f"braking misses a row of '{name}' by {over:.3g}", q)
    sides = hierarchy.box_lower - brakes, brakes - hierarchy.box_upper
    over = float(np.max(sides))
    require(over <= _INSIDE, f"braking misses a bound of '{name}' by {over:.3g}", q)
    if not isinstance(bound, BoundLimit):
        return
    n, configuration = plan.robot.nv, Configuration(plan.robot, q)
    if isinstance(bound, RowPart):
        rows = plan.hierarchy.limits
        bound.fill(
            configuration,
            0.0,
            type(rows)(*(part.copy() for part in (rows.A, rows.lower, rows.upper, rows.weight))),
        )
    alone = np.array([np.full(n, -np.inf), np.full(n, np.inf), np.zeros(n), np.zeros(n)])
    bound.narrow(configuration, alone, 1)
    require(not np.isnan(alone).any(), f"a bound of '{name}' is NaN", q)
    box = np.array([hierarchy.box_lower, hierarchy.box_upper, *hierarchy.owner])
    unequal = alone != box
    apart = float(np.abs(alone[unequal] - box[unequal]).max(initial=0.0))
    require(apart <= _INSIDE, f"compiled and Python bounds of '{name}' differ by {apart:.3g}", q)
    tight = rng.uniform(0.0, 1.0, n)
    narrowed = np.array([-tight, tight, np.full(n, -1.0), np.full(n, -1.0)])
    bound.narrow(configuration, narrowed, 1)
    wider = max(float((-tight - narrowed[0]).max()), float((narrowed[1] - tight).max()))
    require(wider <= 0.0, f"'{name}' widens a bound that was tighter by {wider:.3g}", q)
    for side, before in ((0, -tight), (1, tight)):
        changed, owner = narrowed[side] != before, narrowed[side + 2]
        known = (owner >= 1.0) & (owner < 1.0 + len(bound.owners))
        wrong = np.flatnonzero(np.where(changed, ~known, owner != -1.0))
        at = plan.robot.velocity_names[int(wrong[0])] if wrong.size else ""
        require(not wrong.size, f"'{name}' does not write its owner where it narrows: see {at}", q)


def _extreme(plan: Plan, q: Array, rng: np.random.Generator) -> Array:
    """Return the largest velocity that bounds and rows allow from braking on, in a random direction."""
    hierarchy, brakes = plan.at(q, 0.0), plan.brakes()
    n = hierarchy.n
    signs = rng.choice([-1.0, 1.0], n)
    corner = np.where(signs > 0.0, hierarchy.box_upper, hierarchy.box_lower)
    corner = np.clip(corner, -_FAST, _FAST)
    limits = hierarchy.limits
    share, along = 1.0, limits.A @ (corner - brakes)
    value = limits.A @ brakes
    for i in np.flatnonzero(along != 0.0):
        room = (limits.upper[i] if along[i] > 0.0 else limits.lower[i]) - value[i]
        share = min(share, max(room / along[i], 0.0))
    return brakes + share * (corner - brakes)
