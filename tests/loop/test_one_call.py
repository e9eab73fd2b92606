"""The tick in one compiled call answers as the tick in steps, in which Pinocchio places the joints."""

from collections.abc import Sequence

import numpy as np
import pytest

from taskopt import (
    ActiveSet,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Latest,
    Resolution,
    RestDamping,
    Robot,
    Stack,
)
from taskopt.arrays import Array, StateArray
from taskopt.kinematics.configuration import Configuration
from taskopt.loop.loop import Loop

DT, TICKS = 0.002, 240
PANDA = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.02, 0.02])
ROBOTS = {  # floating base, frame of the hand, share of the limits on velocities
    "panda": (False, "panda_hand_tcp", 0.3),
    "tiago_dual": (False, "arm_left_tool_link", 0.2),
    "talos_reduced": (True, "gripper_right_base_link", 0.2),
}


def loops(name: str) -> tuple[Robot, Array, Array, list[tuple[Loop, Latest]]]:
    """Robot, posture, pose of the hand, and loops of one stack: one in one call, two in steps."""
    floating, frame, scale = ROBOTS[name]
    robot = Robot.load(name, floating=floating)
    moves = ("torso", "arm", "head") if name == "tiago_dual" else robot.joints
    robot = robot.lock([joint for joint in robot.joints if not joint.startswith(moves)])
    q = PANDA if name == "panda" else robot.posture({"talos_reduced": "half_sitting"}.get(name, "middle"))
    made = []
    for in_steps in (False, True, True):
        hand = Latest()
        levels = [[FrameTask(frame, target=hand, gain=50.0)], [JointTask(gain=2.0)]]
        # In steps a damped tick during a blend takes another number of solves, on TIAGo.
        damping = None if name == "tiago_dual" else RestDamping()
        limits = [JointPositionLimit(), JointVelocityLimit(scale=scale)]
        stack = Stack(levels, limits, damping=damping)
        loop = Loop(stack.compile(robot, DT), ActiveSet(), "raise", timed=in_steps)
        loop.start(q, 0.0)
        made.append((loop, hand))
    return robot, q, Configuration(robot, q).pose(frame), made


def change(k: int, pose: Array, frame: str, loops: Sequence[tuple[Loop, Latest]]) -> None:
    """Move the target on, and change parameters now and then: at once, and blended."""
    target = pose.copy()
    target[:3, 3] += 0.15 * np.sin(0.05 * k) * np.array([0.3, 1.0, 0.5])
    for loop, hand in loops:
        hand.set(target)
        if k == 60:
            loop.plan.set({f"{frame}.gain": 30.0, "posture.target": loop.plan.configuration.q.copy()})
        if k == 100:
            loop.plan.set({f"{frame}.enabled": False}, over=0.05)
        if k == 150:
            loop.plan.set({f"{frame}.enabled": True}, over=0.05)


@pytest.mark.parametrize("name", ROBOTS)
def test_same_velocities(name: str) -> None:
    """Velocities differ by no more than ten times what one last bit of q changes in the other loop."""
    robot, q, pose, made = loops(name)
    (fused, _), (other, _), (nudged, _) = made
    apart, response, bound = 0.0, 0.0, 0
    for k in range(TICKS):
        change(k, pose, ROBOTS[name][1], made)
        t = DT * k
        v = fused.tick(q, t).x
        answer = other.tick(q, t)
        apart = max(apart, float(np.abs(v - answer.x).max()))
        response = max(response, float(np.abs(nudged.tick(np.nextafter(q, np.inf), t).x - answer.x).max()))
        bound += bool(answer.state.any())
        after = fused.next_posture()
        np.testing.assert_allclose(after, robot.integrate(q, v, DT), rtol=0.0, atol=1e-14)
        q = after
    assert bound > TICKS // 10
    assert 0.0 < apart <= 10.0 * response


def test_what_was_handed_out_stays() -> None:
    """Answers and postures do not change when later ticks run."""
    _, q, pose, both = loops("panda")
    loop, _ = both[0]
    kept: list[tuple[Resolution, Array, list[Array | StateArray]]] = []
    for k in range(80):
        change(k, pose, ROBOTS["panda"][1], both)
        resolution = loop.tick(q, DT * k)
        q = loop.next_posture()
        kept.append((resolution, q, [array.copy() for array in (resolution.answer, resolution.state, q)]))
    for resolution, after, before in kept:
        for array, copy in zip((resolution.answer, resolution.state, after), before, strict=True):
            np.testing.assert_array_equal(array, copy)


def test_posture_after_a_tick_in_steps() -> None:
    """After a tick that was not resolved in one call the posture is that of its own answer."""
    robot, q, pose, both = loops("panda")
    loop, _ = both[0]
    loop.tick(q, 0.0)
    change(100, pose, ROBOTS["panda"][1], both)
    v = loop.tick(q, DT).x
    assert loop.plan.altered
    np.testing.assert_array_equal(loop.next_posture(), robot.integrate(q, v, DT))
