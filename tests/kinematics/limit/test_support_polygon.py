"""The centre of mass stays above its polygon as a limit, and comes back to it as a task."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    CentreOfMassTask,
    Configuration,
    Controller,
    FrameTask,
    InvalidValue,
    JointTask,
    Stack,
    SupportPolygonLimit,
    SupportPolygonTask,
    planar_arm,
    resolve,
)
from taskopt.kinematics.geometry.polygon import polygon_edges
from taskopt.testing import check_limit, check_task
from tests.helpers.attack import attacked
from tests.helpers.moving import bound
from tests.helpers.robots import generic_q, robot

NAMES = ("panda", "tiago", "talos_reduced")
SQUARE = [(0.3, -0.2, 7.0), (-0.3, 0.2, -1.0), (-0.3, -0.2, 0.0), (0.3, 0.2, 0.0), (0.1, 0.0, 0.0)]


def centre(at):
    """The centre of mass by Pinocchio's own function."""
    return pin.centerOfMass(at.robot.model, at.robot.model.createData(), at.q)


def outside_square(at):
    """By how much the centre of mass is outside the square, ≤ 0 inside."""
    x, y, _ = centre(at)
    return max(abs(x) - 0.3, abs(y) - 0.2)


@pytest.mark.parametrize("name", NAMES)
def test_the_task_keeps_the_contract(name):
    """Each row is the derivative of its coordinate, on robots with and without a floating base."""
    at = Configuration(robot(name), robot(name).posture("middle"))
    corners = centre(at) + 0.01 * np.array([(0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (-1.0, -1.0, 5.0)])
    check_task(SupportPolygonTask(corners, margin=0.002, gain=3.0, weight=2.0), robot(name), count=20)


def test_a_row_of_another_edge_is_caught(monkeypatch):
    """The check above fails if the rows of two edges are exchanged."""
    real = Configuration.centre_of_mass

    def wrong(self):
        c, J = real(self)
        return c, J[[1, 0, 2]]

    at = Configuration(robot("panda"), robot("panda").posture("middle"))
    corners = centre(at)[:2] + 0.01 * np.array([(0.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
    monkeypatch.setattr(Configuration, "centre_of_mass", wrong)
    with pytest.raises(AssertionError, match="not the derivative"):
        check_task(SupportPolygonTask(corners), robot("panda"), count=20)


@pytest.mark.slow
@pytest.mark.parametrize("dt", [1e-3, 2e-2])
@pytest.mark.parametrize("name", NAMES)
def test_the_limit_keeps_the_contract(name, dt):
    """v = 0 is always allowed, and the largest allowed steps towards corners stay inside."""
    check_limit(SupportPolygonLimit(SQUARE), robot(name), dt=dt, outside=outside_square, count=12)


def attacks(name, dt, honest=True):
    """What is left to the edges in runs of extreme steps from four starts a millimetre from one of them."""
    of, rng, left = robot(name), np.random.default_rng(4), []
    for seed in range(4):
        at = Configuration(of, generic_q(of, seed, 0.2))
        near = SupportPolygonLimit(np.array(SQUARE)[:, :2] + centre(at)[:2] - [0.299, 0.0])
        left.append(attacked(at, near.bind(of, dt), dt, rng, honest=honest))
    return np.concatenate(left)


@pytest.mark.slow
@pytest.mark.parametrize("dt", [2e-3, 2e-2])
@pytest.mark.parametrize("name", ["panda", "talos_reduced"])
def test_no_run_of_extreme_steps_leaves_the_polygon(name, dt):
    """Every edge holds to 1e-9 m after every step to the corner of what is allowed."""
    assert attacks(name, dt).min() >= -1e-9


@pytest.mark.slow
def test_rows_without_the_bounds_on_speed_are_caught():
    """The check above sees that linearised rows alone leave the polygon in long steps."""
    assert attacks("talos_reduced", 2e-2, honest=False).min() < -1e-3


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["limit", "task"])
def test_a_humanoid_that_leans_stops_at_the_edge(kind):
    """The centre of mass is sent 30 cm forward with both feet on the ground, and stays above the feet."""
    of, dt = robot("talos_reduced"), 5e-3
    q = of.posture("half_sitting")
    at = Configuration(of, q)
    feet = [at.pose(f"{side}_sole_link") for side in ("left", "right")]
    corners = [(pose @ [x, y, 0.0, 1.0])[:2] for pose in feet for x in (-0.1, 0.1) for y in (-0.05, 0.05)]
    stand = [FrameTask(f"{side}_sole_link", gain=20.0) for side in ("left", "right")]
    lean = CentreOfMassTask(centre(at) + [0.3, 0.0, 0.0], gain=6.0, axes="xy")
    keep = SupportPolygonTask(corners, margin=0.02, gain=20.0)
    limits = [SupportPolygonLimit(corners, margin=0.02)] if kind == "limit" else []
    levels = [stand, [lean], [JointTask()]] if kind == "limit" else [stand, [keep], [lean], [JointTask()]]
    control = Controller(of, Stack(levels, limits, damping=None), dt=dt)
    edges = polygon_edges(corners, 0.02)
    for k in range(150):
        resolution = control.step(q, k * dt)
        q = of.integrate(q, resolution.v, dt)
        room = (edges.offsets - edges.normals @ centre(Configuration(of, q))[:2]).min()
        assert room >= (-1e-9 if kind == "limit" else -1e-4)
    assert room < 0.03
    told = resolve(control.plan.hierarchy, "hqp/daqp")
    np.testing.assert_allclose(told.x, resolution.x, atol=1e-6)


def test_from_outside_the_task_leads_back_at_its_rate():
    """Each row that is missed asks for K times what is missing, by elementary geometry of the square."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 0))
    x, y, _ = centre(at)
    corners = np.array(SQUARE)[:, :2] + [x + 0.5, y]
    ready, rows = bound(SupportPolygonTask(corners, gain=3.0), at)
    assert sorted(ready.error.tolist()) == pytest.approx([-0.2, 0.0, 0.0, 0.0], abs=1e-12)
    missed = int(np.argmin(ready.error))
    np.testing.assert_allclose(rows.A[missed], -at.centre_of_mass()[1][0], atol=1e-15)
    assert rows.upper[missed] == pytest.approx(-0.6, abs=1e-12)


def test_the_hull_of_random_points_is_that_of_scipy():
    """Every edge of the hull, with points on its edges and twice in the list."""
    hulls = pytest.importorskip("scipy.spatial")
    rng = np.random.default_rng(0)
    for _ in range(50):
        points = rng.normal(size=(rng.integers(3, 30), 2))
        theirs = hulls.ConvexHull(points).equations
        ours = polygon_edges(np.vstack([points, points, points[:1] + 0.5 * (points[1:2] - points[:1])]), 0.0)
        mine = np.column_stack([ours.normals, -ours.offsets])
        assert len(mine) == len(theirs)
        assert np.abs(mine[:, None] - theirs[None]).max(axis=2).min(axis=1).max() < 1e-9


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SupportPolygonLimit([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]), "enclose an area"),
        (lambda: SupportPolygonLimit([(0.0, 0.0)]), "enclose an area"),
        (lambda: SupportPolygonTask([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], margin=0.4), "leaves no area"),
        (lambda: SupportPolygonTask(SQUARE, margin=-0.1), "margin must be ≥ 0"),
        (lambda: SupportPolygonTask(np.ones((4, 4))), r"\(k, 2\) or \(k, 3\)"),
        (lambda: SupportPolygonTask([(0.0, np.nan), (1.0, 0.0), (0.0, 1.0)]), "NaN"),
        (lambda: SupportPolygonLimit(SQUARE).bind(planar_arm(), 1e-3), "needs masses"),
        (lambda: SupportPolygonTask(SQUARE).bind(planar_arm(), "t"), "needs masses"),
    ],
)
def test_what_makes_no_sense_is_refused(make, words):
    """No area, a margin that leaves none, points that are none, a robot without mass."""
    with pytest.raises(InvalidValue, match=words):
        make()
