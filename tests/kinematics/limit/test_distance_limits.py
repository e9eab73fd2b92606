"""Obstacle and self-collision limits: zero is always allowed, and no step, however bad, breaks the margin."""

import numpy as np
import pytest
from scipy.optimize import linprog

from taskopt import DampingTask, PositionTask, Robot, Stack
from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import HalfSpace, Sphere
from taskopt.kinematics.limit import (
    BoundLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    ObstacleLimit,
    RowLimit,
    SelfCollisionLimit,
)
from taskopt.kinematics.robot import DHRow, planar_arm
from taskopt.kinematics.robot.random_posture import random_posture
from taskopt.resolver.registry import resolve
from tests.helpers.near import SOLIDS, beside
from tests.helpers.robots import robot

MARGIN = 0.01
PERIODS = (1e-3, 5e-3, 2e-2)  # [s]


def filled(bound, at):
    """Rows and bounds (4, nv) of a limit at a configuration, as a plan has them."""
    m, nv = len(bound.row_names), at.robot.nv
    rows = LevelRows(np.zeros((m, nv)), np.empty(m), np.empty(m), np.ones(m))
    bound.prepare(rows)
    bound.fill(at, 0.0, rows)
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], nv, axis=1)
    bound.narrow(at, bounds, 1)
    return rows, bounds


def beside_obstacle(name, dt, rng):
    """A configuration at least MARGIN away from a random obstacle near a link, and the limit that says so."""
    while True:
        at, place = beside(robot(name), rng, scatter=0.15)
        solid = SOLIDS[list(SOLIDS)[rng.integers(0, 4)]](place)
        limit = ObstacleLimit([solid], MARGIN, influence=0.1, gain=float(rng.choice([0.1, 1.0])))
        bound = limit.bind(at.robot, dt)
        filled(bound, at)
        if bound.distances.distance.min() >= MARGIN:
            return at, bound


def beside_itself(name, dt, rng):
    """Likewise, an arm folded so that two of its links are near each other."""
    bound = SelfCollisionLimit(MARGIN, influence=0.1, gain=1.0).bind(robot(name), dt)
    while True:
        at = Configuration(robot(name), random_posture(robot(name), rng))
        filled(bound, at)
        if MARGIN <= bound.distances.distance.min() < 0.05:
            return at, bound


def worst_velocity(rows, bounds, direction):
    """The corner of all that is allowed which lies farthest along −direction."""
    on = np.isfinite(rows.lower)
    found = linprog(
        direction,
        A_ub=-rows.A[on] if on.any() else None,
        b_ub=-rows.lower[on] if on.any() else None,
        bounds=bounds.T,
    )
    assert found.status == 0, found.message
    return found.x


def attacked(start, bound, rng, ticks, honest=True):
    """Distances of a run that steps into the nearest thing, or past it, at the corner of what is allowed.

    Half of the steps keep the robot's speed limits too. `honest=False` drops the limit's own
    bounds on speed, so that its rows stand alone.
    """
    at, of, dt, out = start, start.robot, bound.dt, []
    for _ in range(ticks):
        rows, bounds = filled(bound, at)
        known = bound.distances.distance.copy()
        toward = bound.distances.gradient[known.argmin()] * rng.choice([0.0, 1.0, 3.0])
        box = bounds[:2] if honest else np.stack([-bound.speeds, bound.speeds])
        if rng.random() < 0.5:
            box = np.stack([np.maximum(box[0], -bound.speeds), np.minimum(box[1], bound.speeds)])
        v = worst_velocity(rows, box, toward + 0.3 * rng.normal(size=of.nv))
        guess = known + dt * bound.distances.gradient @ v
        at = Configuration(of, of.integrate(at.q, v, dt))
        filled(bound, at)
        out.append((bound.distances.distance.min(), guess, bound.distances.distance.copy(), known, v))
    return out


@pytest.mark.slow
@pytest.mark.parametrize("dt", PERIODS)
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("planar3", beside_obstacle),
        ("crane", beside_obstacle),
        ("panda", beside_obstacle),
        ("panda", beside_itself),
    ],
)
def test_no_run_of_extreme_steps_breaks_the_margin(name, kind, dt):
    """d ≥ margin to 1e-9 m on every pair after every tick, of 2,000 and more in all; sliding included."""
    rng, seen = np.random.default_rng(int(dt * 1e4)), []
    for _ in range(8):
        start, bound = kind(name, dt, rng)
        seen += [tick[0] for tick in attacked(start, bound, rng, 30)]
    assert len(seen) == 240
    assert min(seen) >= MARGIN - 1e-9
    assert min(seen) < MARGIN + 0.03


