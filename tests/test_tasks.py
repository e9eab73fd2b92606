"""The scenarios of tasks/: each runs, and each shows what its first lines say."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from taskopt import Manipulability, Stack
from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import ObstacleDistance
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import Scenario, load_scenario, scenario_files
from taskopt.resolver.closed_form import in_range, square_inverse
from taskopt.resolver.registry import resolver

ROOT = Path(__file__).parents[1]


@cache
def scenario(name: str) -> Scenario:
    return load_scenario(ROOT / "tasks" / f"{name}.py")


def steps(of: Scenario, levels: slice = slice(None), by: str = "active-set") -> list[Step]:
    """All steps with some of the levels only."""
    return list(run(replace(of, stack=replace(of.stack, levels=of.stack.levels[levels])), resolver(by)))


def path(of: list[Step]) -> Array:
    """q of every tick and the last one, (ticks + 1, nq)."""
    return np.array([*(step.q for step in of), of[-1].q_next])


def travel(of: list[Step]) -> Array:
    return np.abs(np.diff(path(of), axis=0)).sum(axis=0)


def least(function: Callable[[Configuration], float], of: Scenario, ran: list[Step]) -> float:
    return min(function(Configuration(of.robot, step.q)) for step in ran[::5])


@pytest.mark.slow
@pytest.mark.parametrize("file", scenario_files(ROOT / "tasks"), ids=lambda file: file.stem)
def test_every_scenario_runs_and_is_proven(file: Path) -> None:
    """The first 50 ms of it by the default resolver: certified on every tick."""
    made = replace(load_scenario(file), duration=0.05)
    assert all(step.resolution.kkt_met() for step in run(made, resolver("active-set")))


@pytest.mark.slow
def test_a_weighted_norm_spares_the_joint_that_weighs_more() -> None:
    """W = diag(20, 1, 1) (3.50): the first joint travels less than half of what it does with W = I (3.51)."""
    even, spared = steps(scenario("minimum_norm")), steps(scenario("weighted_norm"))
    assert travel(spared)[0] < 0.5 * travel(even)[0]
    assert max(map(tracking_error, even + spared)) < 1e-5


@pytest.mark.slow
def test_the_least_norm_is_not_cyclic() -> None:
    """After each turn of the circle the tip is back, and the arm in another posture (Fig. 3.19)."""
    q = path(steps(scenario("minimum_norm")))
    assert np.abs(q[2000] - q[0]).max() > 0.1
    assert np.abs(q[4000] - q[2000]).max() > 0.1


@pytest.mark.slow
def test_internal_motion_does_not_move_the_hand() -> None:
    """The first joint swings by ±0.7 rad, the hand stays within 2 µm."""
    ran = steps(scenario("internal_motion"))
    hand = np.array([step.actual["panda_hand"] for step in ran])
    assert np.ptp(hand[:, :3, 3], axis=0).max() < 4e-6
    assert np.ptp(path(ran)[:, 0]) > 1.39


@pytest.mark.slow
def test_climbing_manipulability_keeps_the_arm_from_its_singularity() -> None:
    """w ≥ 0.32 m² with k₀ = 10, below 0.05 m² without, on one and the same line."""
    made = scenario("manipulability")
    w = Manipulability("tip", axes="xy").value
    assert least(w, made, steps(made)) > 0.32
    assert least(w, made, steps(made, slice(1))) < 0.05


@pytest.mark.slow
def test_the_gradient_of_joint_range_keeps_the_limits_of_fig_3_20() -> None:
    """With k₀ = 250 joints 2 and 3 stay inside; with k₀ = 0 they leave by 0.26 and 0.55 rad."""
    made = scenario("joint_range")
    lower, upper = made.robot.position_lower, made.robot.position_upper
    outside = [
        np.maximum(lower - q, q - upper).max(axis=0) for q in (path(steps(made)), path(steps(made, slice(1))))
    ]
    assert outside[0].max() <= 1e-12
    np.testing.assert_allclose(outside[1][1:], [0.26, 0.55], atol=0.01)


@pytest.mark.slow
def test_damping_bounds_the_velocity_beside_the_singularity() -> None:
    """Below 4 rad/s for an error of 6 cm on the way, none at the end; undamped 20 rad/s."""
    made = scenario("damped")
    ran = steps(made)
    bare = replace(made, stack=Stack([[made.stack.levels[0][0]]]))
    assert max(np.abs(step.v).max() for step in ran) < 4.0
    assert max(np.abs(step.v).max() for step in run(bare, resolver("pinv"))) > 20.0
    assert max(map(tracking_error, ran)) < 0.07
    assert tracking_error(ran[-1]) < 1e-6


@pytest.mark.slow
def test_a_policy_damps_only_near_the_singularity() -> None:
    """As slow as with a constant k, and on its line to 0.1 mm where σ_min > 0.15, ten times nearer."""
    ran = {name: steps(scenario(name)) for name in ("damped", "damping_policy")}
    far = {
        name: max(tracking_error(s) for s in of if abs(s.t - 1.5) > 0.9 and s.t < 3.0)
        for name, of in ran.items()
    }
    assert max(np.abs(step.v).max() for step in ran["damping_policy"]) < 5.0
    assert far["damping_policy"] < 1e-4
    assert far["damped"] > 10.0 * far["damping_policy"]


@pytest.mark.slow
def test_a_square_jacobian_leaves_nothing_to_decide() -> None:
    """J⁻¹ v on every tick, which the QP agrees with to 1e-12, and the circle to 10 µm."""
    made = scenario("square_inverse")
    for step in steps(made):
        rows = step.hierarchy.level(1)
        np.testing.assert_allclose(step.v, square_inverse(rows.A, rows.upper), rtol=0.0, atol=1e-12)
        assert tracking_error(step) < 1e-5


@pytest.mark.slow
def test_at_a_singularity_the_arm_follows_across_and_stands_still_along() -> None:
    """v in R(J) is carried out; v not in it leaves q̇ = 0, one direction of two, and an error that grows."""
    made = scenario("singular")
    for step in steps(made):
        rows, review = step.hierarchy.level(1), step.resolution.review
        across = step.t < 1.5 - 1e-9
        assert in_range(rows.A, rows.upper) == across
        assert review is not None
        assert review.levels[1].rank == 1
        np.testing.assert_allclose(step.v, [0.4 * across, 0.0], atol=1e-9)
        np.testing.assert_allclose(tracking_error(step), max(0.0, 0.2 * (step.t - 1.5)), atol=2e-6)


def clearance(made: Scenario, ran: list[Step]) -> float:
    objective = next(t.objective for level in made.stack.levels for t in level if hasattr(t, "objective"))
    return least(ObstacleDistance(objective.obstacles, temperature=0.0).value, made, ran)


@pytest.mark.slow
def test_climbing_the_distance_keeps_elbows_off_the_object() -> None:
    """8 cm off at the nearest, with the line tracked as well as without; k₀ = 0 goes through it."""
    made = scenario("obstacle_distance")
    ran = steps(made)
    assert clearance(made, ran) > 0.08
    assert clearance(made, steps(made, slice(1))) < 0.0
    assert max(map(tracking_error, ran)) < 1e-5


@pytest.mark.slow
def test_with_the_obstacle_first_the_path_gives_way_and_is_found_again() -> None:
    """2 cm are kept, the tip leaves its line by more than 10 cm and ends on it; exchanged, it collides."""
    made = scenario("obstacle_first")
    ran = steps(made)
    apart = [float(np.linalg.norm(step.errors["path"])) for step in ran]
    assert clearance(made, ran) > 0.02 - 1e-4
    assert max(apart) > 0.1
    assert apart[-1] < 1e-4
    assert clearance(made, steps(made, slice(None, None, -1))) < 0.0
