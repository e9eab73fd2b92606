"""The check of an objective, at random configurations."""

import numpy as np

from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import Objective
from taskopt.kinematics.objective.function import numerical_gradient
from taskopt.kinematics.robot import Robot
from taskopt.testing.sampling import configurations, require

_ROUNDING = 1e-12  # distances are iterated from where they were last


def check_objective(
    objective: Objective, robot: Robot, *, count: int = 16, seed: int = 0, tolerance: float = 1e-6
) -> None:
    """Check that an objective fulfils the contract of `taskopt.Objective`.

    - `value` is one finite number, `gradient` (nv,) finite numbers, and `unit` a string.
    - The gradient is that of the value, by central differences on the manifold.
    - Both depend on q only: a second call gives the same result, the configuration is left as it was, and a
      returned gradient does not change with the next call.

    Args:
        objective: The objective.
        robot: A robot that it fits.
        count: Number of configurations; every fourth is near a singularity of most arms.
        seed: Seed of the random configurations.
        tolerance: Largest difference of gradients, relative to max(1, |∂w/∂q|).

    Raises:
        AssertionError: Something does not hold; the message says what, where, and by how much.
    """
    what = type(objective).__name__
    require(isinstance(objective, Objective), f"{what} does not derive from taskopt.Objective")
    require(isinstance(objective.unit, str), f"unit of {what} is {objective.unit!r}, not a string")
    rng = np.random.default_rng(seed)
    other = Configuration(robot, robot.neutral)
    for q in configurations(robot, count, rng):
        configuration = Configuration(robot, q)
        value, gradient = objective.value(configuration), objective.gradient(configuration)
        require(np.ndim(value) == 0 and bool(np.isfinite(value)), f"value of {what} is {value!r}", q)
        shape = np.shape(gradient)
        require(
            shape == (robot.nv,), f"gradient of {what} has the shape {shape} for {robot.nv} velocities", q
        )
        require(bool(np.isfinite(gradient).all()), f"gradient of {what} is not finite", q)
        moved = float(np.abs(configuration.q - q).max())
        require(moved == 0.0, f"{what} moved the configuration by {moved:.3g}", q)
        kept = gradient.copy()
        objective.gradient(other)
        apart = float(np.abs(gradient - kept).max())
        require(apart == 0.0, f"a gradient of {what} changed by {apart:.3g} with the next call", q)
        apart = abs(objective.value(configuration) - value)
        require(
            apart <= _ROUNDING * max(1.0, abs(value)),
            f"value of {what} differs by {apart:.3g} a second time",
            q,
        )
        numeric = numerical_gradient(objective.value, configuration)
        apart = np.abs(numeric - kept)
        k = int(np.argmax(apart))
        require(
            bool(apart[k] <= tolerance * max(1.0, float(np.abs(kept).max()))),
            f"gradient of {what} along {robot.velocity_names[k]} is {kept[k]:.9g}, and {numeric[k]:.9g} by "
            "central differences",
            q,
        )
