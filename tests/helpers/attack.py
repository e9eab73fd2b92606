"""Runs whose every step goes to the corner of what a limit allows, towards its edge or past it."""

import numpy as np
from scipy.optimize import linprog

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.collision.step_bounds import nominal_speeds
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.point_limit import BoundPointLimit


def allowed(bound: BoundPointLimit, at: Configuration) -> tuple[LevelRows, Array]:
    """The rows of a limit at a configuration, and its bounds (2, nv)."""
    m, n = len(bound.row_names), at.robot.nv
    rows = LevelRows(np.zeros((m, n)), np.zeros(m), np.zeros(m), np.ones(m))
    bound.prepare(rows)
    bound.fill(at, 0.0, rows)
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], n, axis=1)
    bound.narrow(at, bounds, 1)
    return rows, bounds[:2]


def attacked(
    start: Configuration, bound: BoundPointLimit, dt: float, rng: np.random.Generator, *, honest: bool = True
) -> Array:
    """What is left of each value after each of 30 steps, (30, m); without the limit's bounds if not honest.

    Each step attacks what is nearest to its edge; every velocity keeps the nominal speeds.
    """
    at, out, speeds = start, [], nominal_speeds(start.robot)
    for _ in range(30):
        rows, bounds = allowed(bound, at)
        toward = bound._gradient[int(np.argmin(bound.value))] * rng.choice([0.0, 3.0, 10.0])
        box = np.stack([-speeds, speeds])
        if honest:
            box = np.stack([np.maximum(box[0], bounds[0]), np.minimum(box[1], bounds[1])])
        on = np.isfinite(rows.lower)
        rows_on = (-rows.A[on], -rows.lower[on]) if on.any() else (None, None)
        found = linprog(toward + 0.3 * rng.normal(size=speeds.size), *rows_on, bounds=box.T)
        assert found.status == 0, found.message
        at = Configuration(at.robot, at.robot.integrate(at.q, found.x, dt))
        allowed(bound, at)
        out.append(bound.value.copy())
    return np.array(out)
