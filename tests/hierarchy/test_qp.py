"""A quadratic program is checked once, and can be taken elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from taskopt.errors import Infeasible, InvalidValue, MissingFile
from taskopt.hierarchy.qp import QuadraticProgram


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
