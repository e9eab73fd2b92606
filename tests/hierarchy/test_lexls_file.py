"""Files of LexLS: what they hold is loaded, and what is wrong in them is named."""

from pathlib import Path

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.resolver.registry import resolve

SOLVERS = ("daqp", "clarabel", "proxqp", "quadprog", "piqp")
FILE = Path(__file__).parent / "data" / "two_levels.dat"


def test_a_file_of_lexls_is_loaded_number_by_number() -> None:
    """Simple bounds first are the box, the narrower of two; 1e30 is no bound; rows keep their order."""
    loaded = Hierarchy.load(FILE)
    np.testing.assert_array_equal(loaded.box_lower, [-1.0, -np.inf, 0.5])
    np.testing.assert_array_equal(loaded.box_upper, [0.75, np.inf, 0.5])
    np.testing.assert_array_equal(loaded.A, [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    np.testing.assert_array_equal(loaded.lower, [2.0, 5.0, -np.inf])
    np.testing.assert_array_equal(loaded.upper, [2.0, 5.0, 0.25])
    assert loaded.layout.level_count == 2
    np.testing.assert_array_equal(loaded.norm, np.ones(3))


@pytest.mark.parametrize("name", ["active-set", *(f"hqp/{solver}" for solver in SOLVERS)])
def test_its_optimum_is_found(name: str) -> None:
    """x₁ ≤ 0.75 stops the second level, and x₂ = 2 − x₁ keeps the first one: by hand."""
    np.testing.assert_allclose(resolve(Hierarchy.load(FILE), name).x, [0.75, 1.25, 0.5], atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("210", "30", "#HierType must be 210, rows with a guess, got 30"),
        ("#nVar\n3", "#nVar\n3.5", r"#nVar must hold 1 integers, got \[3.5\]"),
        ("3 1 2", "3 1", "#nCtr must hold 3 integers"),
        ("100 200 200", "100 200 300", "#ObjType must be 100 or 200, got 300"),
        ("#OBJECTIVE 2", "#OBJECTIVE 7", "it has no block #OBJECTIVE 2"),
        (" 3  0.5  0.5  3\n", "", "#OBJECTIVE 0 must have 3 lines of 4 numbers, got 2 of"),
        (" 3  0.5", " 4  0.5", "#OBJECTIVE 0 must bound unknowns 1 to 3"),
        ("1.0  1.0  0.0  2.0", "1.0  one  0.0  2.0", "line 24: could not convert string to float: 'one'"),
        ("0.25  0", "nan  0", "NaN"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(old: str, new: str, message: str, tmp_path: Path) -> None:
    """Each fault is one clear error."""
    text = FILE.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "wrong.dat"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InvalidValue, match=message):
        Hierarchy.load(path)
