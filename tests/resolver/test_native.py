"""DAQP's own hierarchy: right where levels agree, refuted where they do not, and never outside the limits."""

import numpy as np
import pytest

from taskopt import Hierarchy, Level, Status
from taskopt.hierarchy.proof import Verdict, judge
from taskopt.resolver.native import NativeHierarchy
from taskopt.resolver.registry import resolve
from taskopt.testing import check_resolver
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy


def test_levels_that_agree_are_resolved_rightly() -> None:
    """Three levels of 2 rows with 8 unknowns, any norm, against the closed form by NumPy."""
    rng = np.random.default_rng(1)
    L = rng.normal(size=(8, 8)) + 4.0 * np.eye(8)
    J, b = rng.normal(size=(6, 8)), rng.normal(size=6)
    problem = Hierarchy([Level(J[k : k + 2], b[k : k + 2]) for k in (0, 2, 4)], norm=L.T @ L)
    expected = np.linalg.solve(L, np.linalg.pinv(J @ np.linalg.inv(L)) @ b)
    np.testing.assert_allclose(resolve(problem, "daqp-hierarchy").x, expected, atol=1e-7)


@pytest.mark.slow
def test_it_claims_what_the_judge_refutes() -> None:
    """Random levels in conflict: all are claimed, some are wrong, and the judge tells which."""
    verdicts = []
    for seed in range(20):
        problem = random_hierarchy(seed)
        answer = resolve(problem, "daqp-hierarchy")
        right = np.abs(answer.x - lexicographic_optimum(problem)).max() < 1e-6
        verdict = judge(problem, answer.x, answer.state).verdict
        assert answer.status is Status.SOLVED
        assert (verdict is Verdict.REFUTED) <= (not right)
        assert answer.certificate.broken_limit < 1e-6
        verdicts.append(verdict)
    assert Verdict.REFUTED in verdicts
    with pytest.raises(AssertionError, match="none"):
        check_resolver(NativeHierarchy())


def test_contradicting_limits_give_no_velocity() -> None:
    """NaN and a status."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[2.0]))
    answer = resolve(hierarchy, "daqp-hierarchy")
    assert answer.status in (Status.INFEASIBLE, Status.FAILED)
    assert np.isnan(answer.x).all()
