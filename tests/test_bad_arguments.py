"""Arguments of another kind than expected: a clear error of the library from every door, and no velocity."""

import inspect
from collections.abc import Callable

import numpy as np
import pytest

import taskopt
from taskopt import Configuration, Controller, FrameTask, JointTask, ObstacleLimit, Scenario, Stack
from taskopt.errors import InvalidValue, TaskoptError, UnknownName
from tests.helpers.robots import robot

BAD = [3, "x", None, float("nan"), {"a": 1}, [1, 2], object()]
NAMES = [str(bad).split(" at ")[0] for bad in BAD]
# What else a class needs to be made, so that only one argument is bad.
GOOD: dict[str, dict[str, object]] = {
    "AxisAlignmentTask": {"frame": "panda_hand", "direction": [0, 0, 1]},
    "BoxTask": {"frame": "panda_hand", "lower": [0, 0, 0], "upper": [1, 1, 1]},
    "CentreOfMassTask": {},
    "Circle": {"radius": 0.1, "period": 2.0},
    "FrameDistanceLimit": {"frame_a": "panda_hand", "frame_b": "panda_link0", "lower": 0.1},
    "EulerAngles": {"axes": "ZYZ"},
    "FrameTask": {"frame": "panda_hand"},
    "GazeTask": {"frame": "panda_hand", "target": [1, 0, 0], "half_angle": 0.1},
    "JointAccelerationLimit": {"acceleration": 10.0},
    "JointRange": {},
    "JointPositionLimit": {},
    "JointTask": {},
    "JointVelocityLimit": {},
    "Line": {"by": [0.1, 0, 0], "duration": 1.0},
    "LowAccelerationTask": {},
    "LookAtTask": {"frame": "panda_hand", "target": [1, 0, 0]},
    "ObstacleLimit": {"obstacles": []},
    "OrientationTask": {"frame": "panda_hand"},
    "PositionTask": {"frame": "panda_hand"},
    "RankRule": {},
    "RelativeFrameTask": {"frame": "panda_hand", "root": "panda_link0"},
    "SelfCollisionLimit": {},
    "SelfDistance": {},
    "Sphere": {"centre": [0, 0, 0], "radius": 0.1},
    "Stack": {"levels": [[JointTask()]]},
}


def arguments(name: str) -> list[str]:
    """The arguments of a class."""
    return [one for one in inspect.signature(getattr(taskopt, name)).parameters if one != "self"]


def outcome(make: Callable[[], object]) -> str:
    """Make something, bind it to a Panda and take a step: "made", or the message of the library."""
    of = robot("panda")
    try:
        made = make()
        if isinstance(made, taskopt.Task):
            made = Stack([[made]])
        elif isinstance(made, taskopt.Limit):
            made = Stack([[JointTask()]], [made])
        if isinstance(made, Stack):
            Controller(of, made).step(of.posture("default"), 0.0)
    except TaskoptError as error:
        return str(error)
    return "made"


@pytest.mark.slow
@pytest.mark.parametrize("name", GOOD)
def test_every_argument_of_another_kind_is_named_or_accepted(name: str) -> None:
    """Each argument in turn is text, nothing, NaN, a mapping, two numbers, and an object."""
    for argument in arguments(name):
        for bad in BAD:
            given = GOOD[name] | {argument: bad}
            assert outcome(lambda given=given: getattr(taskopt, name)(**given))


def test_a_bare_error_is_caught() -> None:
    """A door that raises what Python raises fails the test above."""

    def door() -> None:
        raise TypeError

    with pytest.raises(TypeError):
        outcome(door)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), "now", None, [1.0], {}], ids=str)
def test_a_time_that_is_none_gives_no_velocity(bad: object) -> None:
    """The step says that t is wrong."""
    of = robot("panda")
    control = Controller(of, Stack([[FrameTask("panda_hand")]]))
    with pytest.raises(InvalidValue, match=r"^t "):
        control.step(of.posture("default"), bad)
    assert control.step(of.posture("default"), np.float64(0.0)).claimed
    assert control.step(of.posture("default"), 1).claimed


@pytest.mark.parametrize("bad", BAD, ids=NAMES)
def test_what_is_no_robot_is_named(bad: object) -> None:
    """By a configuration, a controller and a scenario."""
    stack = Stack([[JointTask()]])
    for make in (
        lambda: Configuration(bad, np.zeros(7)),  # type: ignore[arg-type]
        lambda: Controller(bad, stack),  # type: ignore[arg-type]
        lambda: Scenario(robot=bad, q0=np.zeros(7), stack=stack, duration=1.0, dt=0.1),  # type: ignore[arg-type]
    ):
        with pytest.raises(InvalidValue, match="must be a Robot"):
            make()


@pytest.mark.parametrize("bad", BAD, ids=NAMES)
def test_a_posture_of_another_kind_gives_no_velocity(bad: object) -> None:
    """A mapping, too: joints that it leaves out would be where nobody put them."""
    of = robot("panda")
    with pytest.raises((InvalidValue, UnknownName)):
        Controller(of, Stack([[FrameTask("panda_hand")]])).step(bad, 0.0)


def test_a_posture_by_joints() -> None:
    """`posture` takes a mapping; a joint that the robot lacks is named with what is meant."""
    of = robot("panda")
    assert of.posture({"panda_joint1": 0.3})[0] == 0.3
    with pytest.raises(UnknownName, match="panda_joint1"):
        of.posture({"joint1": 0.3})
    with pytest.raises(UnknownName, match="neutral"):
        of.posture(3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ObstacleLimit(3), "list of Sphere, Capsule, Box or HalfSpace, got 3"),
        (lambda: taskopt.JointAccelerationLimit("x"), "acceleration must be numbers"),
        (lambda: FrameTask("panda_hand", target=3), "target of 'panda_hand' must be a pose"),
        (lambda: Stack(3), "list of lists of tasks"),
        (lambda: Stack([[FrameTask("panda_hand", name=3)]]), "name of FrameTask must be text"),
        (lambda: taskopt.JointVelocityLimit(None), "scale must be numbers, got None"),
    ],
)
def test_the_line_that_is_wrong_fails(make: Callable[[], object], says: str) -> None:
    """Not a later one, and the message says what is expected."""
    with pytest.raises(InvalidValue, match=says):
        make()


def test_a_controller_says_what_it_does() -> None:
    """Robot, resolver, Δt, limits and levels in one line, with what is off."""
    of = robot("panda")
    control = Controller(of, Stack([[FrameTask("panda_hand", name="hand")], [JointTask()]]), dt=0.01)
    assert repr(control) == (
        "<Controller of panda, active-set, dt 0.01 s; limits: none; level 1: hand; level 2: posture>"
    )
    control.set({"hand.enabled": False})
    control.step(of.posture("default"), 0.0)
    assert "level 1: hand (off)" in repr(control)
