"""Distances of postures: few rows serve many pairs, and what the goals do not move is left as it is."""

import numpy as np
import pytest

from taskopt import (
    Array,
    Configuration,
    JointPositionLimit,
    JointTask,
    ObstacleLimit,
    PoseSolver,
    PositionTask,
    Robot,
    SelfCollisionLimit,
    Sphere,
    planar_arm,
)
from taskopt.loop.pose import clearance
from taskopt.loop.pose.stack import columns_moved
from taskopt.loop.pose.starts import drawn

ARM = planar_arm([0.5, 0.3, 0.2], lower=-3.0, upper=3.0, radius=0.02)
CENTRES = np.array([0.3 + 0.1j, 0.45 - 0.2j, 0.2 + 0.35j, 0.7 + 0.45j])
RADIUS, MARGIN = 0.05, 0.02  # [m]


def least_distance(q: Array) -> float:
    """Least distance of the lines of the three links to the centres of the spheres, by sampling [m]."""
    points = np.concatenate([[0.0], np.cumsum([0.5, 0.3, 0.2] * np.exp(1j * np.cumsum(q)))])
    along = np.linspace(0.0, 1.0, 1001)[:, None]
    links = points[:-1] * (1.0 - along) + points[1:] * along
    return float(np.abs(links.ravel()[:, None] - CENTRES).min())


def answers() -> list[Array]:
    """Postures with the tip at one point among four spheres, from twenty starts."""
    spheres = [Sphere((c.real, c.imag, 0.0), RADIUS) for c in CENTRES]
    limits = [JointPositionLimit(), ObstacleLimit(spheres, margin=MARGIN)]
    solver = PoseSolver(ARM, {"tip": (0.6, 0.15, 0.0)}, limits=limits)
    found = [solver.solve(start=start) for start in drawn(ARM, 20, 5)]
    assert all(one.solved for one in found)
    return [one.q for one in found]


@pytest.mark.parametrize("rows", [1, 3, 64])
def test_few_rows_keep_all_pairs_apart(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve pairs share one row, three, or have one each: no link is nearer than the margin."""
    monkeypatch.setattr(clearance, "ROWS", rows)
    assert min(map(least_distance, answers())) >= RADIUS + 0.02 + MARGIN - 1e-5


def test_pairs_that_are_passed_over_are_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the pairs count as moved by no goal, and some link enters a margin."""
    whole = clearance.BoundClearance.__init__

    def blind(self: clearance.BoundClearance, limit: object, name: str, moved: Array) -> None:
        whole(self, limit, name, np.zeros_like(moved))  # type: ignore[arg-type]

    monkeypatch.setattr(clearance.BoundClearance, "__init__", blind)
    assert min(map(least_distance, answers())) < RADIUS + 0.02 + MARGIN - 1e-3


def test_the_velocities_that_move_goals_are_found() -> None:
    """A point on link 2 is moved by joints 1 and 2, a named joint by itself, and the tip by all three."""
    for task, moved in (
        (PositionTask("link2"), [True, True, False]),
        (JointTask(joints=["joint2"]), [False, True, False]),
        (PositionTask("tip"), [True, True, True]),
    ):
        assert columns_moved([task], ARM).tolist() == moved
    both = columns_moved([PositionTask("link1"), JointTask(joints=["joint3"])], ARM)
    assert both.tolist() == [True, False, True]


def test_joints_that_do_not_move_the_goals_stay() -> None:
    """The fingers of a Panda stay as open as in the start, from whichever start the arm gets to its goal."""
    robot, started = Robot.load("panda"), []
    q = robot.posture("default")
    q[-2:] = 0.03
    solver = PoseSolver(robot, {"panda_hand": np.eye(4)})
    for other in drawn(robot, 30, 17):
        found = solver.solve({"panda_hand": Configuration(robot, other).pose("panda_hand")}, start=q)
        assert found.solved
        np.testing.assert_allclose(found.q[-2:], 0.03, atol=1e-9)
        started.append(found.starts)
    assert max(started) > 1  # some goals were met from a drawn posture only


@pytest.mark.slow
def test_two_hands_of_a_dual_arm_are_placed() -> None:
    """Thousands of pairs, of which fingers overlap their palms for good: the arms find their posture."""
    robot = Robot.load("tiago_dual")
    goals = {"arm_left_tool_link": (0.6, 0.3, 1.0), "arm_right_tool_link": (0.6, -0.3, 1.0)}
    limit = SelfCollisionLimit()
    solver = PoseSolver(robot, goals, limits=[JointPositionLimit(), limit])
    found = solver.solve()
    assert found.solved, found.reason
    at = Configuration(robot, found.q)
    for frame, point in goals.items():
        assert np.linalg.norm(at.pose(frame)[:3, 3] - point) <= 1e-6
    distances = limit.bind(robot, 1.0).distances
    distances.update(at)
    moved = columns_moved([PositionTask(frame) for frame in goals], robot)
    counted = (distances.collision.turn[:, moved] != 0.0).any(axis=1)
    assert counted.sum() > 1000
    assert distances.distance[counted].min() >= limit.margin - 1e-9


def test_starts_in_which_a_link_overlaps_a_sphere_wait_for_twenty_others() -> None:
    """Nearest first, as long as they are clear by the closed form; never more than twenty wait."""
    spheres = [Sphere((c.real, c.imag, 0.0), RADIUS) for c in CENTRES]
    limits = [JointPositionLimit(), ObstacleLimit(spheres, margin=MARGIN)]
    solver = PoseSolver(ARM, {"tip": (0.6, 0.15, 0.0)}, limits=limits, postures=200)
    anchor = ARM.posture("middle")
    solver._goals.aim(anchor)
    plain, ordered = list(solver._starts.nearest(200, None)), list(solver._clear_first(anchor, None))
    is_clear = [least_distance(q) >= RADIUS + 0.02 + MARGIN for q in plain]
    assert not all(is_clear[:10])
    expected, waiting = [], []
    for q, clear in zip(plain, is_clear, strict=True):
        (expected if clear else waiting).append(q)
        if len(waiting) > 20:
            expected.append(waiting.pop(0))
    assert len(expected) > 100
    np.testing.assert_array_equal(ordered, expected + waiting)
