"""The Panda between two balls: what the first lines of its scenario say."""

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from taskopt.kinematics.configuration import Configuration
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import Scenario, load_scenario
from taskopt.resolver.registry import resolver

pytestmark = pytest.mark.slow


@cache
def scenario() -> Scenario:
    return load_scenario(Path(__file__).parents[1] / "tasks" / "panda_obstacles.py")


@cache
def steps(name: str) -> list[Step]:
    return list(run(scenario(), resolver(name)))


def least(name: str, limit: str) -> float:
    return min(float(step.distances[limit].distance.min()) for step in steps(name))


def test_no_link_comes_nearer_than_the_margin_and_the_closed_form_hits_a_ball() -> None:
    """2 cm from the balls, 1 cm from other links, at every tick; the closed form is more than 1 cm inside."""
    assert least("active-set", "obstacle") >= 0.02
    assert least("active-set", "self_collision") >= 0.01
    assert least("pinv", "obstacle") < -0.01


def test_the_hand_turns_to_slip_through_and_arrives() -> None:
    """The path is left by at most 3.5 cm and found again; the orientation gives way by over half a radian."""
    errors = [tracking_error(step) for step in steps("active-set")]
    assert max(errors) < 0.035
    assert errors[-1] < 3e-3
    assert max(np.linalg.norm(step.errors["orientation"]) for step in steps("active-set")) > 0.5


def test_several_links_are_held_off_and_every_answer_is_proven() -> None:
    """Hand, link 5, 6 and 7 are each held off for 50 ticks and more; velocity and acceleration bind, too."""
    held = Counter(active.name for step in steps("active-set") for active in step.resolution.active)
    links = {name.split(" – ")[0] for name, ticks in held.items() if ticks >= 50}
    assert {f"obstacle/panda_{link}" for link in ("hand", "link5", "link6", "link7")} <= links
    for limit in ("joint_acceleration/", "joint_acceleration (velocity)/"):
        assert any(name.startswith(limit) for name in held)
    assert all(step.resolution.kkt_met() for step in steps("active-set"))


def test_it_ends_beside_a_singularity_with_slow_joints() -> None:
    """The least singular value for the position is below 0.02; no joint is faster than 0.2 rad/s."""
    last = steps("active-set")[-1]
    J = Configuration(scenario().robot, last.q).jacobian("panda_hand")[:3]
    assert np.linalg.svd(J, compute_uv=False)[-1] < 0.02
    assert np.abs(last.v).max() < 0.2
