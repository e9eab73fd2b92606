"""The oracles themselves: exact on problems with a known answer, and proven on the others."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskopt.hierarchy.multipliers import certify_velocity
from taskopt.hierarchy.problem import Hierarchy, Level
from tests.helpers.oracles import KINDS, lexicographic_optimum, random_hierarchy


def test_a_conflict_is_decided_by_weights_and_frozen() -> None:
    """x = 0 and x = 3 with weights 1 and 2 meet at 2, and the next level cannot move it."""
    levels = [Level([[1.0, 0.0], [1.0, 0.0]], [0.0, 3.0], weight=[1.0, 2.0]), Level(np.eye(2), [9.0, 4.0])]
    np.testing.assert_array_equal(lexicographic_optimum(Hierarchy(levels)), [2.0, 4.0])


def test_a_violated_inequality_is_frozen_and_a_satisfied_one_is_not() -> None:
    """x₀ ≤ −1 cannot be had inside |x| ≤ ½ and stays at −½; x₁ ≤ 1 is met, and level 2 may use it up."""
    levels = [Level(np.eye(2), upper=[-1.0, 1.0]), Level(np.eye(2), [5.0, 5.0])]
    hierarchy = Hierarchy(levels, box=([-0.5, -9.0], [0.5, 9.0]))
    np.testing.assert_array_equal(lexicographic_optimum(hierarchy), [-0.5, 1.0])


def test_contradicting_limits_have_no_optimum() -> None:
    """x ≥ 2 inside |x| ≤ 1."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[2.0]))
    with pytest.raises(ValueError, match="contradict"):
        lexicographic_optimum(hierarchy)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
def test_every_oracle_has_a_proof_of_its_own(seed: int) -> None:
    """KKT multipliers exist for it at every level: the oracles do not rest on one algorithm."""
    hierarchy = random_hierarchy(seed)
    assert certify_velocity(hierarchy, lexicographic_optimum(hierarchy)).worst < 1e-11


@pytest.mark.slow
def test_the_kinds_are_what_they_are_called() -> None:
    """Conflicts leave cost, dependent rows lose rank, inequalities stand where they should."""
    lost = violated = 0
    for seed in range(20):
        deficient = random_hierarchy(seed, "rank-deficient")
        soft = deficient.A[deficient.layout.offsets[1] :]
        lost += np.linalg.matrix_rank(soft) < min(soft.shape)
        clash = random_hierarchy(seed, "conflicting")
        violated += clash.levels[0].cost(lexicographic_optimum(clash)) > 0.0
        middle = random_hierarchy(seed, KINDS[3]).levels[1]
        assert (middle.lower < middle.upper).any()
        integers = random_hierarchy(seed, "integer-degenerate").A
        assert (integers == np.round(integers)).all()
    assert lost >= 5
    assert violated >= 5
