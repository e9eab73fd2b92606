"""The check of a task, at random configurations."""

from dataclasses import fields, is_dataclass, replace

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.kinematics.task import BoundTask, Task
from taskopt.testing.sampling import configurations, is_rate, require, require_unmoved

STEP = 1e-5  # of a central difference; its error is about STEP² + 1e-16/STEP
DT = 1e-4  # [s] of the plans
TIME = 0.3  # [s] at which tasks are tried


def check_task(task: Task, robot: Robot, *, count: int = 16, seed: int = 0, tolerance: float = 1e-6) -> None:
    """Check that a task fulfils the contract of `taskopt.kinematics.task.base`.

    - Its names, units and sizes agree, and its numbers are finite. It leaves the configuration as it was.
    - Its rows are the derivative of its error: ė = (b − K e) − A v along random velocities v, with ė from
      central differences on the manifold while the target moves. A row of an inequality is checked where it
      is not met. Rows with gain 0 are not checked, since they ask for a velocity and have no error that dies
      out.
    - A row that is declared as a unit vector is one, and rows that are declared as constant do not change.
    - `fill` gives the same rows again at the same configuration, and rows and error change only with the next
      `fill`.
    - The plan, which calls kernels in one compiled call, fills the same rows as the method `fill`.
    - If the gain of the declaration is doubled and its weight tripled, so are those of the rows.

    Args:
        task: The task.
        robot: A robot that it fits.
        count: Number of configurations; every fourth is near a singularity of most arms.
        seed: Seed of the random configurations.
        tolerance: Largest difference between rows and central differences, relative to max(1, |A|).

    Raises:
        AssertionError: Something does not hold; the message says what, where, and by how much.
        InvalidValue: The task is incomplete; the message names what it lacks.
    """
    rng = np.random.default_rng(seed)
    plan = Stack([[task]]).compile(robot, DT)
    bound = task.bind(robot, plan.tasks[0].name)
    _check_form(bound, plan)
    places = list(configurations(robot, count, rng))
    start = Configuration(robot, places[0])
    plan.start(places[0], 0.0)
    bound.start(start, 0.0)
    rows = _fresh_rows(bound, robot.nv)
    tried = np.zeros(len(bound.row_names), dtype=bool)
    _check_constant(bound, rows, robot, places)
    for q in places[1:]:
        _check_fill(bound, rows, q, robot)
        _check_plan(bound, rows, plan, q)
        tried |= _check_derivative(bound, rows, (q, rng.normal(size=robot.nv)), robot, tolerance)
    _check_factors(task, bound, robot)
    for i in np.flatnonzero(~tried & (bound.gain > 0.0)):
        require(
            bound.constant,
            f"row '{bound.row_names[i]}' of '{bound.name}' was met at all {count} configurations, so that "
            "its derivative could not be tried; choose bounds that are missed, or a larger count",
        )


def _check_form(bound: BoundTask, plan: Plan) -> None:
    """Check names, units and sizes."""
    m = len(bound.row_names)
    require(m > 0, f"'{bound.name}' has no row")
    require(len(set(bound.row_names)) == m, f"row_names of '{bound.name}' are not unique: {bound.row_names}")
    require(all(bound.row_names), f"a row of '{bound.name}' has no name: {bound.row_names}")
    for unit in bound.row_units:
        require(
            is_rate(unit), f"unit '{unit}' of '{bound.name}' is no unit of a rate; such are rad/s, m/s, 1/s"
        )
    for name in ("gain", "weight", "error"):
        shape = np.shape(vars(bound)[name])
        require(shape == (m,), f"{name} of '{bound.name}' has the shape {shape} for {m} rows")
    require(bool((bound.weight >= 0.0).all()), f"a weight of '{bound.name}' is negative: {bound.weight}")
    for j in bound.column:
        require(-1 <= j < plan.robot.nv, f"column {j} of '{bound.name}' is no velocity of {plan.robot.name}")


def _fresh_rows(bound: BoundTask, nv: int) -> LevelRows:
    """Return prepared rows, as a plan passes them to `fill`."""
    m = len(bound.row_names)
    rows = LevelRows(np.zeros((m, nv)), np.zeros(m), np.zeros(m), np.ones(m))
    bound.prepare(rows)
    return rows


def _copy(rows: LevelRows) -> tuple[Array, Array, Array]:
    """Return copies of A, lower and upper."""
    return rows.A.copy(), rows.lower.copy(), rows.upper.copy()


def _difference(first: tuple[Array, Array, Array], second: tuple[Array, Array, Array]) -> float:
    """Return the largest difference of rows, which is infinite if only one of two numbers is finite."""
    worst = 0.0
    for a, b in zip(first, second, strict=True):
        unequal = a != b
        worst = max(worst, float(np.abs(a[unequal] - b[unequal]).max(initial=0.0)))
    return worst


