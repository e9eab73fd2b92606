"""Copies and pickles of everything public are right, here and in another process, or are refused clearly."""

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Circle,
    Configuration,
    Controller,
    During,
    FrameTask,
    Function,
    InvalidValue,
    JointAccelerationLimit,
    JointTask,
    JointVelocityLimit,
    Latest,
    LevelDamping,
    Line,
    PositionTask,
    Robot,
    Scenario,
    Stack,
    run,
)
from taskopt.hierarchy.damping import Chiaverini
from tests.helpers.robots import FINGERS, FRAMES, generic_q, robot

COPIES: dict[str, Callable[[object], object]] = {
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}
DT = 0.01


def lift(t: float) -> list[float]:
    """A point that moves up; at the top level of a module, so that it can be pickled."""
    return [0.4, 0.1, 0.4 + 0.1 * t]


def stack() -> Stack:
    """Levels with a circle, a limit on acceleration that remembers the last velocity, and damping."""
    hand = FrameTask("panda_hand", target=Circle(radius=0.1, period=2.0), gain=5.0, name="hand")
    damping = LevelDamping(Chiaverini(0.1, 0.1))
    return Stack([[hand, damping], [JointTask(name="rest")]], [JointAccelerationLimit(5.0)])


@pytest.mark.slow
@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("name", [*FRAMES, "anthropomorphic", "four_bar"])
def test_a_copied_robot_is_the_same_robot(name: str, how: str) -> None:
    """Names, limits, postures, Jacobians and shapes of a copy are those of the original."""
    of = robot(name) if name in FRAMES else Robot.load(name)
    twin = COPIES[how](of)
    assert isinstance(twin, Robot)
    assert (twin.name, twin.joints, twin.frames, twin.couplings) == (
        of.name,
        of.joints,
        of.frames,
        of.couplings,
    )
    for field in ("position_lower", "position_upper", "velocity_limit", "acceleration_limit", "neutral"):
        np.testing.assert_array_equal(getattr(twin, field), getattr(of, field))
    q = generic_q(of, 4)
    for frame in of.frames[-2:]:
        np.testing.assert_array_equal(
            Configuration(twin, q).jacobian(frame), Configuration(of, q).jacobian(frame)
        )
    shapes, mine = twin.geometry.geometryObjects, of.geometry.geometryObjects
    assert [(s.name, s.parentJoint) for s in shapes] == [(s.name, s.parentJoint) for s in mine]


@pytest.mark.parametrize("how", COPIES)
def test_a_copied_configuration_moves_by_itself(how: str) -> None:
    """A copy follows its own updates, and the original does not."""
    q = generic_q(robot("panda"), 4)
    of = Configuration(robot("panda"), q)
    twin = COPIES[how](of)
    assert isinstance(twin, Configuration)
    other = generic_q(robot("panda"), 5)
    twin.update(other)
    right = Configuration(robot("panda"), other)
    np.testing.assert_array_equal(twin.jacobian("panda_hand"), right.jacobian("panda_hand"))
    np.testing.assert_array_equal(
        of.jacobian("panda_hand"), Configuration(robot("panda"), q).jacobian("panda_hand")
    )


@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp", "hqp/proxqp", "wqp/clarabel", "dls"])
@pytest.mark.parametrize("how", COPIES)
def test_a_copied_controller_goes_on_as_the_original(how: str, resolver: str) -> None:
    """From the copy on both give the same velocities at the same postures; neither disturbs the other."""
    arm, q = robot("panda"), generic_q(robot("panda"), 4)
    closed = resolver == "dls"
    levels = [[PositionTask("panda_hand", target=Circle(radius=0.1, period=2.0), name="hand")]]
    control = Controller(arm, Stack(levels) if closed else stack(), resolver, dt=DT)
    for i in range(5):
        q = arm.integrate(q, control.step(q, i * DT).v, DT)
    control.set({"hand.gain": 3.0})
    q = arm.integrate(q, control.step(q, 5 * DT).v, DT)
    twin = COPIES[how](control)
    assert isinstance(twin, Controller)
    elsewhere = q.copy()
    for i in range(6, 16):
        v = control.step(q, i * DT).v.copy()
        np.testing.assert_allclose(twin.step(q, i * DT).v, v, rtol=1e-9, atol=1e-9)
        q = arm.integrate(q, v, DT)
    assert twin.parameters["hand.gain"] == 3.0
    twin.set({"hand.gain": 9.0})  # the original must not follow
    twin.step(elsewhere, 16 * DT)
    assert control.parameters["hand.gain"] == 3.0


