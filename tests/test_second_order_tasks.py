"""The scenarios of second order in tasks/: each shows what its first lines say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskopt import Scenario
from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import load_scenario

TASKS = Path(__file__).parents[1] / "tasks"


def scenario(name: str) -> Scenario:
    return load_scenario(TASKS / f"{name}.py")


def steps(of: Scenario, by: str = "active-set") -> list[Step]:
    return list(run(of, by, judged=20))


def speeds(of: list[Step]) -> Array:
    """The largest velocity of each tick."""
    return np.array([np.abs(step.v).max() for step in of])


def beyond(of: Scenario, ran: list[Step], accelerations: Array) -> float:
    """The most by which a range, a velocity limit or an acceleration limit is exceeded."""
    arm, worst = of.robot, -np.inf
    has = arm.position_index >= 0
    for step in ran:
        at = step.q_next[arm.position_index[has]]
        over = at - arm.position_upper[has], arm.position_lower[has] - at
        over = *over, np.abs(step.v) - arm.velocity_limit, np.abs(step.x) - accelerations
        worst = max(worst, *(float(each.max()) for each in over))
    return worst


@pytest.mark.slow
@pytest.mark.equation("3.104")
def test_a_posture_on_the_second_level_brings_the_arm_back() -> None:
    """After both turns the arm is where it was with a secondary objective, and is not without."""
    ends = {}
    for name in ("second_order_circle", "second_order_posture"):
        of = scenario(name)
        ran = steps(of)
        assert max(map(tracking_error, ran)) < 1e-4
        ends[name] = np.abs(ran[-1].q_next - of.start).max()
    assert ends["second_order_posture"] < 1e-2
    assert ends["second_order_circle"] > 0.05


@pytest.mark.slow
def test_the_panda_leaves_its_circle_rather_than_its_limits() -> None:
    """The stack keeps its limits to 1e-9 and comes back to the circle; the closed form breaks them."""
    of = scenario("second_order_panda")
    strongest = np.array([9.0, 4.5, 6.0, 7.5, 9.0, 12.0, 12.0])
    ran = steps(of)
    error = np.array([tracking_error(step) for step in ran])
    assert beyond(of, ran, strongest) < 1e-9
    assert 0.01 < error.max() < 0.03
    assert error[-1] < 1e-3
    assert beyond(of, steps(of, "pinv"), strongest) > 5.0


@pytest.mark.slow
def test_talos_reaches_and_its_feet_stay() -> None:
    """The hand arrives, feet move by less than 1 µm, and limits hold to 1e-9."""
    of = scenario("second_order_talos")
    ran = steps(of)
    strongest = np.concatenate([np.full(6, np.inf), np.full(of.robot.nv - 6, 6.0)])
    assert beyond(of, ran, strongest) < 1e-9
    at, end = (Configuration(of.robot, q) for q in (of.start, ran[-1].q_next))
    for foot in ("left_sole_link", "right_sole_link"):
        assert np.abs(end.pose(foot) - at.pose(foot)).max() < 1e-6
    moved = end.pose("gripper_right_base_link")[:3, 3] - at.pose("gripper_right_base_link")[:3, 3]
    assert np.abs(moved - [0.25, 0.1, 0.35]).max() < 1e-4
    assert speeds(ran).max() > 0.5


@pytest.mark.slow
def test_least_acceleration_in_the_norm_of_inertia_diverges_unless_self_motion_is_damped() -> None:
    """Without damping of self-motion the arm whips in its sixth turn, and the tip leaves its circle."""
    of = scenario("inertia_diverges")
    whipping, damped = (steps(s) for s in (of, replace(of, settings={"self-motion.gain": 5.0})))
    assert speeds(whipping)[-500:].max() > 50.0
    assert speeds(damped).max() < 5.0
    assert max(map(tracking_error, whipping[500:])) > 0.02
    assert max(map(tracking_error, damped[500:])) < 1e-3
