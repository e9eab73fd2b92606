"""Every objective that we ship keeps the contract of an objective, and the check catches each planted lie."""

import numpy as np
import pytest

from taskopt import (
    JointRange,
    Manipulability,
    Objective,
    ObstacleDistance,
    SelfDistance,
    Sphere,
    UserFunction,
)
from taskopt.testing import check_objective
from tests.helpers.robots import FRAMES, robot

BALLS = [Sphere([3.0, 2.5, 0.4], 0.1), Sphere([-3.0, -1.0, 0.2], 0.2)]


def near_origin(frame):
    """w = −½ ‖p‖² as a user function, p being the origin of a frame."""

    def value(configuration):
        p = configuration.pose(frame)[:3, 3]
        return -0.5 * float(p @ p)

    def derivative(configuration):
        return -configuration.pose(frame)[:3, 3] @ configuration.jacobian(frame)[:3]

    return UserFunction(value, derivative, unit="m²")


@pytest.mark.parametrize("name", ["planar", "panda", "tiago", "talos_reduced"])
@pytest.mark.parametrize(
    ("make", "unit"),
    [
        (lambda r: JointRange(), ""),
        (lambda r: Manipulability(FRAMES[r], "xy"), "m²"),
        (lambda r: 5.0 * JointRange() - 0.1 * JointRange(), ""),
        (lambda r: near_origin(FRAMES[r]), "m²"),
    ],
    ids=["joint range", "manipulability", "sum", "function"],
)
def test_objectives_keep_the_contract(make, unit, name):
    """The gradient is that of the value, and the unit is as stated."""
    check_objective(make(name), robot(name), count=5, tolerance=1e-4)  # w bends sharply near w = 0
    assert make(name).unit == unit


@pytest.mark.parametrize(
    "objective", [ObstacleDistance(BALLS), SelfDistance(temperature=0.05)], ids=["obstacle", "self"]
)
def test_distances_keep_the_contract(objective):
    """The same for distances, in metres."""
    check_objective(objective, robot("panda"), count=5, tolerance=1e-4)
    assert objective.unit == "m"


class Half(Objective):
    """w = −½ q_1²: what a user would write, with room for one lie."""

    def __init__(self, lie=""):
        self.lie, self._out, self._calls = lie, None, 0
        if lie == "unit":
            self.unit = None

    def value(self, configuration):
        self._calls += 1
        value = -0.5 * configuration.q[0] ** 2
        if self.lie == "memory":
            value += 1e-3 * self._calls
        if self.lie == "moves":
            configuration.q[0] += 0.1
        return np.nan if self.lie == "nan" else value

    def gradient(self, configuration):
        out = np.zeros(configuration.robot.nv + (self.lie == "shape"))
        if self.lie == "shared":
            self._out = out if self._out is None else self._out
            out = self._out
        out[0] = -configuration.q[0] * (1.001 if self.lie == "gradient" else 1.0)
        return out


LIES = {
    "unit": "unit of Half",
    "memory": "differs by .* a second time",
    "moves": "moved the configuration",
    "nan": "value of Half is nan",
    "shape": "has the shape",
    "shared": "changed by .* with the next call",
    "gradient": "by central differences",
}


def test_an_objective_of_a_user_passes():
    """The honest one keeps the contract."""
    check_objective(Half(), robot("planar"))


@pytest.mark.parametrize("lie", LIES)
def test_each_lie_is_caught(lie):
    """One lie at a time fails with a sentence that names it."""
    with pytest.raises(AssertionError, match=LIES[lie]):
        check_objective(Half(lie), robot("planar"))
