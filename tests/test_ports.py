"""The ports of examples of pink and mink: proven at every tick, inside their limits, and at their targets."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ports import PAGE, code_lines, counted, listed

from taskopt import (
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    ObstacleLimit,
    SelfCollisionLimit,
    Stack,
    planar_arm,
)
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import Scenario, load_scenario, scenario_files
from taskopt.resolver.registry import resolver

PORTS = {file.stem: file for file in scenario_files(Path(__file__).parents[1] / "tasks" / "ports")}
UNTRACKED = {"pink_arm_z1_joint_velocity_tracking"}  # has no target that could be reached
COMPROMISE = {  # [m], where weights, an obstacle or a higher level keep the first task from its target
    "mink_arm_aloha": 0.15,
    "mink_arm_hand_iiwa_allegro": 0.05,
    "mink_arm_hand_xarm_leap": 0.05,
    "mink_arm_iiwa": 0.08,
    "mink_arm_panda_dof_freezing": 0.01,
    "mink_arm_ur5e": 0.3,
    "pink_mobile_stretch": 0.3,
    "pink_barriers_go2_squat": 0.11,
    "pink_barriers_arm_ur5": 0.11,
}
POSITION, VELOCITY = (
    (JointPositionLimit, JointAccelerationLimit),
    (JointVelocityLimit, JointAccelerationLimit),
)


@cache
def scenario(name: str) -> Scenario:
    return load_scenario(PORTS[name])


def steps(made: Scenario) -> list[Step]:
    return list(run(made, resolver("active-set")))


def faults(made: Scenario, ran: list[Step]) -> list[str]:
    """Ticks that are not proven, and limits of the stack that are left."""
    found = [f"not proven at {step.t:g} s" for step in ran if not step.resolution.kkt_met()]
    limits = made.stack.limits
    if any(isinstance(limit, POSITION) for limit in limits):
        found += [text for step in ran for text in made.robot.outside(step.q_next)]
    if any(isinstance(limit, VELOCITY) for limit in limits):
        allowed = made.robot.velocity_limit * (1.0 + 1e-9)
        found += [f"too fast at {step.t:g} s" for step in ran if (np.abs(step.v) > allowed).any()]
    for limit in limits:  # distances of meshes are measured to about 1e-8 m
        if isinstance(limit, ObstacleLimit | SelfCollisionLimit):
            near = [step for step in ran if step.distances[limit.name].distance.min() < limit.margin - 1e-6]
            found += [f"{limit.name} too near at {step.t:g} s" for step in near]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", PORTS)
def test_the_first_ticks_are_proven_and_lead_towards_the_target(name: str) -> None:
    """20 ticks: certified and inside the limits; an error above 1 cm shrinks, a smaller one stays below."""
    made = scenario(name)
    ran = steps(replace(made, duration=min(20 * made.dt, made.duration)))
    assert faults(made, ran) == []
    if name not in UNTRACKED | set(COMPROMISE):
        assert tracking_error(ran[-1]) < max(0.01, tracking_error(ran[0]))


@pytest.mark.slow
@pytest.mark.parametrize("name", PORTS)
def test_the_whole_run_is_proven_and_ends_nearer_to_the_target(name: str) -> None:
    """All ticks: certified and inside the limits; the error ends smaller than it began, or below 1 cm."""
    made = scenario(name)
    ran = steps(made)
    assert faults(made, ran) == []
    if name not in UNTRACKED:
        assert tracking_error(ran[-1]) < max(COMPROMISE.get(name, 0.01), tracking_error(ran[0]))


def test_a_run_that_leaves_its_limits_is_caught() -> None:
    """The pseudo-inverse knows no limits: the joint passes its range and its speed, and both are said."""
    arm = planar_arm([0.5], lower=-0.1, upper=0.1, velocity=0.5)
    made = Scenario(
        robot=arm,
        q0=[0.0],
        stack=Stack([[JointTask([0.3], gain=50.0)]], [JointPositionLimit(), JointVelocityLimit()]),
        duration=0.1,
        dt=1e-2,
    )
    found = faults(made, list(run(made, resolver("pinv"))))
    assert any("joint1" in text for text in found)
    assert any("too fast" in text for text in found)
    assert faults(made, steps(made)) == []


@pytest.mark.slow
def test_a_run_that_meets_an_obstacle_is_caught() -> None:
    """The pseudo-inverse knows no obstacles: the flange passes the floor, which is said."""
    made = replace(scenario("mink_arm_ur5e"), duration=1.5)
    assert any("obstacle too near" in text for text in faults(made, list(run(made, resolver("pinv")))))


def test_the_page_lists_every_port_with_its_lines() -> None:
    """docs/ports.md has one row for each file, with the lines that `benchmarks/ports.py` counts."""
    assert listed(PAGE.read_text(encoding="utf-8")) == counted()


def test_lines_of_code_are_counted_without_blanks_comments_and_docstrings() -> None:
    """Seven lines of which three hold code; a text that is no docstring counts."""
    assert code_lines('"""Two\nlines."""\n\n# a comment\nx = 1  # another\ny = """a\nb"""\n') == 3
