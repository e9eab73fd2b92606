"""The smallest of many distances as something to climb: a minimum made smooth."""

from abc import abstractmethod
from functools import lru_cache

import numpy as np

from taskopt.arrays import Array, finite
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.robot.robot import Robot


class Nearest(Objective):
    """w = min d over pairs of solids [m], made smooth: w = −τ log Σ exp(−dᵢ/τ), τ = `temperature` [m].

    The minimum has a kink where another pair takes over, at which a climb would chatter. w lies between
    min d − τ log(number of pairs) and min d, and pairs that are farther by τ count a third; 0 is the
    plain minimum.
    """

    temperature: float

    @abstractmethod
    def collision(self, robot: Robot) -> Collision:
        """The pairs of a robot."""

    def value(self, at: Configuration) -> float:
        d = _measured(self, at).distance
        nearest = float(d.min())
        if self.temperature == 0.0:
            return nearest
        return nearest - self.temperature * float(np.log(np.exp((nearest - d) / self.temperature).sum()))

    def gradient(self, at: Configuration) -> Array:
        """Σ pᵢ ∇dᵢ, pᵢ = exp(−dᵢ/τ) / Σ exp(−dⱼ/τ)."""
        of = _measured(self, at)
        if self.temperature == 0.0:
            return of.gradient[np.argmin(of.distance)].copy()
        share = np.exp((of.distance.min() - of.distance) / self.temperature)
        return (share / share.sum()) @ of.gradient


def checked_temperature(temperature: float) -> float:
    """τ ≥ 0 [m]; raise `InvalidValue` otherwise."""
    tau = float(finite("temperature", temperature, ()))
    if tau < 0.0:
        raise InvalidValue(f"temperature must be ≥ 0, got {tau:g}")
    return tau


def _measured(objective: Nearest, at: Configuration) -> Distances:
    out = _distances(objective, at.robot)
    out.update(at)
    return out


@lru_cache(maxsize=32)
def _distances(objective: Nearest, robot: Robot) -> Distances:
    return Distances(objective.collision(robot))
