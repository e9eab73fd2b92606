"""What rounding hides is named: bounds that tie, and bounds that are nearer to each other than rounding."""

import numpy as np
import pytest
from scipy.linalg import hilbert, invhilbert

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict, judge, prove
from taskopt.hierarchy.proof.linear import inverse

TIED = Hierarchy([Level([[1.0, 3.0]], [10.0])], box=([-9.0, -9.0], [1.0, 9.0]))
"""The least x with x₀ + 3 x₁ = 10 is (1, 3), exactly on the bound x₀ ≤ 1."""

NARROW = Hierarchy([Level([[1.0, 3.0]], lower=[10.0], upper=[10.0 + 2e-15])])
"""x₀ + 3 x₁ between two neighbouring doubles, far apart for numbers of twice the digits."""


@pytest.mark.parametrize("held", [0, 1])
def test_a_bound_that_ties_is_undecided_whether_it_is_held_or_not(held: int) -> None:
    """Not held, its violation is hidden; held, its multiplier is. Both solutions are the optimum."""
    found = prove(TIED, np.array([held, 0, 0], np.int8))
    assert found.undecided == ("upper bound of box/x0",)
    assert len(found.candidates) == 2
    assert (found.distance(np.array([1.0, 3.0])) < 1e-28).all()


def test_bounds_nearer_than_rounding_are_both_undecided() -> None:
    """A row held at its upper bound whose lower bound is 1e-40 away may be held at either, or at none."""
    row = Level([[1.0, 3.0]], lower=[0.0], upper=[1e-40])
    found = prove(Hierarchy([Level([[1.0, 7.0]], [1.0]), row]), np.array([0, 0, 0, 1], np.int8))
    assert found.undecided == ("lower bound of level 2/row 0", "upper bound of level 2/row 0")
    assert (found.distance(np.array([-0.75, 0.25])) < 1e-28).all()


def test_neighbouring_doubles_are_far_apart() -> None:
    """The lower bound is active, and nothing is undecided."""
    found = prove(NARROW, np.array([0, 0, -1], np.int8))
    assert found.undecided == ()
    assert (found.distance(np.array([1.0, 3.0])) < 1e-28).all()


def test_an_inverse_that_rounding_spoils_is_none() -> None:
    """The Hilbert matrix of order 14 has the condition 1e18, that of order 6 1.5e7."""
    assert inverse(hilbert(14)) is None
    found = inverse(hilbert(6))
    assert found is not None
    assert found.middle == pytest.approx(invhilbert(6), rel=1e-9)


@pytest.mark.parametrize(
    ("off", "verdict"), [(0.5, Verdict.PROVEN), (1.0, Verdict.UNDECIDED), (2.0, Verdict.REFUTED)]
)
def test_an_error_of_just_the_accuracy_is_undecided(off: float, verdict: Verdict) -> None:
    """1e-8 of x* = 1e8 is 1; whether x is wrong by more depends on x*, which is known up to an error."""
    assert judge(Hierarchy([Level([[1.0]], [1e8])]), [1e8 + off]).verdict is verdict


def test_entries_of_rounding_size_refute_nothing() -> None:
    """x₀ = 2 is out of reach, and 1e-16 x₁ helps by nothing: x = (1, 0) is undecided, the row is named."""
    problem = Hierarchy([Level([[1.0, 1e-16]], [2.0])], box=([-1.0, -1.0], [1.0, 1.0]))
    assert judge(problem, [1.0, 1.0]).verdict is Verdict.PROVEN
    found = judge(problem, [1.0, 0.0])
    assert found.verdict is Verdict.UNDECIDED
    assert found.rows == ("level 1/row 0",)
    assert found.error_bound[1] >= 1.0
    assert judge(problem, [0.9, 0.0]).verdict is Verdict.REFUTED
    seen = Hierarchy([Level([[1.0, 1e-9]], [2.0])], box=([-1.0, -1.0], [1.0, 1.0]))
    assert judge(seen, [1.0, 0.0]).verdict is Verdict.REFUTED
