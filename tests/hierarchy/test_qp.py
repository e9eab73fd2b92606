"""A quadratic program is checked once, and can be taken elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from taskopt.errors import Infeasible, InvalidValue, MissingFile
from taskopt.hierarchy.qp import QuadraticProgram, Solution, kkt_residuals
from taskopt.hierarchy.status import Status


def test_what_is_left_out_is_no_row_and_no_bound() -> None:
    """Only H and g: no rows, an open box."""
    qp = QuadraticProgram.checked(np.eye(2), np.zeros(2))
    assert qp.C.shape == (0, 2)
    assert (qp.box_lower == -np.inf).all()
    assert (qp.box_upper == np.inf).all()


def test_a_saved_program_is_read_back_bit_by_bit(tmp_path: Path) -> None:
    """Infinite bounds included, so that a failing program can be solved elsewhere."""
    qp = QuadraticProgram.checked(
        [[2.0, 0.1], [0.1, 1.0]], [1.0, -1.0], [[1.0, 1.0]], [-np.inf], [0.3], [-1.0, -np.inf], [1.0, 2.0]
    )
    qp.save(tmp_path / "failing.npz")
    again = QuadraticProgram.load(tmp_path / "failing.npz")
    for part in ("H", "g", "C", "lower", "upper", "box_lower", "box_upper"):
        np.testing.assert_array_equal(getattr(again, part), getattr(qp, part))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1.0, 2.0], [0.0, 1.0]], [0.0, 0.0]), "H must be symmetric"),
        (([[1.0]], [np.nan]), "g has NaN"),
        (([[1.0]], [0.0, 0.0]), "H must have shape 2×2"),
        (([[1.0]], [0.0], [[1.0, 2.0]]), "C must have shape"),
        (([[1.0]], [0.0], [[1.0]], [0.0, 1.0]), "lower must have shape 1"),
    ],
)
def test_wrong_arrays_are_named(arguments: tuple, message: str) -> None:
    """Each mistake says which array, what was expected and what was got."""
    with pytest.raises(InvalidValue, match=message):
        QuadraticProgram.checked(*arguments)


def test_crossed_bounds_are_infeasible() -> None:
    """lower > upper is named with its row and both values."""
    with pytest.raises(Infeasible, match="row 0: lower 2 exceeds upper 1"):
        QuadraticProgram.checked([[1.0]], [0.0], [[1.0]], [2.0], [1.0])


def test_a_file_that_is_missing_or_something_else_says_so(tmp_path: Path) -> None:
    """No file, and an archive of other arrays."""
    with pytest.raises(MissingFile, match="no quadratic program at"):
        QuadraticProgram.load(tmp_path / "nowhere.npz")
    np.savez(tmp_path / "other.npz", H=np.eye(1))
    with pytest.raises(InvalidValue, match="it lacks g, C"):
        QuadraticProgram.load(tmp_path / "other.npz")


def residuals_of(qp: QuadraticProgram, x: float, y: float) -> tuple[float, float, float, float]:
    """The KKT residuals of a program with one unknown and one row."""
    return kkt_residuals(qp, Solution(np.array([x]), np.array([y]), np.zeros(1), Status.SOLVED))


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6])
@pytest.mark.parametrize(("y", "bound"), [(1.0, "upper"), (-1.0, "lower")])
def test_complementarity_is_relative_to_the_largest_term_of_the_row(
    size: float, y: float, bound: str
) -> None:
    """A multiplier of the size of the gradient, where x = size is 1e-3 size away from its bound: 1e-3."""
    sides = {"lower": [0.999 * size], "upper": [1.001 * size]}
    qp = QuadraticProgram.checked([[0.0]], [-y * size], [[1.0]], **{bound: sides[bound]})
    stationarity, primal, dual, complementarity = residuals_of(qp, size, y * size)
    assert (stationarity, primal, dual) == (0.0, 0.0, 0.0)
    assert complementarity == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize(("y", "distance"), [(1e-7, 1e-7), (1e-7, 1.0), (1.0, 1e-7)])
def test_complementarity_is_the_smaller_of_multiplier_and_distance(y: float, distance: float) -> None:
    """Not the product, which is 1e-14 where both are 1e-7."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], [[1.0]], upper=[distance])
    assert residuals_of(qp, 0.0, y)[3] == pytest.approx(1e-7, rel=1e-9)


@pytest.mark.parametrize("size", [1.0, 1e3])
def test_a_violation_is_relative_to_the_largest_term_of_the_row(size: float) -> None:
    """x = size beyond a bound at 0.999 size is 1e-3."""
    qp = QuadraticProgram.checked([[0.0]], [0.0], [[1.0]], upper=[0.999 * size])
    assert residuals_of(qp, size, 0.0)[1] == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize(("difference", "symmetric"), [(1e-15, True), (1e-9, False)])
def test_a_hessian_is_symmetric_up_to_rounding(difference: float, symmetric: bool) -> None:
    """A relative difference of 1e-15 is rounding, one of 1e-9 is a mistake."""
    H = [[2.0, 1.0], [1.0 + difference, 2.0]]
    if symmetric:
        assert QuadraticProgram.checked(H, [0.0, 0.0]).n == 2
    else:
        with pytest.raises(InvalidValue, match="H must be symmetric"):
            QuadraticProgram.checked(H, [0.0, 0.0])


def test_equal_bounds_are_an_equality_and_not_crossed() -> None:
    """lower = upper is feasible, and counted as an equality."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], [[1.0], [1.0]], [1.0, 0.0], [1.0, 1.0], [0.5], [0.5])
    np.testing.assert_array_equal(qp.equality, [True, False])


@pytest.mark.parametrize("size", [1.0, 1e6])
def test_a_multiplier_is_relative_to_the_largest_term_of_the_gradient(size: float) -> None:
    """A multiplier of 1e-6 size beside a gradient of size, at any distance from its bound: 1e-6."""
    qp = QuadraticProgram.checked([[0.0]], [size], [[1.0]], upper=[1.0])
    assert residuals_of(qp, 0.0, 1e-6 * size)[3] == pytest.approx(1e-6)
