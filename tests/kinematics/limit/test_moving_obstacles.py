"""Obstacles that move, and margins of single pairs."""

import copy

import numpy as np
import pytest

from taskopt import Controller, DampingTask, JointVelocityLimit, PositionTask, Robot, Stack
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.geometry.shapes import Box, HalfSpace, Sphere
from taskopt.kinematics.limit import ObstacleLimit, SelfCollisionLimit
from taskopt.kinematics.limit.bound_distance import Pair
from taskopt.kinematics.limit.moving_obstacles import Mover
from taskopt.kinematics.pose import exp3, homogeneous
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.target import Function, Latest, Line, Target
from taskopt.testing import check_limit
from tests.helpers.near import circle_clearance

LENGTHS, THICK, RADIUS = np.array([0.5, 0.4, 0.3]), 0.02, 0.1  # [m]
MARGIN, DT = 0.02, 2e-3
START = np.array([0.1, 0.2, -0.3])


def centre(t: float) -> np.ndarray:
    """A ball that comes down on the arm, with a swing, and goes up again."""
    return np.array([0.9 + 0.05 * np.sin(3.0 * t), 0.35 - 0.25 * np.sin(1.2 * t), 0.0])


def chased(target: Target | Latest, ticks: int = 1200) -> float:
    """The least distance of ball and arm in elementary geometry, at five points of every step."""
    arm = planar_arm(LENGTHS.tolist(), radius=THICK, velocity=4.0)
    ball = Sphere(centre(0.0), RADIUS, name="ball")
    limit = ObstacleLimit([ball], MARGIN, influence=0.15, gain=0.2, moving={"ball": target})
    stay = PositionTask("tip", axes="xy", gain=5.0)
    control = Controller(arm, Stack([[stay], [DampingTask()]], [JointVelocityLimit(), limit]), dt=DT)
    control.start(START)
    q, least = START, np.inf
    for k in range(ticks):
        t = k * DT
        if isinstance(target, Latest):
            target.set(centre(t), (centre(t + DT) - centre(t)) / DT)
        v = control.step(q, t).v
        for share in (0.2, 0.4, 0.6, 0.8, 1.0):
            place = centre(t) + share * (centre(t + DT) - centre(t))
            apart = circle_clearance(LENGTHS, q + share * DT * v, place[:2], RADIUS) - THICK
            least = min(least, float(apart.min()))
        q = q + DT * v
    return least


@pytest.mark.slow
@pytest.mark.parametrize("target", [Function(centre), Latest(centre(0.0))], ids=["function", "latest"])
def test_the_arm_gives_way_to_a_moving_ball(target: Target) -> None:
    """d ≥ margin at every tick and between ticks, though the ball would go through the arm."""
    assert MARGIN - 1e-9 <= chased(target) < MARGIN + 0.01


