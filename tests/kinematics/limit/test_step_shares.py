"""The bounds on speed of a distance limit: no pair loses more in a step than its row leaves it."""

import numpy as np
import pytest

from taskopt.hierarchy.tolerances import CONTACT
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.kinematics.limit.bound_distance import approach_into
from taskopt.kinematics.robot import planar_arm

MARGIN, INFLUENCE, DT = 0.01, 0.1, 1e-3
TRAVEL, JUMP, BEND, RESERVE = 0.02, 0.003, 0.001, 0.005


def row_of(distance: float) -> tuple[float, float]:
    """Return the lower bound of one pair's row, and the share of its one velocity."""
    known = np.array([[TRAVEL], [JUMP], [BEND], [RESERVE], [MARGIN], [INFLUENCE], [0.0], [0.0]])
    A, lower, share = np.zeros((1, 1)), np.zeros(1), np.zeros(1)
    approach_into(np.array([distance]), np.ones((1, 1)), np.ones((1, 1)), known, (1.0, DT), A, lower, share)
    return float(lower[0]), float(share[0])


def test_a_pair_at_its_margin_may_lose_no_more_than_rounding() -> None:
    """At d = margin the row allows no approach, and a step loses s · jump + s² · bend = 1e-9 m."""
    lower, s = row_of(MARGIN)
    assert lower == 0.0
    assert s * JUMP + s * s * BEND == pytest.approx(1e-9, rel=1e-6)
    assert CONTACT == 1e-9


def test_a_near_pair_may_lose_what_its_row_leaves() -> None:
    """Row and bounds on speed together spend d − margin at most."""
    lower, s = row_of(MARGIN + 0.02)
    assert -lower * DT + s * JUMP + s * s * BEND == pytest.approx(0.02)


def test_a_far_pair_may_lose_its_whole_room() -> None:
    """Beyond the influence there is no row: the bounds on speed alone keep the margin."""
    lower, s = row_of(0.3)
    assert lower == -np.inf
    assert s * TRAVEL + s * s * BEND == pytest.approx(0.3 - MARGIN)


def test_the_reserve_has_room_for_more_than_a_full_step() -> None:
    """d_s = margin + reserve with the reserve jump + 2 bend, at most half of the way to the influence."""
    arm = planar_arm([0.5, 0.5], velocity=2.0)
    bound = ObstacleLimit([Sphere([0.6, 0.6, 0.0], 0.1)], MARGIN, influence=INFLUENCE).bind(arm, DT)
    wanted = np.minimum(bound.jump + 2.0 * bound.bend, 0.5 * (INFLUENCE - MARGIN))
    assert (wanted > 0.0).any()
    np.testing.assert_array_equal(bound.reserve, wanted)
