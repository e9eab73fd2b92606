"""A distance limit with fewer rows than pairs: the same velocities and promise, and every pair named."""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

from taskopt import Controller, JointTask, Robot, SelfCollisionLimit, Stack
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, LevelRows
from taskopt.kinematics.collision.broad_phase import Ball
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.coal import solid
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.kinematics.limit.bound_distance import BoundDistance
from taskopt.kinematics.limit.near_rows import BoundNearDistance
from taskopt.kinematics.robot.random_posture import random_posture
from taskopt.testing import check_limit
from tests.helpers.robots import robot

MARGIN, INFLUENCE = 0.01, 0.06
BOTH = SelfCollisionLimit(MARGIN, influence=INFLUENCE, gain=0.5)


def filled(bound, at):
    """Rows and bounds (4, nv) of a limit at a configuration, as a plan has them."""
    m, nv = len(bound.row_names), at.robot.nv
    rows = LevelRows(np.zeros((m, nv)), np.empty(m), np.empty(m), np.ones(m), np.zeros(m))
    bound.prepare(rows)
    bound.fill(at, 0.0, rows)
    bounds = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], nv, axis=1)
    bound.narrow(at, bounds, 1)
    return rows, bounds


class Oracle:
    """Distances of all pairs of a limit, measured by Coal alone, on shapes and memory of its own."""

    def __init__(self, of, pairs):
        self.of, self.data = of, of.model.createData()
        self.shapes = solid(of.geometry)
        for pair in pairs:
            self.shapes.addCollisionPair(pin.CollisionPair(*pair))
        self.memory = self.shapes.createData()
        for request in self.memory.distanceRequests:
            request.gjk_tolerance = request.epa_tolerance = 1e-9

    def __call__(self, q):
        pin.computeDistances(self.of.model, self.data, self.shapes, self.memory, q)
        return np.array([result.min_distance for result in self.memory.distanceResults])


def walk(of, rng, count, dt=5e-3):
    """Postures on a way with pauses and jumps, some joints of which move and some do not."""
    q = random_posture(of, rng)
    speeds = np.minimum(of.velocity_limit, 2.0)
    for i in range(count):
        if i % 25 == 0:
            v = rng.uniform(-1.0, 1.0, of.nv) * speeds * (rng.random(of.nv) < rng.choice([0.1, 0.6]))
        if i % 60 == 59:
            q = random_posture(of, rng)
        if rng.random() < 0.9:
            q = of.integrate(q, v, dt)
        yield q


def hidden(bound, of, count):
    """How far a pair was below its threshold without being measured, and below its lower bound, at most."""
    oracle, worst, measured = Oracle(of, bound.distances.collision.pairs), [-np.inf, -np.inf], 0
    for q in walk(of, np.random.default_rng(4), count):
        filled(bound, Configuration(of, q))
        exact = oracle(q)
        far = np.ones(exact.size, dtype=bool)
        far[bound.distances.near] = False
        measured += exact.size - int(far.sum())
        worst[0] = max(worst[0], float((bound.threshold - exact)[far].max()))
        worst[1] = max(worst[1], float((bound.distances.broad_phase.bound() - exact).max()))
    assert 0 < measured < 0.5 * count * bound.threshold.size
    return worst


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count"), [("panda", 150), ("tiago", 60)])
def test_no_pair_is_hidden(name, count):
    """Every pair below its threshold is measured, at jumps and at rest, too; Coal alone is the judge."""
    of = robot(name)
    assert max(hidden(replace(BOTH, rows=8).bind(of, 1e-3), of, count)) < 1e-6


def shorter_reach(bound):
    """A bound on the motion of the joints that is too small."""
    bound.distances.between.reach[:] *= 0.03


def smaller_balls(bound):
    """Balls that do not hold the solids."""
    bound.distances.broad_phase._balls[:, Ball.RADIUS] *= 0.5


@pytest.mark.slow
@pytest.mark.parametrize("plant", [shorter_reach, smaller_balls])
def test_a_bound_that_is_too_small_is_caught(plant):
    """The check above sees both bounds if they are shrunk."""
    of = robot("tiago")
    bound = replace(BOTH, rows=8).bind(of, 1e-3)
    plant(bound)
    worst, excess = hidden(bound, of, 60)
    assert worst > 1e-3
    assert excess > 1e-3


def allows(rows, bounds, v):
    """True if a velocity is inside rows and bounds."""
    return bool((rows.A @ v >= rows.lower - 1e-9).all() and (np.abs(v) <= bounds[1] + 1e-9).all())


def folded(of, rng, bound):
    """A posture in which some pairs are outside their margins, but near."""
    while True:
        at = Configuration(of, random_posture(of, rng))
        bound.distances.update(at)
        if MARGIN <= bound.distances.distance.min() < 0.03:
            return at


