"""Runs of the scenarios behind the figures, as arrays."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path as File

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.limit import JointVelocityLimit
from taskopt.kinematics.robot.textbook import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.loop.run import run
from taskopt.loop.scenario import FOLDER, Scenario, load_scenario


@dataclass(frozen=True, eq=False)
class Path:
    """The quantities of a run that a figure shows.

    Attributes:
        t: Time (ticks,) [s].
        q: Postures (ticks, n) [rad].
        v: Velocities (ticks, n) [rad/s].
        error: x_d − x of the tip, (ticks, 2 or 3) [m, m, rad].
        velocity_limit: Velocity limits of the joints, (n,) [rad/s].
    """

    t: Array
    q: Array
    v: Array
    error: Array
    velocity_limit: Array

    @property
    def position_error(self) -> Array:
        """(ticks,) norm of the position error [m]."""
        return np.linalg.norm(self.error[:, :2], axis=1)


def follow(name: str, resolver: str, velocity: float | None = None) -> Path:
    """Run a scenario of the folder `tasks`, and keep the quantities that figures show.

    Args:
        name: Name of its file, without the ending.
        resolver: Name of the resolver.
        velocity: Limit for all joints [rad/s], for a scenario of the planar arm that declares none; None: the
            scenario as it is.

    Returns:
        The path.

    Raises:
        MissingFile: There is no such scenario in the working directory.
    """
    return _follow((FOLDER / f"{name}.py").resolve(), resolver, velocity)


@cache
def _follow(file: File, resolver: str, velocity: float | None) -> Path:
    """Run a scenario file; a run that several figures share is computed only once."""
    scenario = load_scenario(file)
    if velocity is not None:
        scenario = _limited(scenario, velocity)
    steps = [
        (step.t, step.q.copy(), step.v.copy(), *step.errors.values()) for step in run(scenario, resolver)
    ]
    t, q, v, error = (np.array([step[i] for step in steps]) for i in range(4))
    return Path(t, q, v, error, scenario.robot.velocity_limit)


def _limited(scenario: Scenario, velocity: float) -> Scenario:
    """Return a scenario of the arm of three links of 0.5 m with a velocity limit."""
    robot = planar_arm([0.5, 0.5, 0.5], velocity=velocity)
    stack = Stack(
        levels=scenario.stack.levels,
        limits=[*scenario.stack.limits, JointVelocityLimit()],
        damping=scenario.stack.damping,
    )
    return replace(scenario, robot=robot, stack=stack)
