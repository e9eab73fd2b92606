"""Objectives written by the user as functions of the configuration."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective

_STEP = 6e-6  # cube root of the spacing of floats: truncation and rounding of a central difference balance


@dataclass(frozen=True)
class UserFunction(Objective):
    """An objective from plain functions of the configuration.

    Without a derivative, w is differentiated numerically to about ten digits, which takes 2 nv evaluations at
    every tick; a warning says so.

    Args:
        function: Function w that takes a `Configuration`, whose posture is `configuration.q` (nq,), and
            returns a number.
        derivative: Function that takes a `Configuration` and returns ∂w/∂q along the velocities, (nv,).
            Default: central differences.
        unit: Unit of w, such as "m"; "" for a plain number.

    Raises:
        InvalidValue: When evaluated: a function returns an array of the wrong shape, or NaN.
    """

    function: Callable[[Configuration], float]
    derivative: Callable[[Configuration], ArrayLike] | None = None
    unit: str = ""

    def __post_init__(self) -> None:
        if self.derivative is None:
            warnings.warn(
                f"{self._name} has no gradient and is differentiated numerically, with two evaluations a "
                "joint on every tick; give derivative= to be exact and fast",
                stacklevel=3,
            )

    def value(self, configuration: Configuration) -> float:
        """Return w(q); see `Objective.value`."""
        return float(finite(f"value of {self._name}", self.function(configuration), ()))

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂w/∂q (nv,); see `Objective.gradient`."""
        if self.derivative is not None:
            gradient = self.derivative(configuration)
            return finite(f"gradient of {self._name}", gradient, (configuration.robot.nv,))
        return numerical_gradient(self.value, configuration)

    @property
    def _name(self) -> str:
        """Name of the objective in messages."""
        return f"objective '{getattr(self.function, '__name__', 'function')}'"


def numerical_gradient(value: Callable[[Configuration], float], configuration: Configuration) -> Array:
    """Differentiate a function along each velocity by central differences, on the manifold (3.48).

    Args:
        value: Function that takes a `Configuration` and returns a number.
        configuration: Robot at q.

    Returns:
        Gradient (nv,), correct to about ten digits.
    """
    robot, near = configuration.robot, Configuration(configuration.robot, configuration.q)
    out, step = np.empty(robot.nv), np.zeros(robot.nv)
    for k in range(robot.nv):
        step[k] = _STEP
        near.update(robot.integrate(configuration.q, step, 1.0))
        ahead = value(near)
        near.update(robot.integrate(configuration.q, step, -1.0))
        out[k] = (ahead - value(near)) / (2.0 * _STEP)
        step[k] = 0.0
    return out
