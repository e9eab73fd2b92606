"""Distance from obstacles as an objective (3.58): a minimum that a climb can follow."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.objective import ObstacleDistance
from taskopt.kinematics.robot import planar_arm
from tests.helpers.differences import derivative
from tests.helpers.near import NAMES, SOLIDS, beside
from tests.helpers.robots import robot

TWO = (Sphere([0.5, 0.4, 0.0], 0.1), Sphere([0.5, -0.4, 0.0], 0.1))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_gradient_is_the_derivative(name):
    """Σ pᵢ ∇dᵢ to 1e-7 for several obstacles at once; at most one posture in twelve is at a kink."""
    rng, kinks = np.random.default_rng(2), 0
    for draw in range(12 if name != "talos_reduced" else 4):
        at, place = beside(robot(name), rng, scatter=0.2)
        several = list(SOLIDS.values())[: 4 if draw % 4 == 0 else 3]  # a half-space often hides the others
        w = ObstacleDistance([make(np.add(place, [0, 0, 0.1 * i])) for i, make in enumerate(several)], 0.02)
        numeric, own = derivative(w.value, at), w.gradient(at)
        scale = max(np.abs(numeric).max(), 0.05)
        if np.abs(own - numeric).max() < 1e-7 * scale:
            continue
        kinks += 1
        slope = np.array([(w.value(near) - w.value(at)) / 1e-8 for near in beyond(at, 1e-8)])
        assert np.abs(own - slope).max() < 1e-5
    assert kinks <= 1


def beyond(at, step):
    """A configuration a step along each velocity."""
    of = at.robot
    return [Configuration(of, of.integrate(at.q, row, 1.0)) for row in np.eye(of.nv) * step]


@pytest.mark.parametrize("tau", [0.1, 0.01, 1e-4, 0.0])
def test_the_soft_minimum_lies_just_below_the_minimum(tau):
    """min d − τ log P ≤ w ≤ min d, and w = min d at τ = 0."""
    arm, rng = planar_arm(radius=0.02), np.random.default_rng(4)
    distances = Distances(Collision.with_obstacles(arm, TWO))
    for _ in range(30):
        at = Configuration(arm, rng.uniform(-3, 3, 3))
        distances.update(at)
        nearest, w = distances.distance.min(), ObstacleDistance(TWO, tau).value(at)
        assert nearest - tau * np.log(6) - 1e-15 <= w <= nearest + 1e-15
        if tau == 0.0:
            assert w == nearest


def test_between_two_obstacles_the_soft_gradient_does_not_flip():
    """Across the middle the plain minimum's gradient jumps to the other side; the soft one crosses zero."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    at = [Configuration(arm, [angle, 0.0, 0.0]) for angle in (-1e-6, 1e-6)]
    plain = [ObstacleDistance(TWO, 0.0).gradient(a)[0] for a in at]
    soft = [ObstacleDistance(TWO, 0.02).gradient(a)[0] for a in at]
    assert plain[0] > 0.4
    assert plain[1] < -0.4
    assert abs(soft[0] - soft[1]) < 1e-3


@pytest.mark.slow
def test_a_climb_into_the_middle_settles_instead_of_chattering():
    """Euler steps along ∇w come to rest between the obstacles for τ > 0, and never do for the minimum."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)

    def last_steps(tau):
        w, q, steps = ObstacleDistance(TWO, tau), np.array([0.1, 0.05, 0.05]), []
        for _ in range(600):
            q = q + 0.01 * w.gradient(Configuration(arm, q))
            steps.append(w.gradient(Configuration(arm, q))[0])
        return np.array(steps[-50:])

    assert np.abs(np.diff(last_steps(0.02))).max() < 1e-3
    assert np.abs(np.diff(last_steps(0.0))).max() > 0.3


def test_only_the_links_named_count():
    """With links=, the others may touch what they like."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    at = Configuration(arm, [0.0, 0.0, 0.0])
    below_first = Sphere([0.25, 0.2, 0.0], 0.1)
    assert ObstacleDistance([below_first], 0.0).value(at) == pytest.approx(0.08)
    assert ObstacleDistance([below_first], 0.0, links=["link3"]).value(at) > 0.4


def test_two_equal_objectives_are_one():
    """They are values, and add and scale as all objectives."""
    assert ObstacleDistance(TWO) == ObstacleDistance(list(TWO))
    at = Configuration(planar_arm(radius=0.02), [0.1, 0.2, 0.3])
    assert (2.0 * ObstacleDistance(TWO)).value(at) == 2.0 * ObstacleDistance(TWO).value(at)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ObstacleDistance([]), "obstacles must be a list"),
        (lambda: ObstacleDistance(TWO, -0.1), "temperature must be ≥ 0"),
        (lambda: ObstacleDistance(TWO, np.nan), "temperature"),
    ],
)
def test_what_has_no_meaning_is_refused(make, said):
    """No obstacle; a negative temperature; NaN."""
    with pytest.raises(InvalidValue, match=said):
        make()