def _check_fill(bound: BoundTask, rows: LevelRows, q: Array, robot: Robot) -> None:
    """Check that `fill` depends on q and t only, and that its results stay until the next call."""
    near = Configuration(robot, q)
    q = near.q.copy()  # a quaternion in it is normalised
    bound.fill(near, TIME, rows)
    require_unmoved(near, q, f"fill of '{bound.name}'")
    first, error = _copy(rows), bound.error.copy()
    finite = np.isfinite(first[0]).all() and not np.isnan(first[1]).any() and not np.isnan(first[2]).any()
    require(bool(finite), f"rows of '{bound.name}' are not finite", q)
    require(bool((first[1] <= first[2]).all()), f"a lower bound of '{bound.name}' exceeds its upper bound", q)
    near.update(robot.neutral)
    apart = max(_difference(first, _copy(rows)), float(np.abs(bound.error - error).max()))
    require(apart == 0.0, f"rows or error of '{bound.name}' moved by {apart:.3g} with the configuration", q)
    bound.fill(near, TIME, rows)
    near.update(q)
    bound.fill(near, TIME, rows)
    apart = _difference(first, _copy(rows))
    require(apart == 0.0, f"fill of '{bound.name}' gives rows that differ by {apart:.3g} a second time", q)
    for i, j in enumerate(bound.column):
        unit = np.eye(robot.nv)[j] if j >= 0 else rows.A[i]
        apart = float(np.abs(rows.A[i] - unit).max())
        what = f"row '{bound.row_names[i]}' of '{bound.name}' differs from unit vector {j} by {apart:.3g}"
        require(apart == 0.0, what, q)


def _check_plan(bound: BoundTask, rows: LevelRows, plan: Plan, q: Array) -> None:
    """Check that the plan fills the same rows as `fill`."""
    hierarchy = plan.at(q, TIME)
    block = next(block.rows for block in plan.layout.blocks if block.level)
    theirs = hierarchy.A[block], hierarchy.lower[block], hierarchy.upper[block]
    scale = max(
        1.0, float(np.abs(rows.A).max()), float(np.abs(rows.lower[np.isfinite(rows.lower)]).max(initial=0))
    )
    apart = _difference(_copy(rows), theirs)
    require(apart <= 1e-12 * scale, f"compiled and Python rows of '{bound.name}' differ by {apart:.3g}", q)
    apart = float(np.abs(bound.error - plan.tasks[0].error).max())
    require(apart <= 1e-12 * scale, f"compiled and Python errors of '{bound.name}' differ by {apart:.3g}", q)
    apart = float(np.abs(hierarchy.weight[block] - bound.weight).max())
    require(apart == 0.0, f"weights of '{bound.name}' differ by {apart:.3g} from those in the hierarchy", q)


def _check_derivative(
    bound: BoundTask, rows: LevelRows, motion: tuple[Array, Array], robot: Robot, tolerance: float
) -> Array:
    """Check rows against central differences of the error; return True for each checked row, (m,)."""
    q, v = motion
    errors = []
    for s in (-STEP, STEP, 0.0):
        bound.fill(Configuration(robot, robot.integrate(q, v, s)), TIME + s, rows)
        errors.append(bound.error.copy())
    behind, ahead, error = errors
    equal = rows.lower == rows.upper
    missed = (error != 0.0) & (ahead != 0.0) & (behind != 0.0)
    tried = (bound.gain > 0.0) & (equal | missed)
    b = np.where(equal | (error > 0.0), rows.lower, rows.upper)
    numeric = (ahead - behind) / (2.0 * STEP)
    b, asked = np.where(tried, b, 0.0), bound.gain * error
    analytic = np.where(tried, b - asked - rows.A @ v, 0.0)
    scale = np.maximum(1.0, np.abs(rows.A) @ np.abs(v))
    require(bool(np.isfinite(analytic).all()), f"rows of '{bound.name}' are not finite", q)
    apart = np.where(tried, np.abs(numeric - analytic), 0.0) / scale
    i = int(np.argmax(apart))
    require(
        bool(apart[i] <= tolerance),
        f"row '{bound.row_names[i]}' of '{bound.name}' is not the derivative of its error: "
        f"ė = {numeric[i]:.6g} by differences and {analytic[i]:.6g} by the row, along v = {v.round(3)}",
        q,
    )
    return tried


def _check_constant(bound: BoundTask, rows: LevelRows, robot: Robot, places: list[Array]) -> None:
    """Check that constant rows do not change when they are filled."""
    if bound.constant:
        before = _copy(rows)
        for q in places:
            bound.fill(Configuration(robot, q), TIME, rows)
            apart = _difference(before, _copy(rows))
            require(
                apart == 0.0, f"rows of '{bound.name}' are said to be constant and change by {apart:.3g}", q
            )


def _check_factors(task: Task, bound: BoundTask, robot: Robot) -> None:
    """Check that gain and weight of the declaration scale those of the rows."""
    declared = {item.name for item in fields(task)} if is_dataclass(task) else set()
    for name, factor in (("gain", 2.0), ("weight", 3.0)):
        if name not in declared:
            continue
        numbers = factor * np.asarray(vars(task)[name], dtype=np.float64)
        scaled = {name: numbers if numbers.ndim else float(numbers)}
        other = replace(task, **scaled).bind(robot, bound.name)  # type: ignore[type-var]
        apart = float(np.abs(vars(other)[name] - factor * vars(bound)[name]).max())
        largest = float(np.abs(vars(bound)[name]).max())
        what = f"{factor:g} times the {name} of '{bound.name}' misses {factor:g} times that of its rows"
        require(apart <= 1e-12 * max(1.0, largest), f"{what} by {apart:.3g}")
