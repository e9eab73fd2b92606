"""Random configurations at which the checks try something, and the sentence of a failure."""

from collections.abc import Iterator

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.robot import Robot

NEAR = 1e-3  # spread [rad, m] of the configurations near the posture where all joint variables are zero


def configurations(robot: Robot, count: int, rng: np.random.Generator) -> Iterator[Array]:
    """Yield configurations inside the joint limits.

    Every fourth one lies near the posture with all joint variables zero, where many arms are stretched and
    their Jacobians lose rank.

    Args:
        robot: The robot.
        count: How many.
        rng: Source of randomness.

    Yields:
        Configurations, (nq,).
    """
    middle = robot.posture("middle")
    for index in range(count):
        if index % 4 == 3:
            q = robot.integrate(robot.neutral, NEAR * rng.normal(size=robot.nv), 1.0)
        else:
            q = robot.integrate(middle, rng.uniform(-1.0, 1.0, robot.nv), 1.0)
        yield inside(robot, q)


def inside(robot: Robot, q: Array) -> Array:
    """Return a configuration with every joint variable moved into its range.

    Args:
        robot: The robot.
        q: Configuration, (nq,).

    Returns:
        Configuration, (nq,), a copy with quaternions of norm 1.
    """
    out, limited = q.copy(), np.flatnonzero(robot.position_index >= 0)
    places = robot.position_index[limited]
    out[places] = np.clip(out[places], robot.position_lower[limited], robot.position_upper[limited])
    return robot.checked_q(out)


def require(holds: bool, sentence: str, q: Array | None = None) -> None:
    """Raise an error unless something holds.

    Args:
        holds: What must be true.
        sentence: What failed, and by how much.
        q: Configuration at which it failed, (nq,).

    Raises:
        AssertionError: It does not hold.
    """
    if not holds:
        where = "" if q is None else f", at q = {np.array2string(q, precision=6, max_line_width=10_000)}"
        raise AssertionError(sentence + where)