@pytest.mark.parametrize("rows", [1, 20])
def test_fewer_rows_allow_the_same_velocities(rows):
    """Within the nominal speeds it is what a row for each pair allows; with too few rows, it is less."""
    of, rng, seen = robot("panda"), np.random.default_rng(2), []
    every, few = BOTH.bind(of, 5e-3), replace(BOTH, rows=rows).bind(of, 5e-3)
    assert isinstance(every, BoundDistance)
    assert isinstance(few, BoundNearDistance)
    for _ in range(25):
        at = folded(of, rng, every)
        mine, theirs = filled(few, at), filled(every, at)
        for _ in range(40):
            v = every.speeds * rng.uniform(-1.0, 1.0, of.nv) * rng.choice([0.01, 0.1, 0.3, 1.0])
            seen.append((allows(*mine, v), allows(*theirs, v)))
    mine, theirs = np.array(seen).T
    assert 0.1 < theirs.mean() < 0.9
    if rows > 1:
        assert (mine == theirs).all()
    else:
        assert mine.sum() < theirs.sum()


@pytest.mark.slow
@pytest.mark.parametrize("rows", [2, 12])
@pytest.mark.parametrize("dt", [1e-3, 2e-2])
def test_no_run_of_extreme_steps_breaks_the_margin(rows, dt):
    """At ten points of every step, d ≥ margin − 1e-9 m for all pairs, whatever the tasks may want."""
    of, rng, least = robot("panda"), np.random.default_rng(8), []
    bound = replace(BOTH, gain=1.0, rows=rows).bind(of, dt)
    oracle = Oracle(of, bound.distances.collision.pairs)
    for _ in range(6):
        at = folded(of, rng, bound)
        for _ in range(25):
            rows_, bounds = filled(bound, at)
            near = bound.distances.near
            nearest = near[bound.distances.distance[near].argmin()] if near.size else 0
            toward = bound.distances.gradient[nearest] + 0.3 * rng.normal(size=of.nv)
            on = np.isfinite(rows_.lower)
            found = linprog(
                toward, -rows_.A[on] if on.any() else None, -rows_.lower[on] if on.any() else None,
                bounds=bounds[:2].T,
            )  # fmt: skip
            assert found.status == 0
            steps = [of.integrate(at.q, found.x, share * dt) for share in np.linspace(0.1, 1.0, 10)]
            least += [oracle(q).min() for q in steps]
            at = Configuration(of, steps[-1])
    assert min(least) >= MARGIN - 1e-6
    assert min(least) < MARGIN + 0.01


@pytest.mark.slow
def test_every_bound_names_its_pair():
    """A row that serves other pairs from tick to tick is called by the pair of its tick."""
    of, rng = robot("panda"), np.random.default_rng(3)
    limit, names = replace(BOTH, rows=5), set()
    plan = Stack([[JointTask()]], [limit]).compile(of, 2e-2)
    every = BOTH.bind(of, 2e-2)
    for _ in range(30):
        at = folded(of, rng, every)
        tick = plan.at(at.q, 0.0)
        filled(every, at)
        for row in np.flatnonzero(np.isfinite(tick.limits.lower)):
            name = tick.name_of(of.nv + int(row), False)
            pair = every.row_names.index(name.removeprefix("self_collision/"))
            np.testing.assert_allclose(tick.limits.A[row], every.distances.gradient[pair], atol=1e-9)
            names.add(name)
    assert len(names) > 5
    assert all(" – " in name for name in names)


def test_saved_hierarchies_keep_the_names_of_their_rows(tmp_path):
    """The labels are in the file; a file without labels is read as one whose rows have their own names."""
    of = robot("panda")
    every = BOTH.bind(of, 1e-3)
    at = folded(of, np.random.default_rng(3), every)
    tick = Stack([[JointTask()]], [replace(BOTH, rows=5)]).at(at, 2e-2)
    tick.save(tmp_path / "tick.npz")
    again = Hierarchy.load(tmp_path / "tick.npz")
    names = [[one.name_of(of.nv + i, False) for i in range(5)] for one in (tick, again)]
    assert names[0] == names[1]
    assert any(" – " in name for name in names[1])
    with np.load(tmp_path / "tick.npz") as file:
        text, size, n = str(file["layout"]), tick.buffer.size, of.nv
        labels = slice(size - 4 * n - tick.layout.row_count, size - 4 * n)
        old = np.delete(file["buffer"], labels)
        older = text.replace('"format": 2', '"format": 1')
        np.savez(tmp_path / "old.npz", buffer=old, norm=file["norm"], layout=np.array(older))
        np.savez(tmp_path / "bad.npz", buffer=old[:-1], norm=file["norm"], layout=np.array(older))
    assert Hierarchy.load(tmp_path / "old.npz").name_of(of.nv, False) == "self_collision/row 1"
    np.testing.assert_array_equal(Hierarchy.load(tmp_path / "old.npz").A, tick.A)
    with pytest.raises(InvalidValue, match="do not fit the names"):
        Hierarchy.load(tmp_path / "bad.npz")


