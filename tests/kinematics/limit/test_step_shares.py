"""The bounds on speed of a distance limit: no pair loses more in a step than its row leaves it."""

import numpy as np
import pytest

from taskopt.hierarchy.tolerances import CONTACT, RESERVE_USED
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.kinematics.limit.bound_distance import approach_into
from taskopt.kinematics.robot import planar_arm

MARGIN, INFLUENCE, DT = 0.01, 0.1, 1e-3
TRAVEL, JUMP, BEND, SLIDE, RESERVE = 0.02, 0.003, 0.001, 0.0004, 0.005


def rows_of(distance: float, slide: float) -> tuple[float, float, float]:
    """Return the lower bound of one pair's row, and the shares of a turning and of a sliding joint."""
    known = np.array([[TRAVEL, JUMP, BEND, slide, RESERVE, MARGIN, INFLUENCE, 0.0, 0.0]]).T
    A, lower, share, settings = np.zeros((1, 2)), np.zeros(1), np.zeros(2), (1.0, DT, np.array([True, False]))
    approach_into(np.array([distance]), np.ones((1, 2)), np.ones((1, 2)), known, settings, A, lower, share)
    return float(lower[0]), float(share[0]), float(share[1])


def row_of(distance: float) -> tuple[float, float]:
    """Return the lower bound of the row of a pair without sliding joints, and the share of its joint."""
    return rows_of(distance, 0.0)[:2]


def test_a_pair_at_its_margin_may_lose_no_more_than_rounding() -> None:
    """At d = margin the row allows no approach, and a step loses s · jump + s² · bend = 1e-9 m."""
    lower, s = row_of(MARGIN)
    assert lower == 0.0
    assert s * JUMP + s * s * BEND == pytest.approx(1e-9, rel=1e-6)
    assert CONTACT == 1e-9


def test_a_pair_within_its_reserve_may_come_nearer_by_a_tenth_of_its_room() -> None:
    """Else two links that are always near each other would hold the joints between them."""
    lower, s = row_of(MARGIN + 0.5 * RESERVE)
    assert -lower * DT == pytest.approx(RESERVE_USED * 0.5 * RESERVE)
    assert -lower * DT + s * JUMP + s * s * BEND == pytest.approx(0.5 * RESERVE)


def test_a_near_pair_may_lose_what_its_row_leaves() -> None:
    """Row and bounds on speed together spend d − margin at most."""
    lower, s = row_of(MARGIN + 0.02)
    assert -lower * DT + s * JUMP + s * s * BEND == pytest.approx(0.02)


def test_a_far_pair_may_lose_its_whole_room() -> None:
    """Beyond the influence there is no row: the bounds on speed alone keep the margin."""
    lower, s = row_of(0.3)
    assert lower == -np.inf
    assert s * TRAVEL + s * s * BEND == pytest.approx(0.3 - MARGIN)


@pytest.mark.parametrize("room", [0.091, 0.095])
def test_a_pair_beyond_the_influence_has_a_row_where_a_step_could_reach_the_margin(room: float) -> None:
    """Its row and what a step loses besides spend the room, and no joint is slowed down for it."""
    known = np.array([[0.1, JUMP, BEND, 0.0, RESERVE, MARGIN, INFLUENCE, 0.0, 0.0]]).T
    A, lower, share = np.zeros((1, 1)), np.zeros(1), np.zeros(1)
    settings = (1.0, DT, np.array([True]))
    one = np.ones((1, 1))
    approach_into(np.array([MARGIN + room]), one, one, known, settings, A, lower, share)
    assert A[0, 0] == 1.0
    assert -lower[0] * DT + JUMP + BEND == pytest.approx(room)
    assert share[0] == pytest.approx(1.0)


def test_a_pair_beyond_the_influence_that_may_lose_more_than_its_room_keeps_half_of_it() -> None:
    """Where a step may lose more than half of the room besides, the row and the loss have a half each."""
    known = np.array([[0.5, 0.06, 0.02, 0.0, RESERVE, MARGIN, INFLUENCE, 0.0, 0.0]]).T
    A, lower, share = np.zeros((1, 1)), np.zeros(1), np.zeros(1)
    settings = (1.0, DT, np.array([True]))
    approach_into(np.array([0.11]), np.ones((1, 1)), np.ones((1, 1)), known, settings, A, lower, share)
    assert -lower[0] * DT == pytest.approx(0.05)
    assert share[0] * 0.06 + share[0] ** 2 * 0.02 == pytest.approx(0.05)


@pytest.mark.parametrize("distance", [MARGIN, MARGIN + 0.005, MARGIN + 0.03, MARGIN + 0.07])
def test_a_slide_keeps_its_speed_where_turning_joints_are_slow(distance: float) -> None:
    """With slides at full speed, turning joints lose s (jump + slide) + s² (bend − slide) at most."""
    lower, turning, sliding = rows_of(distance, SLIDE)
    allowed = max(distance - MARGIN + lower * DT, 1e-9)
    if turning < 1.0:
        assert sliding == 1.0
        assert turning * (JUMP + SLIDE) + turning**2 * (BEND - SLIDE) == pytest.approx(allowed, rel=1e-6)
    else:
        assert turning == sliding
        assert turning * JUMP + turning**2 * BEND == pytest.approx(allowed)


def test_shares_of_slides_and_of_turning_joints_meet_at_the_nominal_speeds() -> None:
    """Where a step at the nominal speeds loses exactly what its row leaves, both shares are 1."""
    left = (JUMP + BEND) / (1.0 - RESERVE_USED)  # within the reserve, with κ = 1
    _, turning, sliding = rows_of(MARGIN + left * (1.0 - 1e-12), SLIDE)
    assert turning == pytest.approx(1.0)
    assert sliding == pytest.approx(1.0)


def test_the_reserve_has_room_for_more_than_a_full_step() -> None:
    """d_s = margin + reserve with the reserve jump + 2 bend, at most half of the way to the influence."""
    arm = planar_arm([0.5, 0.5], velocity=2.0)
    bound = ObstacleLimit([Sphere([0.6, 0.6, 0.0], 0.1)], MARGIN, influence=INFLUENCE).bind(arm, DT)
    wanted = np.minimum(bound.jump + 2.0 * bound.bend, 0.5 * (INFLUENCE - MARGIN))
    assert (wanted > 0.0).any()
    np.testing.assert_array_equal(bound.reserve, wanted)
