"""Functions of the configuration that a secondary goal climbs (3.55); they add and scale."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Union

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.kinematics.configuration import Configuration


class Objective(ABC):
    """A function w(q), larger being better, with its gradient.

    Own objectives derive from this; 5.0 * a + 0.1 * b and −a are objectives too.
    """

    __array_ufunc__ = None  # so that a NumPy number leaves the product to __rmul__

    @abstractmethod
    def value(self, at: Configuration) -> float:
        """w(q)."""

    @abstractmethod
    def gradient(self, at: Configuration) -> Array:
        """∂w/∂q (nv,), per unit of each velocity."""

    def __add__(self, other: "Objective") -> "Sum":
        if not isinstance(other, Objective):
            return NotImplemented
        return Sum((*_terms(self), *_terms(other)))

    def __radd__(self, other: object) -> Union["Sum", "Objective"]:
        """Zero may stand before an objective, so that the built-in sum() works."""
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
    """Σ factor · w over pairs of factor and objective."""

    terms: tuple[tuple[float, Objective], ...]

    def value(self, at: Configuration) -> float:
        return sum(factor * term.value(at) for factor, term in self.terms)

    def gradient(self, at: Configuration) -> Array:
        out = np.zeros(at.robot.nv)
        for factor, term in self.terms:
            out += factor * term.gradient(at)
        return out


def _terms(objective: Objective) -> Sequence[tuple[float, Objective]]:
    return objective.terms if isinstance(objective, Sum) else ((1.0, objective),)