def test_after_a_posture_that_is_no_number_nothing_is_remembered():
    """The tick is refused, and the next one measures as a fresh limit does."""
    of, every = robot("panda"), BOTH.bind(robot("panda"), 1e-3)
    at = folded(of, np.random.default_rng(5), every)
    plan = Stack([[JointTask()]], [replace(BOTH, rows=5)]).compile(of, 1e-3)
    plan.start(at.q)
    with pytest.raises(InvalidValue, match=r"NaN|not finite"):
        plan.at(np.full(of.nq, np.nan), 0.0)
    tick = plan.at(at.q, 0.0)
    fresh = Stack([[JointTask()]], [replace(BOTH, rows=5)]).at(at, 1e-3)
    np.testing.assert_array_equal(np.sort(tick.lower), np.sort(fresh.lower))


def test_the_limit_passes_the_check_of_limits():
    """Standstill is always inside, and compiled and Python bounds agree."""
    check_limit(replace(BOTH, rows=6), robot("panda"))
    check_limit(ObstacleLimit([Sphere([0.5, 0.3, 0.5], 0.1)], rows=4), robot("panda"))
    with pytest.raises(InvalidValue, match="rows must be a whole number"):
        SelfCollisionLimit(rows=0)


def test_the_stack_stays_one_compiled_call():
    """Bounds on the velocities come from a kernel, and an answer names the pair that holds it back."""
    of = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    every = BOTH.bind(of, 1e-3)
    at = folded(of, np.random.default_rng(11), every)
    toward = at.q - 0.5 * every.distances.gradient[every.distances.distance.argmin()]
    stack = Stack([[JointTask(target=toward, gain=20.0)]], [replace(BOTH, gain=0.1, rows=5)])
    control = Controller(of, stack, dt=5e-3)
    assert control.plan.in_one_call
    q, names = at.q, set()
    for i in range(60):
        resolution = control.step(q, 5e-3 * i)
        assert resolution.kkt_met()
        names |= {active.name for active in resolution.active}
        q = of.integrate(q, resolution.v, 5e-3)
    assert any(name.startswith("self_collision/panda_") and " – " in name for name in names)


def by_pair(rows):
    """Coefficients and lower bound of the row of each pair that has one, by its label."""
    return {rows.label[i]: np.append(rows.A[i], rows.lower[i]) for i in np.flatnonzero(rows.label)}


def same_after_another_period(of, forget=()):
    """True if a limit whose Δt changes on its way has the rows and bounds of one that was bound with it."""
    way = walk(of, np.random.default_rng(6), 60)
    mine, theirs = (replace(BOTH, rows=6).bind(of, dt) for dt in (2e-3, 8e-3))
    filled(mine, Configuration(of, next(way)))
    old = {name: getattr(mine, name).copy() for name in forget}
    mine.retime(8e-3)
    for name, value in old.items():
        getattr(mine, name)[:] = value
    mine.distances.broad_phase.expect(mine.threshold)
    count = 0
    for q in way:
        (rows, bounds), (others, their_bounds) = (filled(one, Configuration(of, q)) for one in (mine, theirs))
        own, other = by_pair(rows), by_pair(others)
        count += len(own)
        if own.keys() != other.keys() or not np.allclose(bounds, their_bounds, rtol=0.0, atol=1e-12):
            return False
        if any(np.abs(own[label] - other[label]).max() > 1e-12 for label in own):
            return False
    assert count > 60
    return True


def test_another_period_gives_the_rows_of_a_limit_that_was_bound_with_it():
    """Rows by pair, and bounds; a number of the old period that stays is seen."""
    of = robot("panda")
    assert same_after_another_period(of)
    for name in ("known", "reserve", "threshold"):
        assert not same_after_another_period(of, [name])


@pytest.mark.parametrize("tells", [True, False])
def test_another_period_hides_no_pair(tells):
    """Every pair below its new threshold is measured; not so if the broad phase keeps the old thresholds."""
    of = robot("tiago")
    bound = replace(BOTH, rows=8).bind(of, 1e-3)
    filled(bound, Configuration(of, of.posture("middle")))
    if not tells:
        bound.distances.broad_phase.expect = lambda threshold: None
    bound.retime(3e-3)
    assert (hidden(bound, of, 20)[0] < 1e-6) == tells
