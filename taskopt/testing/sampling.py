"""Random configurations for the checks, and the messages of failures."""

import re
from collections.abc import Iterator

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot

NEAR = 1e-3  # spread [rad, m] of the configurations near the posture where all joint variables are zero


def configurations(robot: Robot, count: int, rng: np.random.Generator) -> Iterator[Array]:
    """Yield configurations inside the joint limits.

    Every fourth one lies near the posture with all joint variables zero, where many arms are stretched and
    their Jacobians lose rank.

    Args:
        robot: The robot.
        count: Number of configurations.
        rng: Source of randomness.

    Yields:
        Configurations, (nq,) [rad, m].
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
        Configuration, (nq,) [rad, m], a copy with quaternions of norm 1.
    """
    out, limited = q.copy(), np.flatnonzero(robot.position_index >= 0)
    places = robot.position_index[limited]
    out[places] = np.clip(out[places], robot.position_lower[limited], robot.position_upper[limited])
    return robot.checked_q(out)


def require(holds: bool, sentence: str, q: Array | None = None) -> None:
    """Raise an error unless a condition holds.

    Args:
        holds: The condition.
        sentence: Sentence that says what failed, and by how much.
        q: Configuration at which the condition was tried, (nq,) [rad, m].

    Raises:
        AssertionError: The condition does not hold.
    """
    if not holds:
        where = "" if q is None else f", at q = {np.array2string(q, precision=6, max_line_width=10_000)}"
        raise AssertionError(sentence + where)


def require_unmoved(configuration: Configuration, q: Array, what: str) -> None:
    """Raise an error if a configuration has been changed.

    Args:
        configuration: The configuration.
        q: The posture to which it was set, (nq,) [rad, m].
        what: Name of the function that was called, for the message.

    Raises:
        AssertionError: The configuration has another posture.
    """
    moved = float(np.abs(configuration.q - q).max(initial=0.0))
    require(moved == 0.0, f"{what} moves the robot that it is handed, by {moved:.3g}", q)


def is_rate(unit: str) -> bool:
    """Return True for a unit of a rate: a product of m, rad and 1, perhaps with an exponent, per second.

    Args:
        unit: The unit; "" stands for a rate without a unit.

    Returns:
        True for a unit such as "rad/s", "m²/s" or "1/s".
    """
    return unit == "" or re.fullmatch(r"(1|(rad|m)[²³]?)((/|·| )(rad|m)[²³]?)*/s", unit) is not None
