"""The polished answer is exact where the active set was right, and says so where it was not."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from taskopt.problem.resolution import Resolution
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.polish import polish
from tests.oracles import lexicographic_optimum, random_hierarchy


@given(st.integers(0, 2**32 - 1))
def test_the_right_active_set_gives_the_exact_optimum(seed: int) -> None:
    """To rounding, whatever the raw answer's last digits were."""
    hierarchy = random_hierarchy(seed)
    raw, _ = HierarchicalQP("daqp")(hierarchy)
    polished = polish(raw)
    np.testing.assert_allclose(polished.x, lexicographic_optimum(hierarchy), atol=1e-9)
    assert polished.certified()


def test_raw_and_polished_are_kept_apart() -> None:
    """Polishing makes a new resolution; the raw one does not change."""
    raw, _ = HierarchicalQP("clarabel")(random_hierarchy(54))
    before = raw.answer.copy()
    assert polish(raw) is not raw
    np.testing.assert_array_equal(raw.answer, before)


def test_a_wrong_active_set_is_not_polished_into_a_proof() -> None:
    """Without the bounds that hold it back, the answer leaves the limits, and the certificate says so."""
    caught = 0
    for seed in range(20):
        raw, _ = HierarchicalQP("daqp")(random_hierarchy(seed))
        if raw.active:
            lie = Resolution(raw.source, raw.answer, np.zeros_like(raw.state), raw.status)
            caught += not polish(lie).certified()
    assert caught >= 10
