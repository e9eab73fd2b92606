"""The scenarios of strict hierarchies do what their first lines say."""

from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from taskopt import (
    Configuration,
    JointAccelerationLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Stack,
)
from taskopt.errors import Infeasible
from taskopt.hierarchy.status import Status
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.kinematics.task import During
from taskopt.kinematics.task.transition import largest_jump
from taskopt.loop.run import Step, run
from taskopt.loop.scenario import Scenario, load_scenario
from taskopt.resolver.active_set.resolver import ActiveSet

TASKS = Path(__file__).parents[1] / "tasks"


@cache
def scenario(name: str) -> Scenario:
    return load_scenario(TASKS / f"{name}.py")


@cache
def steps(name: str) -> tuple[Step, ...]:
    """All steps of a scenario, resolved strictly."""
    return tuple(run(scenario(name), ActiveSet()))


def lack(step: Step, task: str) -> float:
    return float(np.abs(step.resolution.residuals[task]).max())


@pytest.mark.slow
def test_four_levels_are_kept_in_their_order_with_two_inequalities_in_the_middle() -> None:
    """The first hand never suffers once it moves, box and cone hold, the third level yields."""
    taken = [step for step in steps("tiago_four_levels") if step.t > 0.7]
    assert max(lack(step, "arm_left_tool_link position") for step in taken) < 1e-9
    assert max(lack(step, "arm_right_tool_link in box") for step in taken) < 1e-9
    assert max(lack(step, "head_2_link gaze") for step in taken) < 1e-9
    yielding = sum(lack(step, "right hand's circle") > 1e-3 for step in taken)
    assert 0.2 < yielding / len(taken) < 0.9
    at = Configuration(scenario("tiago_four_levels").robot, taken[-1].q)
    for step in taken[::100]:
        at.update(step.q)
        p = at.pose("arm_right_tool_link")[:3, 3]
        assert (p >= np.array([0.25, -0.86, 0.66]) - 1e-4).all()
        assert (p <= np.array([0.47, -0.65, 0.86]) + 1e-4).all()


@pytest.mark.slow
def test_the_conflict_is_named_and_braked_without_contact() -> None:
    """Raised, it names acceleration and obstacle; braked, the arm stops short of the ball."""
    declared = scenario("planar_conflict")
    statuses = Counter(step.resolution.status for step in steps("planar_conflict"))
    assert set(statuses) == {Status.SOLVED, Status.BRAKED}
    obstacle = next(limit for limit in declared.stack.limits if isinstance(limit, ObstacleLimit))
    distances = obstacle.bind(declared.robot, declared.dt).distances
    at = Configuration(declared.robot, declared.start)
    for step in steps("planar_conflict"):
        at.update(step.q_next)
        distances.update(at)
        assert distances.distance.min() > 0.02
    with pytest.raises(
        Infeasible, match=r"exclude each other: joint_acceleration/.*obstacle/link3"
    ) as caught:
        list(run(replace(declared, on_conflict="raise"), ActiveSet()))
    assert "least relaxation" in str(caught.value)


@pytest.mark.slow
def test_relaxing_the_conflict_goes_on_with_an_optimum() -> None:
    """The third policy: every tick has an answer, and those that gave way say so."""
    taken = list(run(replace(scenario("planar_conflict"), on_conflict="relax"), ActiveSet()))
    given_way = [step.resolution for step in taken if step.resolution.status is Status.RELAXED]
    assert given_way
    assert all("obstacle/link3" in resolution.notes[0] for resolution in given_way)


@pytest.mark.slow
def test_switched_tasks_jump_and_blended_ones_do_not() -> None:
    """Without its limit on accelerations, and without blending, the scenario jumps ten times as much."""
    declared = scenario("panda_switch")
    free = replace(declared, stack=Stack(declared.stack.levels, [JointPositionLimit(), JointVelocityLimit()]))
    levels = [
        [replace(task, blend=0.0) if isinstance(task, During) else task for task in level]
        for level in declared.stack.levels
    ]
    switched = replace(free, stack=Stack(levels, free.stack.limits))
    jumps = [largest_jump(np.array([step.v for step in run(of, ActiveSet())])) for of in (free, switched)]
    assert jumps[1] > 1.0
    assert jumps[0] < 0.1 * jumps[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["panda_circle", "panda_switch", "panda_obstacles", "internal_motion", "square_inverse"]
)
def test_a_real_arm_keeps_the_accelerations_of_its_maker(name: str) -> None:
    """From rest on no joint changes its velocity by more than a Δt in a tick."""
    declared = scenario(name)
    (limit,) = (limit for limit in declared.stack.limits if isinstance(limit, JointAccelerationLimit))
    allowed = declared.dt * np.asarray(limit.acceleration)
    v = np.array([np.zeros(declared.robot.nv), *(step.v for step in steps(name))])
    assert (np.abs(np.diff(v, axis=0)) <= allowed + 1e-9).all()
    assert {step.resolution.status for step in steps(name)} == {Status.SOLVED}


@pytest.mark.slow
def test_at_full_speed_every_joint_stops_at_the_end_of_its_range() -> None:
    """Position, velocity and acceleration hold at every tick, and each of them is what binds at some."""
    declared = scenario("panda_full_speed")
    robot, allowed = declared.robot, np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
    v = np.zeros(7)
    for step in steps("panda_full_speed"):
        assert robot.outside(step.q_next, tolerance=1e-9) == ()
        assert (np.abs(step.v) <= robot.velocity_limit + 1e-9).all()
        assert (np.abs(step.v - v) <= allowed * declared.dt + 1e-9).all()
        v = step.v
    owners = {
        active.name.split("/")[0] for step in steps("panda_full_speed") for active in step.resolution.active
    }
    assert owners == {"joint_acceleration", "joint_acceleration (position)", "joint_acceleration (velocity)"}
    at_end = next(step for step in steps("panda_full_speed") if step.t >= 1.99)
    end = np.where([1, 0, 1, 0, 1, 0, 1], robot.position_upper, robot.position_lower)
    np.testing.assert_allclose(at_end.q, end, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tiago_four_levels", "planar_conflict", "panda_switch", "panda_full_speed"])
def test_every_optimum_is_proven(name: str) -> None:
    """Certified to 1e-8 on every tick that claims one; failures would be below one in a thousand."""
    claimed = [step.resolution for step in steps(name) if step.resolution.claimed]
    assert all(resolution.kkt_met() for resolution in claimed)
    unfinished = sum(step.resolution.status is Status.ITERATION_LIMIT for step in steps(name))
    assert unfinished <= 1e-3 * len(steps(name))
