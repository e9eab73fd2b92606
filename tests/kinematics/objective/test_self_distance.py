"""Distance between links as an objective: exact gradients, and a climb that opens what is closed."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective import JointRange, SelfDistance
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.robot.random_posture import random_posture
from tests.helpers.differences import derivative
from tests.helpers.near import NAMES
from tests.helpers.robots import robot


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_gradient_is_the_derivative(name: str) -> None:
    """To 1e-7 of the largest slope, or of 0.05; at most one posture in six is at a kink, and is counted."""
    rng, kinks = np.random.default_rng(3), 0
    for _ in range(6 if name != "talos_reduced" else 3):
        at, w = Configuration(robot(name), random_posture(robot(name), rng)), SelfDistance(0.02)
        numeric = derivative(w.value, at)
        kinks += bool(np.abs(w.gradient(at) - numeric).max() > 1e-7 * max(np.abs(numeric).max(), 0.05))
    assert kinks <= 1


def test_it_is_the_least_distance_of_its_pairs() -> None:
    """τ = 0 is the minimum of what the limit measures, of all pairs or of those named."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    at = Configuration(arm, [0.3, 2.4, 1.3])
    for pairs in (None, [("link1", "link3")]):
        w = SelfDistance(0.0, pairs)
        distances = Distances(w.collision(arm))
        distances.update(at)
        assert w.value(at) == distances.distance.min()


def test_a_climb_opens_a_folded_arm() -> None:
    """Along the gradient the distance grows, and it adds to other objectives."""
    arm = planar_arm([0.5, 0.3, 0.3], radius=0.02)
    at, w = Configuration(arm, [0.3, 2.4, 1.3]), SelfDistance()
    after = Configuration(arm, at.q + 1e-3 * w.gradient(at))
    assert w.value(after) > w.value(at)
    both = w + JointRange(lower=-3.0, upper=3.0)
    assert both.value(at) == w.value(at) + JointRange(lower=-3.0, upper=3.0).value(at)
    assert SelfDistance(pairs=[("link1", "link3")]) == SelfDistance(pairs=(("link1", "link3"),))


def test_what_has_no_meaning_is_refused() -> None:
    """Two links cannot meet, a link that is not there, a negative temperature."""
    two = Configuration(planar_arm([0.5, 0.5]), [0.1, 0.2])
    with pytest.raises(InvalidValue, match="no two links"):
        SelfDistance().value(two)
    with pytest.raises(UnknownName, match="link9"):
        SelfDistance(pairs=[("link1", "link9")]).value(two)
    with pytest.raises(InvalidValue, match="temperature"):
        SelfDistance(-1.0)
