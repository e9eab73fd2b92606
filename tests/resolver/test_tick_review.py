"""The second look: errors are found, differences have their cause, and nothing is blamed wrongly."""

import numpy as np
import pytest

from taskopt.hierarchy.damping import Chiaverini
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.registry import resolve
from taskopt.resolver.tick_review import TickReview
from taskopt.resolver.transpose import Transpose
from tests.helpers.oracles import lexicographic_optimum, random_hierarchy
from tests.helpers.spectrum import jacobian

SOLVING = ["active-set", "hqp/daqp", "hqp/clarabel", "hqp/highs", "wqp/daqp", "wqp/proxqp"]


def stack(bound: float, smallest: float = 0.1) -> Hierarchy:
    """A hand above a posture, inside ±bound."""
    rng = np.random.default_rng(8)
    return Hierarchy(
        [Level(jacobian(8, smallest), rng.normal(size=6)), Level(np.eye(7), rng.normal(size=7))],
        box=(np.full(7, -bound), np.full(7, bound)),
    )


def kinds(resolution: Resolution) -> set[str]:
    """Of all causes."""
    assert resolution.review is not None
    return {cause.kind for cause in resolution.review.causes}


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLVING)
def test_the_error_is_that_to_the_exact_optimum(name: str) -> None:
    """Against rational arithmetic: nothing passes that is further off than was asked for, none is accused."""
    for seed in range(60):
        resolution = resolve(random_hierarchy(seed), name)
        if not resolution.claimed:
            continue
        exact = lexicographic_optimum(resolution.problem)
        off = np.abs(resolution.x - exact).max() / max(1e-6, np.abs(exact).max())
        error = np.nan if resolution.review is None else resolution.review.error
        assert (error <= 1e-8) is bool(off <= 1e-8) or 0.99e-8 < off < 1.01e-8


@pytest.mark.parametrize("name", SOLVING)
def test_where_nothing_binds_there_is_no_cause(name: str) -> None:
    """The answer is the closed form, so nothing keeps them apart; a coarse solver is blamed itself."""
    resolution = resolve(stack(1e3), name)
    assert resolution.review is not None
    assert resolution.review.difference < 1e-6
    assert kinds(resolution) <= ({"accuracy"} if name == "hqp/highs" else set())


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "wqp/daqp"])
def test_limits_that_bind_are_the_cause_by_name(name: str) -> None:
    """The causes are all limits that have a multiplier, with their side, and nothing else."""
    resolution = resolve(stack(0.5), name)
    assert resolution.review is not None
    assert kinds(resolution) == {"limit"}
    named = {str(cause) for cause in resolution.review.causes}
    assert named == {str(active) for active in resolution.active if active.multiplier != 0.0}
    assert f"because of {resolution.active[0]}" in resolution.explain()


def test_an_answer_that_is_off_blames_the_solver() -> None:
    """A lie of 1e-6 in one velocity is found, with its size."""
    honest = resolve(stack(1e3), "hqp/daqp")
    answer = honest.answer.copy()
    answer[2] += 1e-6
    lie = Resolution(honest.source, answer, honest.state, honest.status, 0, TickReview)
    assert lie.certificate.verdict is Verdict.REFUTED
    assert kinds(lie) == {"accuracy"}
    assert lie.review is not None
    assert lie.review.error == pytest.approx(1e-6 / np.abs(honest.x).max(), rel=1e-3)


def test_damping_and_rank_have_names_of_their_own() -> None:
    """Damped near a singularity: damping; with a direction near the threshold and an answer off: rank."""
    damped, _ = DampedLeastSquares(Chiaverini())(stack(1e3, smallest=1e-2))
    assert kinds(damped) == {"damping"}
    honest = resolve(stack(1e12, smallest=1e-9), "active-set")
    answer = honest.answer.copy()
    answer[:7] *= 0.5
    assert kinds(Resolution(honest.source, answer, honest.state, honest.status, 0, TickReview)) == {"rank"}


def test_a_formula_that_solves_nothing_is_blamed_itself() -> None:
    """The transposed Jacobian is no solver that is inaccurate: the cause is its formula."""
    rng = np.random.default_rng(9)
    resolution, _ = Transpose()(Hierarchy([Level(rng.normal(size=(2, 3)), rng.normal(size=2))]))
    assert kinds(resolution) == {"formula"}
    assert "because of a formula that does not solve the problem" in resolution.explain()


def test_a_closed_form_is_its_own_measure() -> None:
    """It has no error, no cause, and claims nothing; brakes aim at no optimum at all."""
    formula, _ = PseudoInverse()(stack(0.5))
    assert formula.review is not None
    assert np.isnan(formula.review.error)
    assert formula.review.difference == 0.0
    assert not formula.claimed
    assert kinds(formula) == set()
    braked = formula.replaced(Status.BRAKED)
    assert braked.review is not None
    assert np.isnan(braked.review.error)


def test_a_resolution_without_a_reviewer_says_what_it_knows() -> None:
    """No ranks, no closed form; the rest is told as ever."""
    honest = resolve(stack(0.5), "hqp/daqp")
    bare = Resolution(honest.source, honest.answer, honest.state, honest.status)
    assert bare.review is None
    assert bare.proven
    assert "Held back by:" in bare.explain()
    assert "Closed form" not in bare.explain()
