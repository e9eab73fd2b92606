"""The transposed Jacobian: its formula, where it is stuck, and how large its gain may be."""

import numpy as np
import pytest

from taskopt import Hierarchy, InvalidValue, Level, Status, Transpose
from taskopt.resolver.transpose import is_stuck, largest_gain
from taskopt.testing import check_resolver


@pytest.mark.figure("3.12")
@pytest.mark.equation("3.76")
def test_it_is_the_transpose_times_the_right_side() -> None:
    """x = Aᵀ diag(w) b, and W⁻¹ times that in another norm."""
    rng = np.random.default_rng(1)
    for norm in (None, np.array([1.0, 4.0, 9.0, 16.0]), np.diag([1.0, 2.0, 3.0, 4.0]) + 0.1):
        A, b, w = rng.normal(size=(2, 4)), rng.normal(size=2), np.array([1.0, 3.0])
        answer, memory = Transpose()(Hierarchy([Level(A, b, weight=w)], norm=norm))
        W = np.eye(4) if norm is None else np.diag(norm) if norm.ndim == 1 else norm
        np.testing.assert_allclose(answer.x, np.linalg.solve(W, A.T @ (w * b)), rtol=1e-12)
        assert answer.status is Status.FORMULA
        assert answer.notes == ()
        assert memory.ranks == ()


def test_it_keeps_the_contract_of_a_resolver() -> None:
    """Status, memory and repeatability, as for every resolver that is not strict."""
    check_resolver(Transpose())


@pytest.mark.equation("3.73", "3.74", "3.75", "3.77")
def test_the_lyapunov_function_falls_as_the_text_says() -> None:
    """V̇ = eᵀK ẋ_d − eᵀK J Jᵀ K e by differences; for a still target it is negative."""
    rng, h = np.random.default_rng(2), 1e-6
    for _ in range(100):
        J, e, rate, K = (
            rng.normal(size=(3, 5)),
            rng.normal(size=3),
            rng.normal(size=3),
            np.diag([1.0, 2.0, 3.0]),
        )
        q_dot = Transpose()(Hierarchy([Level(J, K @ e)]))[0].x
        values = [0.5 * (e + s * (rate - J @ q_dot)) @ K @ (e + s * (rate - J @ q_dot)) for s in (h, -h)]
        expected = e @ K @ rate - e @ K @ J @ J.T @ K @ e
        assert (values[0] - values[1]) / (2.0 * h) == pytest.approx(
            expected, abs=1e-6 * max(1.0, abs(expected))
        )
        assert -e @ K @ J @ J.T @ K @ e < 0.0


@pytest.mark.equation("3.77")
def test_a_stuck_arm_says_so() -> None:
    """K e in N(Jᵀ) gives x = 0 and a note with the names of the rows; a little beside it gives neither."""
    J = np.array([[1.0, 0.0], [0.0, 0.0]])
    stuck = Transpose()(Hierarchy([Level(J, [0.0, 1.0])]))[0]
    np.testing.assert_array_equal(stuck.x, 0.0)
    names = ", ".join(stuck.problem.layout.row_names)
    assert f"stuck: the error of {names} lies in the null space" in stuck.notes[0]
    assert "stuck" in stuck.explain()
    assert "An inverse of J would not move it either" in stuck.notes[0]
    apart = Transpose()(Hierarchy([Level(J[:1], [1.0]), Level(J[:1], [-1.0])]))[
        0
    ]  # the levels cancel each other
    assert "stuck" in apart.notes[0]
    assert "inverse" not in apart.notes[0]
    assert Transpose()(Hierarchy([Level(J, [1e-3, 1.0])]))[0].notes == ()
    assert Transpose()(Hierarchy([Level(J, [0.0, 0.0])]))[0].notes == ()  # at the goal nothing is stuck


def test_stuck_is_a_matter_of_scale() -> None:
    """The decision does not depend on the units of J and e."""
    J = np.array([[1.0, 2.0], [2.0, 4.0]])
    for unit in (1e-6, 1.0, 1e6):
        assert is_stuck(unit * J, [-2.0 / unit, 1.0 / unit])
        assert not is_stuck(unit * J, [-2.0 / unit, 1.1 / unit])


@pytest.mark.equation("3.76")
def test_gains_beyond_the_bound_diverge() -> None:
    """e ← (I − Δt k J Jᵀ) e falls at 0.99 of the bound, and grows at 1.01 of it."""
    J, dt = np.random.default_rng(3).normal(size=(3, 6)), 0.01
    bound = largest_gain(J, dt)
    for share, falls in ((0.99, True), (1.01, False)):
        e = np.linalg.svd(J)[0][:, 0]
        for _ in range(200):
            e = e - dt * J @ Transpose()(Hierarchy([Level(J, share * bound * e)]))[0].x
        assert bool(np.linalg.norm(e) < 0.1) is falls
        assert bool(np.linalg.norm(e) > 5.0) is not falls
    assert largest_gain(np.zeros((2, 2)), dt) == np.inf


@pytest.mark.equation("3.76")
def test_the_bound_holds_for_a_matrix_of_gains() -> None:
    """With K^½ J the answer is 1 where the largest eigenvalue of Δt K J Jᵀ is 2."""
    rng, dt = np.random.default_rng(4), 0.01
    for _ in range(50):
        J, k = rng.normal(size=(3, 5)), rng.uniform(1.0, 100.0, size=3)
        k *= 2.0 / (dt * np.abs(np.linalg.eigvals(np.diag(k) @ J @ J.T)).max())
        assert largest_gain(np.sqrt(k)[:, None] * J, dt) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("hierarchy", "said"),
    [
        (Hierarchy([Level([[1.0]], upper=[1.0])]), "knows no inequality"),
        (Hierarchy([Level([[1.0]], [1.0])], limits=Level([[1.0]], [1.0])), "keeps no hard row"),
    ],
)
def test_what_it_cannot_resolve_is_refused(hierarchy: Hierarchy, said: str) -> None:
    """Inequalities and hard equalities; limits of the joints are passed over as by pinv."""
    with pytest.raises(InvalidValue, match=said):
        Transpose()(hierarchy)


def test_all_levels_pull_together() -> None:
    """A gradient knows no priority: x is the sum of what each level alone would give."""
    one, two = Level([[1.0, 2.0]], [1.0]), Level([[0.0, 3.0]], [2.0], weight=[0.5])
    both = Transpose()(Hierarchy([one, two]))[0].x
    np.testing.assert_allclose(both, sum(Transpose()(Hierarchy([level]))[0].x for level in (one, two)))


def test_limits_are_passed_over() -> None:
    """As pinv does: the answer does not look at the box."""
    answer = Transpose()(Hierarchy([Level([[1.0]], [5.0])], box=([-1.0], [1.0])))[0]
    assert answer.x[0] == 5.0
