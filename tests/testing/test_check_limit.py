"""Every limit that we ship keeps the contract of a limit, and the check catches each planted lie."""

from dataclasses import dataclass

import numpy as np
import pytest

from taskopt import (
    InvalidValue,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    ObstacleLimit,
    SelfCollisionLimit,
    Sphere,
    Stack,
)
from taskopt.kinematics.limit import BoundLimit, Limit, RowLimit
from taskopt.testing import check_limit
from tests.helpers.robots import robot


def out_of_range(configuration):
    """By how much a joint is outside its range."""
    of = configuration.robot
    limited = np.flatnonzero(of.position_index >= 0)
    q = configuration.q[of.position_index[limited]]
    return float(np.maximum(of.position_lower[limited] - q, q - of.position_upper[limited]).max())


def too_near(limit, of, dt=1e-2):
    """By how much a distance is below the margin of a limit."""
    bound = limit.bind(of, dt)

    def outside(configuration):
        bound.distances.update(configuration)
        return float(bound.margin - bound.distances.distance.min())

    return outside


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar", "panda", "tiago", "talos_reduced"])
@pytest.mark.parametrize(
    ("limit", "outside"),
    [
        (JointPositionLimit(), out_of_range),
        (JointPositionLimit(0.3), out_of_range),
        (JointVelocityLimit(0.5), None),
        (JointAccelerationLimit(20.0), out_of_range),
    ],
    ids=["position", "position, gentle", "velocity", "acceleration"],
)
def test_limits_of_joints_keep_the_contract(limit, outside, name):
    """Braking is always allowed, and the largest allowed step stays inside."""
    check_limit(limit, robot(name), outside=outside, count=4)


@pytest.mark.parametrize(
    "limit",
    [ObstacleLimit([Sphere([0.5, 0.3, 0.5], 0.1)], gain=1.0), SelfCollisionLimit(gain=1.0)],
    ids=["obstacle", "self"],
)
def test_limits_of_distances_keep_the_contract(limit):
    """The same for distances of the Panda."""
    of = robot("panda")
    check_limit(limit, of, outside=too_near(limit, of), count=4)


@dataclass(frozen=True)
class Wall(Limit):
    """q_1 ≤ 0.5 rad: what a user would write, with room for one lie."""

    lie: str = ""
    name: str = "wall"

    def bind(self, robot, dt):
        return BoundWall(robot, self, dt)


class BoundWall(BoundLimit):
    """One bound."""

    def __init__(self, robot, limit, dt):
        super().__init__(limit.name, ("wall", "wall") if limit.lie == "owners" else None)
        self._lie, self._dt = limit.lie, dt
        self.constant = limit.lie == "constant"

    def narrow(self, configuration, bounds, owner):
        room = 0.5 - configuration.q[0]
        upper = max(room / self._dt, 0.0) * (1.5 if self._lie == "oversteps" else 1.0)
        if self._lie == "no way out" and room < 0.2:
            upper = -0.1
        if self._lie == "nan":
            upper = np.nan
        if self._lie == "moves":
            configuration.q[0] -= 1e-3
        if self._lie == "widens" or not upper >= bounds[1, 0]:
            bounds[1, 0] = upper
            bounds[3, 0] = owner + (1 if self._lie == "foreign owner" else 0)
        if self._lie == "careless owner":
            bounds[2, 1] = owner


def beyond_wall(configuration):
    """By how much q_1 is beyond the wall."""
    return float(configuration.q[0] - 0.5)


LIES = {
    "owners": "owners of 'wall' are not unique",
    "oversteps": "goes .* outside",
    "no way out": "braking misses a bound of 'wall'",
    "moves": "narrow of 'wall' moves the robot that it is handed|differ",
    "nan": "limits are not finite|is NaN",
    "widens": "widens a bound",
    "foreign owner": "does not write its owner|index",
    "careless owner": "does not write its owner",
    "constant": "compiled and Python bounds of 'wall' differ",
}


def test_a_limit_of_a_user_passes():
    """The honest one keeps the contract."""
    check_limit(Wall(), robot("planar"), outside=beyond_wall)


@pytest.mark.parametrize("lie", LIES)
def test_each_lie_is_caught(lie):
    """One lie at a time fails with a sentence that names it."""
    with pytest.raises((AssertionError, InvalidValue), match=LIES[lie]):
        check_limit(Wall(lie), robot("planar"), outside=beyond_wall)


class Empty(Limit):
    """A limit whose bound form lacks something."""

    def __init__(self, bound):
        self.bound = bound

    def bind(self, robot, dt):
        return self.bound()


@pytest.mark.parametrize(
    ("bound", "sentence"),
    [
        (lambda: BoundLimit("empty"), r"lacks narrow\(\) or a kernel"),
        (lambda: RowLimit("empty", ("x",), ("m/s",)), r"lacks fill\(\) or a kernel"),
        (lambda: BoundLimit.__new__(BoundLimit), "lacks name, owners of BoundLimit"),
        (lambda: None, "must return a RowPart"),
    ],
)
def test_an_incomplete_limit_is_refused_when_the_stack_is_compiled(bound, sentence):
    """The message names the class, what it lacks, and the base class that has it."""
    with pytest.raises(InvalidValue, match=sentence):
        Stack([[JointTask()]], [Empty(bound)]).compile(robot("planar"), 1e-3)
