"""The acceptance of `solve_pose`: a seeded sample of it, and its verdict."""

import numpy as np
import pytest
from solve_pose import EXACT, NAMES, Judge, Outcome, arm, ours, reachable

from taskopt import Configuration

SAMPLE = 25  # poses of each arm


@pytest.mark.slow
@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_a_sample_of_reachable_poses_is_met(name: str, apart: bool) -> None:
    """Each of 25 poses to 1e-6 m and 1e-6 rad, within the joint limits, and with links apart where asked."""
    assert ours(name, SAMPLE, apart=apart).solved.all()


def test_the_judge_sees_planted_faults() -> None:
    """A joint that is off by 2e-5 rad, a joint beyond its limit by a turn, and a pose of another posture."""
    robot, frame = arm("xarm7")
    judge = Judge(robot, frame)
    q = np.array([0.3, 0.4, -0.5, 0.9, 0.2, 0.8, 0.1])
    at = reachable(robot, frame, 1)[0]
    target = Configuration(robot, q).pose(frame)
    assert judge.met(q, target)
    assert not judge.met(q + 20.0 * EXACT, target)
    assert not judge.met(q + 2.0 * np.pi * np.eye(7)[0], target)
    assert not judge.met(q, at)


def test_an_arm_passes_with_few_misses_and_short_times_only() -> None:
    """995 of 1,000 in 50 ms each pass; one miss more, or one slow pose more, does not."""
    solved, times = np.arange(1000) >= 5, np.full(1000, 1.0)
    assert Outcome("arm", "taskopt", solved, times).accepted
    assert not Outcome("arm", "taskopt", np.arange(1000) >= 6, times).accepted
    assert not Outcome("arm", "taskopt", solved, times + 60.0 * (np.arange(1000) == 7)).accepted
