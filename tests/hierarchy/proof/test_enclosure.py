"""What is computed in enclosures contains the exact result, which fractions tell."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.hierarchy.proof.coupling import coupled
from taskopt.hierarchy.proof.double_double import two_product, two_sum
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.proof.exact_span import ExactSpan
from taskopt.hierarchy.proof.linear import inverse

SEEDS = st.integers(0, 2**32 - 1)
NUMBERS = st.floats(-1e20, 1e20).map(lambda v: v if abs(v) > 1e-20 else 0.0)


def fractions(matrix: Array) -> list[list[Fraction]]:
    return [[Fraction(float(v)) for v in line] for line in matrix]


def product(a: list[list[Fraction]], b: list[list[Fraction]]) -> list[list[Fraction]]:
    return [
        [sum((x * y for x, y in zip(line, col, strict=True)), Fraction(0)) for col in zip(*b, strict=True)]
        for line in a
    ]


def contains(found: Enclosure, exact: list[list[Fraction]]) -> bool:
    high, low, radius = found.parts
    return all(
        abs(Fraction(float(high[i, j])) + Fraction(float(low[i, j])) - value) <= Fraction(float(radius[i, j]))
        for i, line in enumerate(exact)
        for j, value in enumerate(line)
    )


def random_matrix(rng: np.random.Generator, m: int, p: int) -> Array:
    return rng.standard_normal((m, p)) * 10.0 ** rng.integers(-8, 9, (m, p))


@pytest.mark.slow
@given(NUMBERS, NUMBERS)
@settings(deadline=None)
def test_errors_of_sums_and_products_are_exact(a: float, b: float) -> None:
    """The compiled operations are those that are written: a compiler that simplifies them loses the error."""
    s, e = two_sum(a, b)
    assert Fraction(s) + Fraction(e) == Fraction(a) + Fraction(b)
    p, e = two_product(a, b)
    assert Fraction(p) + Fraction(e) == Fraction(a) * Fraction(b)


@given(SEEDS)
@settings(deadline=None, max_examples=50)
def test_sums_and_products_are_enclosed_tightly(seed: int) -> None:
    """Chains of operations contain the exact result, within 1e-28 of their largest terms."""
    rng = np.random.default_rng(seed)
    A, B, C = random_matrix(rng, 3, 4), random_matrix(rng, 4, 2), random_matrix(rng, 3, 2)
    found = (A @ Enclosure.exact(B) - C) * C
    AB, c = product(fractions(A), fractions(B)), fractions(C)
    exact = [[(x - y) * y for x, y in zip(*lines, strict=True)] for lines in zip(AB, c, strict=True)]
    assert contains(found, exact)
    size = (np.abs(A) @ np.abs(B) + np.abs(C)) * np.abs(C)
    assert (found.parts[2] <= 1e-28 * size).all()
    planted = [
        [value + Fraction(1, 10**20) * Fraction(float(size.max())) for value in line] for line in exact
    ]
    assert not contains(found, planted)


@given(SEEDS)
@settings(deadline=None, max_examples=30)
def test_an_inverse_is_enclosed(seed: int) -> None:
    """M V contains the identity, and the enclosed inverse contains the exact one, by Cramer's rule."""
    rng = np.random.default_rng(seed)
    M = rng.standard_normal((2, 2))
    M[1] = M[0] * rng.standard_normal() + 10.0 ** rng.uniform(-8.0, 0.0) * M[1]
    found = inverse(M)
    assert found is not None
    (a, b), (c, d) = fractions(M)
    determinant = a * d - b * c
    exact = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]]
    assert contains(found, exact)
    assert (found.parts[2] <= 1e-18 * np.abs(found.middle).max()).all()


def test_a_singular_matrix_has_no_inverse() -> None:
    """Neither has one that is singular up to rounding."""
    assert inverse(np.array([[1.0, 2.0], [2.0, 4.0]])) is None
    assert inverse(np.array([[1.0, 1.0 / 3.0], [3.0, 1.0]])) is None


def test_dependence_is_decided_exactly() -> None:
    """0.1 + 0.2 rounds in doubles, while 4 · 0.1 does not."""
    span = ExactSpan()
    span.add(0, np.array([0.1, 1.0, 0.0]), 1.0)
    span.add(1, np.array([0.2, 0.0, 0.5]), 2.0)
    assert span.dependence(2, np.array([0.1 + 0.2, 1.0, 0.5]), 3.0)[0] is False
    assert span.dependence(2, np.array([0.4, 4.0, 0.0]), 4.0)[:2] == (True, True)
    depends, agrees, others = span.dependence(2, np.array([0.4, 0.0, 1.0]), 4.5)
    assert (depends, agrees, others) == (True, False, [1])


@given(SEEDS)
@settings(deadline=None, max_examples=50)
def test_coefficients_that_are_called_zero_are_zero(seed: int) -> None:
    """Random combinations of sparse rows: where a coefficient is not zero, the rows are coupled."""
    rng = np.random.default_rng(seed)
    n, r = 6, int(rng.integers(1, 6))
    basis = rng.integers(-2, 3, (r, n)) * (rng.random((r, n)) < 0.3)
    basis = basis.astype(float)
    if np.linalg.matrix_rank(basis) < r:
        return
    combination = rng.integers(-1, 2, (4, r)).astype(float)
    possible = coupled(basis, combination @ basis)
    assert possible[combination != 0.0].all()


def test_rows_that_share_nothing_are_not_coupled() -> None:
    """x₀ is fixed, and rows on x₁, x₂ and on x₃ remain: a row on x₀, x₁, x₂ needs the last one never."""
    basis = np.array([[1.0, 0, 0, 0], [5.0, 1, 1, 0], [7.0, 0, 0, 2], [0.0, 1, -1, 0]])
    assert coupled(basis, np.array([[0.0, 1, 3, 0]])).tolist() == [[True, True, False, True]]
