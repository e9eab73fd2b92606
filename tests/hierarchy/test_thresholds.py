"""Thresholds of certificate, alternation and range stand where the table of tolerances says."""

import numpy as np
import pytest

from taskopt.hierarchy.alternation import ADVICE, _Count
from taskopt.hierarchy.certificate import Certificate, certify
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.closed_form import in_range


@pytest.mark.parametrize("kind", range(4))
def test_a_residual_of_two_tolerances_is_no_proof(kind: int) -> None:
    """Any one residual above the tolerance refuses the proof, and one below it does not."""
    residuals = np.zeros((2, 4))
    residuals[1, kind] = 2e-8
    assert not Certificate(residuals).kkt_met()
    assert Certificate(0.25 * residuals).kkt_met()


def test_a_hard_row_of_nan_is_no_proof() -> None:
    """NaN in a hard row that has no multiplier reaches no gradient, and refuses the proof all the same."""
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [0.0])], limits=Level([[0.0, 1.0]], upper=[1.0]))
    hierarchy.A[0, 1] = np.nan
    assert certify(hierarchy, np.zeros(2), np.zeros((2, 4))).worst == np.inf


def test_a_multiplier_of_the_wrong_sign_frees_no_sign() -> None:
    """A wrong sign within the tolerance at level 1 must not allow any multiplier at level 2.

    x₁ = 0, then x₂ = 0, with a hard row x₁ + 0.05 x₂ ≤ 100 that is far away: x₂ = 7 is wrong.
    """
    levels = [Level([[1.0, 0.0]], [0.0]), Level([[0.0, 1.0]], [0.0])]
    hierarchy = Hierarchy(levels, limits=Level([[1.0, 0.05]], upper=[100.0]))
    y = np.zeros((3, 5))
    y[0, 2] = -5e-9
    y[1, 2:4] = -140.0, 140.0
    y[2, 3:5] = -5e-9, -7.0
    assert not certify(hierarchy, np.array([5e-9, 7.0]), y).kkt_met()


def test_a_symptom_of_few_changes_is_no_cause() -> None:
    """A cause is suggested only where its symptom showed in half of the changes; else the step is blamed."""
    shows = dict.fromkeys(ADVICE, 0)
    assert _Count(10, shows | {"rank": 4}).cause == "dt"
    assert _Count(10, shows | {"rank": 5}).cause == "rank"


@pytest.mark.parametrize("share", [1e-6, 1e-8])
def test_a_direction_with_a_part_outside_is_not_in_the_range(share: float) -> None:
    """A share of 1e-8 outside R(J) is more than rounding."""
    J = np.array([[1.0, 0.0], [0.0, 0.0]])
    assert not in_range(J, np.array([1.0, share]))
    assert in_range(J, np.array([1.0, 1e-3 * 1e-8]))