@pytest.mark.slow
def test_rows_without_the_bounds_on_speed_are_caught():
    """The check above sees that linearised rows alone break the margin in long steps."""
    rng, seen = np.random.default_rng(5), []
    for _ in range(8):
        start, bound = beside_obstacle("planar3", 2e-2, rng)
        seen += [tick[0] for tick in attacked(start, bound, rng, 30, honest=False)]
    assert min(seen) < MARGIN - 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("dt", PERIODS)
def test_a_step_loses_no_more_than_the_limit_states(dt):
    """What d + Δt ∇d·v overstates is at most s jump + s² bend, and sometimes half of it."""
    rng, ratios = np.random.default_rng(7), [0.0]
    for _ in range(12):
        start, bound = beside_obstacle("planar3", dt, rng)
        for _, guess, got, known, v in attacked(start, bound, rng, 20):
            s = np.abs(v / bound.speeds).max()
            near = (known < bound.influence) & (got > 0.0)
            ratios += ((guess - got)[near] / (s * bound.jump + s * s * bound.bend + 1e-12)[near]).tolist()
    assert 0.3 < max(ratios) <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("dt", PERIODS)
@pytest.mark.parametrize("name", ["planar3", "panda", "talos_reduced"])
def test_standing_still_is_always_allowed(name, dt):
    """v = 0 keeps all rows and bounds, outside, inside the margin, and deep in the obstacle."""
    rng, deepest = np.random.default_rng(1), 1.0
    for _ in range(5):
        at, place = beside(robot(name), rng, scatter=0.05)
        bound = ObstacleLimit([SOLIDS["sphere"](place), SOLIDS["box"](place)]).bind(at.robot, dt)
        rows, bounds = filled(bound, at)
        deepest = min(deepest, bound.distances.distance.min())
        assert (rows.lower <= 0.0).all()
        assert (rows.upper == np.inf).all()
        assert (bounds[0] <= 0.0).all()
        assert (bounds[1] >= 0.0).all()
        assert np.isfinite(rows.A).all()
    assert deepest < 0.0


@pytest.mark.parametrize("depth", [-0.05, 0.0, 0.02])
def test_a_link_inside_the_margin_leaves(depth):
    """From inside the obstacle, at its surface, and at the margin itself, a task that leads out gets out."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02, velocity=2.0)
    obstacle = Sphere([0.95, 0.12 + depth, 0.0], 0.1)
    down = PositionTask("tip", target=[1.0, -0.3, 0.0], gain=5.0, axes="xy")
    stack = Stack(levels=[[down]], limits=[JointVelocityLimit(), ObstacleLimit([obstacle], margin=0.02)])
    plan, q, seen = stack.compile(arm, 1e-3), np.array([0.0, 0.0, 0.0]), []
    bound = ObstacleLimit([obstacle], margin=0.02).bind(arm, 1e-3)
    for i in range(400):
        v = resolve(plan.at(q, 1e-3 * i)).v
        assert np.abs(v).max() <= 2.0 + 1e-9
        q = arm.integrate(q, v, 1e-3)
        filled(bound, Configuration(arm, q))
        seen.append(bound.distances.distance.min())
    assert min(seen) >= min(depth, 0.02) - 1e-5
    assert seen[-1] > 0.03


def test_a_pair_beyond_the_influence_asks_for_nothing():
    """Its row is empty and unbounded, so that it costs no solver anything."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    bound = ObstacleLimit([Sphere([5.0, 0.0, 0.0], 0.1)]).bind(arm, 1e-3)
    rows, bounds = filled(bound, Configuration(arm, [0.1, 0.2, 0.3]))
    assert not rows.A.any()
    assert np.isneginf(rows.lower).all()
    assert (bounds[1] > 100.0).all()


