"""Verdicts: what is claimed of limits and of reach has its evidence, and the names are those that matter."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from taskopt import (
    Array,
    Configuration,
    JointPositionLimit,
    PoseSolver,
    Robot,
    Verdict,
    planar_arm,
    solve_pose,
)
from taskopt.loop.pose.solution import GoalError
from taskopt.loop.pose.starts import drawn
from taskopt.loop.pose.verdict import CONFIRMED, Evidence, judge, same_ends

LACKS = {"tip": GoalError(0.25, 0.0, 0.0), "other": GoalError(0.0, 0.0, 0.0)}
BLOCKED = Evidence(100, CONFIRMED, LACKS, ("a upper", "b lower", "c lower"), True)
MARGIN, RELAXED = 1.0, 0.97  # [rad]


class Held(NamedTuple):
    """A pose that limits keep out of reach, and what was found for it."""

    target: Array
    error: float
    q: Array
    limits: tuple[str, ...]


def test_each_claim_needs_its_evidence() -> None:
    """Limits are blamed where enough ends agree and freedom helps; else it is reach, or too few ends."""
    assert judge(BLOCKED)[0] is Verdict.LIMIT
    assert judge(BLOCKED._replace(free=False))[0] is Verdict.UNREACHABLE
    assert judge(BLOCKED._replace(limits=(), free=False))[0] is Verdict.UNREACHABLE
    for known in (BLOCKED, BLOCKED._replace(free=False), BLOCKED._replace(limits=())):
        assert judge(known._replace(ends=CONFIRMED - 1))[0] is Verdict.LOCAL_MINIMUM


def test_the_reason_has_names_and_numbers() -> None:
    """Limits, starts and what lacks; goals that are met are not spoken of."""
    says = judge(BLOCKED)[1]
    assert "a upper, b lower and c lower are in the way" in says
    assert "3 of 100 starts" in says
    assert "0.25 m of 'tip'" in says
    assert "other" not in says
    assert "c lower is in the way" in judge(BLOCKED._replace(limits=("c lower",)))[1]
    assert "held by a upper, b lower and c lower" in judge(BLOCKED._replace(free=False))[1]
    assert "more starts" in judge(BLOCKED._replace(ends=1))[1]


def test_ends_agree_within_a_hundredth() -> None:
    """The least one counts; an end that is farther by more than 1 % of its merit does not."""
    assert same_ends([2.0, 1.0, 1.009, 1.02]) == 2
    assert same_ends([5.0]) == 1


@pytest.mark.parametrize("starts", [1, 2])
def test_few_starts_claim_nothing_of_limits(starts: int) -> None:
    """Poses that are reachable: one or two starts that end at a limit are no proof that it is in the way."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    at, solver, missed = Configuration(robot, robot.neutral), None, 0
    for q in drawn(robot, 40, 91):
        at.update(q)
        target = at.pose("panda_hand")
        solver = solver or PoseSolver(robot, {"panda_hand": target})
        found = solver.solve({"panda_hand": target}, starts=starts)
        missed += not found.solved
        assert found.verdict in (Verdict.SOLVED, Verdict.LOCAL_MINIMUM)
        assert found.limits == ()
    assert missed  # else the test could not fail


def held_poses(robot: Robot, count: int) -> list[Held]:
    """Poses of a Panda that margins of 1 rad keep out of reach."""
    at, found = Configuration(robot, robot.neutral), []
    solver = PoseSolver(
        robot, {"panda_hand": np.eye(4)}, limits=[JointPositionLimit(margin=MARGIN)], postures=200
    )
    for q in drawn(robot, 30, 93):
        at.update(q)
        answer = solver.solve({"panda_hand": at.pose("panda_hand")}, starts=30)
        if answer.verdict is Verdict.LIMIT and len(found) < count:
            error = float(np.hypot(*answer.errors["panda_hand"][:2]))
            found.append(Held(at.pose("panda_hand"), error, answer.q, answer.limits))
    return found


def gain_of_each_joint(robot: Robot, held: Held) -> dict[str, float]:
    """By how much the least error falls where the margin of one joint alone is relaxed by 0.03 rad."""
    gains = {}
    for joint in robot.joints:
        margins = dict.fromkeys(robot.joints, MARGIN) | {joint: RELAXED}
        solver = PoseSolver(robot, {"panda_hand": held.target}, limits=[JointPositionLimit(margin=margins)])
        found = solver.solve(start=held.q, starts=1)
        gains[joint] = held.error - float(np.hypot(*found.errors["panda_hand"][:2]))
    return gains


@pytest.mark.slow
def test_the_limits_named_are_those_whose_relaxation_helps() -> None:
    """Relaxing a joint that is named lowers the least error; relaxing any other one changes nothing."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    poses = held_poses(robot, 3)
    assert len(poses) == 3
    for held in poses:
        named = {name.split("/")[1].split()[0] for name in held.limits}
        gains = gain_of_each_joint(robot, held)
        assert {joint for joint, gain in gains.items() if gain > 1e-5} == named
        assert max(abs(gains[joint]) for joint in gains if joint not in named) < 1e-6


def test_a_solution_has_its_verdict() -> None:
    """`solved` is the verdict SOLVED and no other."""
    found = solve_pose(planar_arm([0.5, 0.3]), {"tip": (0.4, 0.3, 0.0)})
    assert found.solved
    assert not any(replace(found, verdict=other).solved for other in Verdict if other is not Verdict.SOLVED)