@pytest.mark.parametrize("name", ["rest", "level up"])
def test_a_copy_has_the_changed_parameters_of_a_task_of_any_name(name: str) -> None:
    """A task whose name begins as the address of a level does keeps its weight and its switch."""
    loop = Controller(robot("panda"), Stack([[JointTask(name=name)]]), dt=DT)
    loop.set({f"{name}.weight": 0.25, f"{name}.enabled": False})
    loop.step(generic_q(robot("panda"), 0), 0.0)
    copied = copy.deepcopy(loop).parameters
    assert copied[f"{name}.weight"] == 0.25
    assert copied[f"{name}.enabled"] is False


def test_a_task_that_is_named_as_a_whole_level_is_refused() -> None:
    """Else "level 1.enabled" would switch either the task or the level."""
    with pytest.raises(InvalidValue, match="'level 1' is the name of a whole level"):
        Controller(robot("panda"), Stack([[JointTask(name="level 1")]]), dt=DT)


def test_a_copy_has_a_latest_target_of_its_own() -> None:
    """Each copy is led by its own `Latest`, and starts from the value that the original had."""
    target = Latest()
    control = Controller(robot("panda"), Stack([[PositionTask("panda_hand", target=target)]]), dt=DT)
    q = generic_q(robot("panda"), 4)
    target.set([0.5, 0.0, 0.5])
    control.step(q, 0.0)
    twin = copy.deepcopy(control)
    target.set([0.3, 0.3, 0.3])
    moved, still = control.step(q, DT).v, twin.step(q, DT).v
    right = Controller(robot("panda"), Stack([[PositionTask("panda_hand", target=[0.5, 0.0, 0.5])]]), dt=DT)
    np.testing.assert_allclose(still, right.step(q, 0.0).v, atol=1e-12)
    assert np.abs(moved - still).max() > 0.01


def test_what_cannot_be_copied_is_refused_by_name() -> None:
    """A blend on its way, a moving target that began meanwhile, a task that came meanwhile, a lambda."""
    q = generic_q(robot("panda"), 4)

    def started(tasks: list, **options: object) -> Controller:
        control = Controller(robot("panda"), Stack([tasks]), dt=DT, **options)
        control.step(q, 0.0)
        return control

    hand = PositionTask("panda_hand", name="hand")
    blended = started([hand])
    blended.set({"hand.gain": 2.0}, over=1.0)
    with pytest.raises(InvalidValue, match="being blended"):
        copy.deepcopy(blended)
    fading = started([hand, JointTask()])
    fading.set({"hand.enabled": False}, over=1.0)
    for t in (0.0, 0.5):  # at its first tick, too, at which no bound has opened yet
        fading.step(q, t)
        with pytest.raises(InvalidValue, match="being blended"):
            copy.deepcopy(fading)
    fading.step(q, 1.5)
    np.testing.assert_allclose(copy.deepcopy(fading).step(q, 1.6).v, fading.step(q, 1.6).v, atol=1e-12)
    moving = started([hand])
    moving.set({"hand.target": Line(by=[0.1, 0.0, 0.0], duration=1.0)})
    moving.step(q, DT)
    with pytest.raises(InvalidValue, match="target of 'hand' was replaced by one that moves"):
        pickle.dumps(moving)
    moving.set({"hand.target": [0.5, 0.0, 0.5]})
    moving.step(q, 2 * DT)
    np.testing.assert_allclose(copy.deepcopy(moving).step(q, 3 * DT).v, moving.step(q, 3 * DT).v, atol=1e-12)
    timed = started([During(hand, begin=0.5)])
    copy.deepcopy(timed)
    timed.step(q, 1.0)
    with pytest.raises(InvalidValue, match="'hand' came after the start"):
        copy.deepcopy(timed)
    free = started([PositionTask("panda_hand", target=Function(lambda t: [0.4, 0.1, 0.4 + t]))])
    with pytest.raises(InvalidValue, match="top level of a module"):
        pickle.dumps(free)
    copy.deepcopy(free)
    pickle.loads(pickle.dumps(started([PositionTask("panda_hand", target=Function(lift))])))