def test_the_damper_is_that_of_the_paper():
    """Within the influence ḋ ≥ −κ (d − d_s)/Δt, d_s = margin + reserve; a gain of 1 lands on d_s."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    at = Configuration(arm, [0.0, 0.0, 0.0])
    bound = ObstacleLimit([Sphere([0.95, 0.17, 0.0], 0.1)], margin=0.01, gain=1.0).bind(arm, 1e-3)
    rows, _ = filled(bound, at)
    assert bound.distances.distance[2] == pytest.approx(0.05, abs=1e-12)
    np.testing.assert_allclose(rows.A[2], [-0.95, -0.45, -0.15], atol=1e-9)
    assert rows.lower[2] == pytest.approx(-(0.05 - 0.01 - bound.reserve[2]) / 1e-3)
    assert bound.row_names[2] == "link3 – sphere"
    assert bound.row_units == ("m/s",) * 3


def test_distance_limits_are_rows_and_bounds():
    """A plan sees both sides of them, and fills them in one go."""
    for limit in (ObstacleLimit([HalfSpace([0, 0, 1], -0.1)]), SelfCollisionLimit()):
        bound = limit.bind(robot("panda"), 1e-3)
        assert isinstance(limit, Limit)
        assert isinstance(bound, RowLimit)
        assert isinstance(bound, BoundLimit)


@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp", "hqp/clarabel", "hqp/proxqp", "wqp/quadprog"])
def test_every_kind_of_resolver_takes_the_rows(resolver):
    """Empty rows, active rows and the box together: certified, and the same answer if they are strict."""
    arm = robot("panda")
    q = arm.posture("default")
    pushed = PositionTask("panda_hand", target=[0.5, 0.3, 0.6], gain=10.0)
    at = Configuration(arm, q)
    obstacle = Sphere(at.pose("panda_hand")[:3, 3] + [0.0, 0.15, 0.0], 0.08)
    limits = [JointPositionLimit(), JointVelocityLimit(), ObstacleLimit([obstacle]), SelfCollisionLimit()]
    hierarchy = Stack(levels=[[pushed]], limits=limits).at(at, 1e-3)
    exact = resolve(hierarchy, "active-set")
    resolution = resolve(hierarchy, resolver)
    assert np.abs(resolution.certificate.residuals).max() < 1e-6
    if not resolver.startswith("wqp"):
        np.testing.assert_allclose(resolution.v, exact.v, atol=1e-5)
    assert any(active.name.startswith("obstacle/panda_hand – sphere") for active in resolution.active)


def test_the_pairs_of_a_self_collision_limit_are_the_srdfs_or_those_named():
    """44 for the Panda, eight for the hand's fingers and the base."""
    assert len(SelfCollisionLimit().bind(robot("panda"), 1e-3).row_names) == 44
    named = SelfCollisionLimit(
        pairs=[("panda_link0", "panda_leftfinger"), ("panda_link0", "panda_rightfinger")]
    )
    assert len(named.bind(robot("panda"), 1e-3).row_names) == 8


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda: ObstacleLimit([]), InvalidValue, "obstacles must be a list"),
        (lambda: ObstacleLimit([Sphere([0, 0, 0], 1)], margin=-0.1), InvalidValue, "margin must be ≥ 0"),
        (lambda: ObstacleLimit([Sphere([0, 0, 0], 1)], margin=0.2), InvalidValue, "less than influence"),
        (lambda: ObstacleLimit([Sphere([0, 0, 0], 1)], gain=1.5), InvalidValue, "gain of a distance limit"),
        (lambda: SelfCollisionLimit(influence=0.0), InvalidValue, "influence must be > 0"),
        (
            lambda: ObstacleLimit([Sphere([0, 0, 0], 1)], links=["elbow"]).bind(planar_arm(), 1e-3),
            UnknownName,
            "link with a shape",
        ),
        (
            lambda: SelfCollisionLimit().bind(planar_arm((1, 1)), 1e-3),
            InvalidValue,
            "no two links of planar2",
        ),
        (
            lambda: SelfCollisionLimit().bind(Robot(planar_arm().model), 1e-3),
            InvalidValue,
            "no collision shapes",
        ),
    ],
)
def test_what_cannot_be_kept_is_refused(make, error, said):
    """No obstacle, numbers out of order, unknown links, nothing that could collide."""
    with pytest.raises(error, match=said):
        make()


def test_a_rail_without_end_has_no_bound_and_is_refused():
    """What hangs on an endless slide can be anywhere, so no turn of a joint before it is safe."""
    arm = Robot.from_dh([DHRow(0.0, np.pi / 2, 0.0, 0.0), DHRow(0.0, 0.0, 0.2, 0.0, "prismatic")])
    with pytest.raises(InvalidValue, match="give the joint limits"):
        ObstacleLimit([Sphere([1, 0, 0], 0.1)]).bind(arm, 1e-3)


def test_a_posture_that_is_not_a_number_is_named():
    """NaN in q reaches no solver by way of a distance that no comparison sees."""
    arm = robot("planar3")
    stack = Stack(levels=[[DampingTask()]], limits=[ObstacleLimit([Sphere([0.5, 0.5, 0.0], 0.1)])])
    plan = stack.compile(arm, 1e-3)
    plan.start([0.1, 0.2, 0.3])
    with pytest.raises(InvalidValue, match=r"NaN|not finite"):
        plan.at(np.array([0.1, np.nan, 0.3]), 0.0)
