"""Values stand below, inside or above their intervals."""

import numpy as np

from taskopt.hierarchy.intervals import excess, nearer_side, signed_distance

VALUE = np.array([-3.0, -1.0, 0.5, 2.0, 5.0, 7.0, 0.0])
LOWER = np.array([-1.0, -1.0, -1.0, -1.0, -1.0, -np.inf, -np.inf])
UPPER = np.array([2.0, 2.0, 2.0, 2.0, 2.0, np.inf, 1.0])


def test_the_excess_is_positive_outside_and_the_negative_margin_inside() -> None:
    """By how much a value must move to reach its interval, or may move before it leaves it."""
    np.testing.assert_array_equal(excess(VALUE, LOWER, UPPER), [2.0, 0.0, -1.5, 0.0, 3.0, -np.inf, -1.0])


def test_the_signed_distance_tells_the_side() -> None:
    """Negative below, positive above, zero inside and at the bounds."""
    np.testing.assert_array_equal(signed_distance(VALUE, LOWER, UPPER), [-2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0])


def test_the_nearer_side_is_the_upper_one_in_a_tie() -> None:
    """0.5 is in the middle of −1 and 2; a bound at infinity is never nearer than a finite one."""
    np.testing.assert_array_equal(nearer_side(VALUE, LOWER, UPPER), [-1, -1, 1, 1, 1, 1, 1])
