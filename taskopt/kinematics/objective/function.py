"""Objectives written by the user as functions of the configuration."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, finite
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective

_STEP = 6e-6  # cube root of the spacing of floats: truncation and rounding of a central difference balance


@dataclass(frozen=True)
class UserFunction(Objective):
    """w(q) as `value(at)`, with ∂w/∂q (nv,) as `derivative(at)`; `at` is a `Configuration`, `at.q` its q.

    Without a gradient, w is differentiated numerically, by 2 nv evaluations on every tick and to
    about ten digits; a warning says so. Raises `InvalidValue` if a function returns the wrong shape or NaN.
    """

    function: Callable[[Configuration], float]
    derivative: Callable[[Configuration], ArrayLike] | None = None

    def __post_init__(self) -> None:
        if self.derivative is None:
            warnings.warn(
                f"{self._name} has no gradient and is differentiated numerically, with two evaluations a "
                "joint on every tick; give derivative= to be exact and fast",
                stacklevel=3,
            )

    def value(self, at: Configuration) -> float:
        return float(finite(f"value of {self._name}", self.function(at), ()))

    def gradient(self, at: Configuration) -> Array:
        if self.derivative is not None:
            return finite(f"gradient of {self._name}", self.derivative(at), (at.robot.nv,))
        return numerical_gradient(self.value, at)

    @property
    def _name(self) -> str:
        return f"objective '{getattr(self.function, '__name__', 'function')}'"


def numerical_gradient(value: Callable[[Configuration], float], at: Configuration) -> Array:
    """Central differences (nv,) of a function along each velocity, on the manifold (3.48)."""
    robot, near = at.robot, Configuration(at.robot, at.q)
    out, step = np.empty(robot.nv), np.zeros(robot.nv)
    for k in range(robot.nv):
        step[k] = _STEP
        near.update(robot.integrate(at.q, step, 1.0))
        ahead = value(near)
        near.update(robot.integrate(at.q, step, -1.0))
        out[k] = (ahead - value(near)) / (2.0 * _STEP)
        step[k] = 0.0
    return out