@pytest.mark.parametrize("how", COPIES)
def test_records_of_a_run_are_copied_whole(how: str) -> None:
    """Scenario, step, hierarchy, resolution and certificate keep their numbers and their texts."""
    scenario = Scenario(
        robot=robot("panda"), q0=robot("panda").posture("default"), stack=stack(), duration=0.05
    )
    step = next(iter(run(scenario)))
    twin = COPIES[how](step)
    np.testing.assert_array_equal(twin.v, step.v)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(twin.hierarchy.A, step.hierarchy.A)  # type: ignore[attr-defined]
    assert twin.resolution.explain() == step.resolution.explain()  # type: ignore[attr-defined]
    assert repr(twin.resolution.certificate) == repr(step.resolution.certificate)  # type: ignore[attr-defined]
    again = next(iter(run(COPIES[how](scenario))))  # type: ignore[arg-type]
    np.testing.assert_array_equal(again.v, step.v)


@pytest.mark.slow
def test_a_controller_goes_on_in_another_process(tmp_path: object) -> None:
    """Another interpreter unpickles a controller with its robot, and finds the same next velocity."""
    arm, q = Robot.load("panda", lock=FINGERS), generic_q(robot("panda"), 4)
    levels = [[FrameTask("panda_hand", target=Circle(radius=0.1, period=2.0), gain=5.0)], [JointTask()]]
    control = Controller(arm, Stack(levels, [JointVelocityLimit()]), dt=DT)
    control.step(q, 0.0)
    file = f"{tmp_path}/controller.pickle"
    Path(file).write_bytes(pickle.dumps((control, q)))
    code = (
        f"import pickle; control, q = pickle.load(open({file!r}, 'rb')); "
        f"print(control.step(q, {DT}).v.tolist(), len(control.plan.robot.geometry.geometryObjects))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    told, shapes = done.stdout.rsplit(" ", 1)
    np.testing.assert_allclose(np.array(eval(told)), control.step(q, DT).v, atol=1e-12)
    assert int(shapes) == len(arm.geometry.geometryObjects) > 0


USES: dict[str, Callable[[Robot, Controller], object]] = {
    "compile": lambda of, _: Controller(of, Stack([[JointTask()]]), dt=DT),
    "place": lambda of, _: Configuration(of, generic_q(of, 4)),
    "start": lambda of, control: control.start(generic_q(of, 4)),
    "first step": lambda of, control: control.step(generic_q(of, 4), 0.0),
}


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("what", ["upperPositionLimit", "lowerPositionLimit", "upperVelocityLimit"])
def test_changed_limits_of_a_model_are_noticed(what: str, use: str) -> None:
    """Limits that are changed behind a robot's back are refused at its next use."""
    of = Robot(pin.Model(robot("panda").model))
    control = Controller(of, Stack([[JointTask()]]), dt=DT)
    getattr(of.model, what)[2] *= 0.9
    with pytest.raises(InvalidValue, match=f"{what} of .*with_limits"):
        USES[use](of, control)


def test_a_changed_tree_is_noticed_and_a_new_frame_is_known() -> None:
    """Placements of joints are refused; a frame that is added is known at once."""
    of = Robot(pin.Model(robot("panda").model))
    of.model.jointPlacements[3] = of.model.jointPlacements[3] * pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.1]))
    with pytest.raises(InvalidValue, match="jointPlacements"):
        Configuration(of, generic_q(of, 4))
    of = Robot(pin.Model(robot("panda").model))
    of.model.addFrame(pin.Frame("tip", 7, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    assert "tip" in of.frames
    np.testing.assert_array_equal(
        Configuration(of, generic_q(of, 4)).pose("tip"),
        Configuration(of, generic_q(of, 4)).pose("panda_joint7"),
    )
