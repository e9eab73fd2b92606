"""Base of objectives: functions of the configuration, which can be added and scaled."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Union

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape


class Objective(ABC):
    """A function w(q), larger being better, with its gradient.

    Own objectives derive from this class and define `value` and `gradient`; `taskopt.testing.check_objective`
    checks them. For objectives a and b, 5.0 * a + 0.1 * b and −a are objectives, too. Objectives must be
    hashable and must not change.

    Attributes:
        unit: Unit of w, such as "m"; "" for a plain number.
        obstacles: Shapes that w depends on, which a viewer draws.

    Source:
        Equation (3.55).
    """

    unit: str = ""
    obstacles: Sequence[Shape] = ()

    __array_ufunc__ = None  # so that a NumPy number leaves the product to __rmul__

    @abstractmethod
    def value(self, configuration: Configuration) -> float:
        """Return w(q).

        Args:
            configuration: Robot at q.

        Returns:
            w, in its unit.
        """

    @abstractmethod
    def gradient(self, configuration: Configuration) -> Array:
        """Return the gradient of w, one derivative for each velocity.

        Args:
            configuration: Robot at q.

        Returns:
            (nv,), in the unit of w per rad or m: entry k is the derivative of w(q ⊕ s e_k) by s at 0.
        """

    def __add__(self, other: "Objective") -> "Sum":
        if not isinstance(other, Objective):
            return NotImplemented
        return Sum((*_terms(self), *_terms(other)))

    def __radd__(self, other: object) -> Union["Sum", "Objective"]:
        """Return the objective itself for 0 + objective, so that the built-in sum() works."""
        return self if other == 0 else NotImplemented

    def __mul__(self, factor: float) -> "Sum":
        if not isinstance(factor, float | int | np.floating | np.integer):
            return NotImplemented
        number = float(finite("factor of an objective", factor, ()))
        return Sum(tuple((number * own, term) for own, term in _terms(self)))

    __rmul__ = __mul__

    def __neg__(self) -> "Sum":
        return -1.0 * self

    def __sub__(self, other: "Objective") -> "Sum":
        return self + -other


@dataclass(frozen=True)
class Sum(Objective):
    """A weighted sum of objectives, w = Σ factor · w_i.

    Attributes:
        terms: Pairs of factor and objective.
    """

    terms: tuple[tuple[float, Objective], ...]

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit that all terms have in common, or "" if they differ; factors have no unit."""
        units = {term.unit for _, term in self.terms}
        return units.pop() if len(units) == 1 else ""

    @property
    def obstacles(self) -> Sequence[Shape]:  # type: ignore[override]
        """Shapes that the terms depend on."""
        return tuple(shape for _, term in self.terms for shape in term.obstacles)

    def value(self, configuration: Configuration) -> float:
        """Return w(q); see `Objective.value`."""
        return sum(factor * term.value(configuration) for factor, term in self.terms)

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂w/∂q (nv,); see `Objective.gradient`."""
        out = np.zeros(configuration.robot.nv)
        for factor, term in self.terms:
            out += factor * term.gradient(configuration)
        return out


def _terms(objective: Objective) -> Sequence[tuple[float, Objective]]:
    """Return the terms of a sum; any other objective is its own only term."""
    return objective.terms if isinstance(objective, Sum) else ((1.0, objective),)