@pytest.mark.slow
def test_a_limit_that_forgets_the_motion_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the velocity of the ball in the bounds, it comes nearer than the margin."""
    monkeypatch.setattr(Mover, "drift", lambda self: np.zeros(self.pairs.size))
    assert chased(Function(centre)) < MARGIN - 1e-4


def test_the_rate_of_the_distance_is_that_of_differences() -> None:
    """n · (v + ω × (p₂ − o)) against distances measured before and after a short time, of a turning box."""
    arm, h = planar_arm(LENGTHS.tolist(), radius=THICK), 1e-6
    rng = np.random.default_rng(1)

    def pose(t: float) -> np.ndarray:
        turn = exp3(np.array([0.0, 0.0, 2.0]) * t + np.array([0.3, -0.2, 0.4]))
        return homogeneous(turn, np.array([0.8, 0.5, 0.02]) + t * np.array([0.3, -0.4, 0.1]))

    limit = ObstacleLimit([Box(pose(0.0), [0.2, 0.1, 0.3])], moving={"box": Function(pose)}, influence=2.0)
    plan = Stack([[DampingTask()]], [limit]).compile(arm, h)
    for _ in range(5):
        q = START + 0.1 * rng.normal(size=3)
        apart = []
        for t in (0.2 - h, 0.2, 0.2 + h):
            plan.at(q, t)
            apart.append(plan.limits[0].distances.distance.copy())  # type: ignore[union-attr]
            if t == 0.2:
                drift = plan.limits[0].known[Pair.DRIFT].copy()  # type: ignore[union-attr]
        np.testing.assert_allclose((apart[2] - apart[0]) / (2.0 * h), drift, atol=1e-4)
        assert np.abs(drift).max() > 0.1


def test_what_cannot_move_is_refused() -> None:
    """An obstacle that is not there, a half-space that turns, and a target that is no number."""
    arm, ball = planar_arm(LENGTHS.tolist(), radius=THICK), Sphere([2.0, 0.0, 0.0], 0.1, name="ball")
    with pytest.raises(UnknownName, match=r"no obstacle named 'bal'.*did you mean ball"):
        ObstacleLimit([ball], moving={"bal": Latest()})

    def turning(t: float) -> np.ndarray:
        return homogeneous(exp3(np.array([t, 0.0, 0.0])), np.array([0.0, 0.0, -1.0]))

    floor = ObstacleLimit([HalfSpace([0, 0, 1], -1.0)], moving={"half-space": Function(turning)})
    with pytest.raises(InvalidValue, match="is a half-space and must not turn"):
        Stack([[DampingTask()]], [floor]).compile(arm, DT).at(START, 1.0)
    lost = ObstacleLimit([ball], moving={"ball": Function(lambda t: np.full((4, 4), np.nan))})
    with pytest.raises(InvalidValue, match="ball has NaN"):
        Stack([[DampingTask()]], [lost]).compile(arm, DT).at(START, 1.0)


def test_an_obstacle_that_a_stack_renames_still_moves() -> None:
    """Two limits may each have a ball of the same name; the one with the target moves."""
    arm = planar_arm(LENGTHS.tolist(), radius=THICK)
    still = ObstacleLimit([Sphere([2.0, 0.0, 0.0], 0.1)], name="still")
    goes = ObstacleLimit([Sphere([0.0, 2.0, 0.0], 0.1)], name="goes", moving={"sphere": Function(centre)})
    plan = Stack([[DampingTask()]], [still, goes]).compile(arm, DT)
    plan.at(START, 0.0)
    expected = circle_clearance(LENGTHS, START, centre(0.0)[:2], 0.1) - THICK
    np.testing.assert_allclose(plan.distance_limits["goes"].distances.distance, expected, atol=1e-9)


BALL = Sphere([0.9, 0.6, 0.0], RADIUS, name="ball")
PASSED = [0.9, 0.2, 0.0]  # where a ball is nearer to the arm


def loop(target: Target | None) -> Controller:
    """A loop of the planar arm, whose ball follows a target."""
    arm = planar_arm(LENGTHS.tolist(), radius=THICK)
    limit = ObstacleLimit([BALL], MARGIN, influence=0.15, moving={"ball": target})
    return Controller(arm, Stack([[DampingTask()]], [limit]), dt=DT)


def seen(control: Controller, t: float) -> np.ndarray:
    """The middle of the ball after a step, which the measured distances must agree with."""
    control.step(START, t)
    place = control.plan.moving["ball"][:3, 3]
    expected = circle_clearance(LENGTHS, START, place[:2], RADIUS) - THICK
    np.testing.assert_allclose(
        control.plan.distance_limits["obstacle"].distances.distance, expected, atol=1e-9
    )
    return place.copy()


def test_the_motion_of_an_obstacle_begins_when_the_loop_starts() -> None:
    """A line of 2 s that starts at 5 s is half-way at 6 s, after a second start at 9 s again at 10 s."""
    control = loop(Line(by=[0.2, 0.0, 0.0], duration=2.0))
    for begin in (5.0, 9.0):
        control.start(START, begin)
        for after, way in ((0.0, 0.0), (1.0, 0.1), (2.0, 0.2), (3.0, 0.2)):
            np.testing.assert_allclose(
                seen(control, begin + after), BALL.centre + np.array([way, 0, 0]), atol=1e-9
            )


def test_the_pose_of_an_obstacle_is_a_parameter() -> None:
    """Set to a pose it is there at the next tick, over a time it is on its way, by a target it follows."""
    control = loop(None)
    np.testing.assert_allclose(seen(control, 0.0), BALL.centre)
    control.set({"obstacle.ball.pose": PASSED})
    np.testing.assert_allclose(seen(control, 0.1), PASSED)
    np.testing.assert_allclose(np.asarray(control.parameters["obstacle.ball.pose"])[:3, 3], PASSED)
    control.set({"obstacle.ball.pose": BALL.centre}, over=2.0)
    seen(control, 1.0)
    np.testing.assert_allclose(seen(control, 2.0), 0.5 * (np.array(PASSED) + BALL.centre), atol=1e-9)
    np.testing.assert_allclose(seen(control, 3.5), BALL.centre, atol=1e-9)
    control.set({"obstacle.ball.pose": Function(centre)})
    np.testing.assert_allclose(seen(control, 4.0), centre(4.0))
    control.start(START, 5.0)
    np.testing.assert_allclose(seen(control, 5.0), BALL.centre)


def test_a_copy_keeps_the_pose_of_an_obstacle() -> None:
    """One that was set, and one that moves as declared; one that follows a later target is not copied."""
    control = loop(None)
    seen(control, 0.0)
    control.set({"obstacle.ball.pose": PASSED})
    seen(control, 0.1)
    np.testing.assert_allclose(seen(copy.deepcopy(control), 0.2), PASSED)
    moves = loop(Line(by=[0.2, 0.0, 0.0], duration=2.0))
    moves.start(START, 5.0)
    seen(moves, 5.5)
    np.testing.assert_allclose(seen(copy.deepcopy(moves), 6.0), seen(moves, 6.0))
    control.set({"obstacle.ball.pose": Line(to=BALL.centre, duration=1.0)})
    seen(control, 0.3)
    with pytest.raises(InvalidValue, match="the target of 'ball' was replaced by one that moves"):
        copy.deepcopy(control)


def test_what_is_no_pose_of_an_obstacle_is_refused_when_it_is_set() -> None:
    """A matrix that is no rotation, a number that is not finite, and an obstacle that does not move."""
    control = loop(None)
    for wrong in (2.0 * np.eye(4), [0.0, 0.0, np.nan]):
        with pytest.raises(InvalidValue, match="the pose of ball"):
            control.set({"obstacle.ball.pose": wrong})
    still = ObstacleLimit([BALL])
    with pytest.raises(UnknownName, match=r"obstacle\.ball\.pose"):
        Controller(control.plan.robot, Stack([[DampingTask()]], [still])).set({"obstacle.ball.pose": PASSED})


def test_pairs_can_have_margins_of_their_own() -> None:
    """By one name or two, the last that fits; each pair brakes as far before its own margin."""
    panda = Robot.load("panda")
    given = {"panda_hand": 0.03, ("panda_hand", "panda_link0"): 0.05}
    bound = SelfCollisionLimit(0.01, influence=0.05, margins=given).bind(panda, DT)
    found = dict(zip(bound.pair_names, bound.margins, strict=True))
    assert found["panda_link0 – panda_hand"] == 0.05
    assert found["panda_link1 – panda_hand"] == 0.03
    assert found["panda_link0 – panda_link5"] == 0.01
    np.testing.assert_allclose(bound.known[Pair.INFLUENCE] - bound.margins, 0.04)
    with pytest.raises(UnknownName, match="no link or obstacle named 'panda_elbow'"):
        SelfCollisionLimit(margins={"panda_elbow": 0.1}).bind(panda, DT)
    with pytest.raises(InvalidValue, match="margin of panda_hand must be ≥ 0"):
        SelfCollisionLimit(margins={"panda_hand": -0.1}).bind(panda, DT)


@pytest.mark.slow
@pytest.mark.parametrize("rows", [1, 64])
def test_a_margin_of_one_pair_is_kept(rows: int) -> None:
    """The tip stays 6 cm away from one ball and 2 cm away from the other."""
    arm = planar_arm(LENGTHS.tolist(), radius=THICK, velocity=2.0)
    balls = [Sphere([0.9, y, 0.0], RADIUS, name=name) for name, y in (("upper", 0.4), ("lower", -0.4))]
    limit = ObstacleLimit(balls, 0.02, influence=0.1, margins={"upper": 0.06}, rows=rows)
    check_limit(limit, arm)
    for y, least in ((0.5, 0.06), (-0.5, 0.02)):
        task = PositionTask("tip", target=[0.9, y, 0.0], axes="xy", gain=3.0)
        control = Controller(arm, Stack([[task]], [JointVelocityLimit(), limit]), dt=DT)
        q, seen = np.array([0.3, -0.7, 0.9]), []
        for k in range(1500):
            q = q + DT * control.step(q, k * DT).v
            seen.append(circle_clearance(LENGTHS, q, np.array([0.9, np.sign(y) * 0.4]), RADIUS).min() - THICK)
        assert least - 1e-6 <= min(seen) < least + 0.02
