"""Problem sets: their files, checksums and families."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from taskopt.bench.comparison.catalogue import GENERATED, RECORDED, Generated, problem_set, set_names
from taskopt.bench.comparison.families import near_singular, random_levels
from taskopt.bench.comparison.problem_set import ProblemSequence, load_set, make_set
from taskopt.errors import InvalidValue, MissingFile, UnknownName
from taskopt.hierarchy.problem import Hierarchy, Level

SMALL = [row.name for row in GENERATED if not row.name.startswith("random")]


def some_problem(right: float = 1.0) -> Hierarchy:
    return Hierarchy([Level([[1.0, 2.0]], [right]), Level(np.eye(2), [0.0, 1.0])], box=([-1, -1], [1, 1]))


def feasible(problem: Hierarchy) -> bool:
    """Whether SciPy's linear programming finds a point inside the hard limits."""
    limits, box = problem.limits, np.column_stack([problem.box_lower, problem.box_upper])
    A = np.vstack([limits.A, -limits.A])
    b = np.concatenate([limits.upper, -limits.lower])
    kept = np.isfinite(b)
    return linprog(np.zeros(problem.n), A[kept], b[kept], bounds=box).status == 0


def test_a_file_gives_back_every_bit(tmp_path: Path) -> None:
    """Numbers, names, order, description and checksum survive."""
    made = make_set("mine", [ProblemSequence("a", (some_problem(), some_problem(1.0 / 3.0)))], "two", 3)
    made.save(tmp_path / "mine.npz")
    read = load_set(tmp_path / "mine.npz")
    assert (read.name, read.version, read.description, read.checksum) == ("mine", 3, "two", made.checksum)
    for one, other in zip(made.sequences[0].problems, read.sequences[0].problems, strict=True):
        np.testing.assert_array_equal(one.buffer, other.buffer)
        assert one.layout == other.layout


def test_one_bit_changes_the_checksum() -> None:
    """The next number after 1 is enough, and so is another name."""
    sums = {
        make_set("a", [problem]).checksum
        for problem in (some_problem(), some_problem(np.nextafter(1.0, 2.0)))
    }
    renamed = make_set("a", [ProblemSequence("b", (some_problem(),))]).checksum
    assert len(sums | {renamed}) == 3


def test_a_changed_file_is_refused(tmp_path: Path) -> None:
    """A number that somebody changed is noticed by the checksum."""
    make_set("mine", [some_problem()]).save(tmp_path / "mine.npz")
    with np.load(tmp_path / "mine.npz") as file:
        numbers = dict(file)
    numbers["buffers 0"][0, 0] += 1e-15
    np.savez(tmp_path / "mine.npz", **numbers)
    with pytest.raises(InvalidValue, match="damaged or was changed"):
        load_set(tmp_path / "mine.npz")


def test_files_of_single_hierarchies_are_sets(tmp_path: Path) -> None:
    """A file that `Hierarchy.save` wrote is a set of one problem; others are refused by name."""
    some_problem().save(tmp_path / "one.npz")
    assert load_set(tmp_path / "one.npz").count == 1
    (tmp_path / "text.npz").write_text("nothing")
    with pytest.raises(InvalidValue, match="not a problem set"):
        load_set(tmp_path / "text.npz")
    with pytest.raises(MissingFile, match="taskopt bench sets"):
        load_set(tmp_path / "none.npz")


def test_a_sequence_has_one_layout() -> None:
    """Problems of another size are refused."""
    other = Hierarchy([Level(np.eye(2), [0.0, 1.0])])
    with pytest.raises(InvalidValue, match="problem 1 has another layout"):
        ProblemSequence("a", (some_problem(), other))
    with pytest.raises(InvalidValue, match="each of another name"):
        make_set("a", [ProblemSequence("b", (some_problem(),))] * 2)


@pytest.mark.parametrize("name", SMALL)
def test_generated_sets_are_drawn_as_they_are_filed(name: str) -> None:
    """The checksum is pinned; only the set of contradictions has them, by SciPy's linear programming."""
    found = problem_set(name)
    firsts = [sequence.problems[0] for sequence in found.sequences[:: max(1, len(found.sequences) // 8)]]
    assert {feasible(problem) for problem in firsts} == {name != "contradicting"}


def test_recorded_sets_are_what_they_were() -> None:
    """Every file of the package is whole, under its own name and described."""
    names = [file.stem for file in RECORDED.glob("*.npz")]
    assert len(names) >= 9
    for name in names:
        found = problem_set(name)
        assert found.name == name
        assert found.description.endswith(".")


def test_other_numbers_than_those_of_the_version_are_refused() -> None:
    """A generator that draws otherwise, as another NumPy might, is an error and no other result."""
    row = GENERATED[3]
    changed = Generated(row.name, row.version, "0123", row.description, row.draw)
    with pytest.raises(InvalidValue, match="must have the checksum 0123"):
        changed.make()
    with pytest.raises(UnknownName, match="did you mean near-singular"):
        problem_set("near-singula")
    assert "random-80" not in set_names(large=False)


def test_ranks_are_exact() -> None:
    """A level of random rank has that rank to rounding, and some level has less rank than rows."""
    (sequence,) = random_levels(12, 1, 2)
    ratios, lacking = [], 0
    for level in sequence.problems[1].levels:
        sigma = np.linalg.svd(level.A, compute_uv=False)
        rank = int((sigma > 1e-3 * sigma[0]).sum())
        ratios += (sigma[rank:] / sigma[0]).tolist()
        lacking += rank < len(sigma)
    assert lacking
    assert max(ratios) < 1e-14


def test_near_singular_rows_have_the_singular_value_that_they_are_filed_under() -> None:
    """The smallest one is 2^−e up to a factor of ten."""
    for sequence in near_singular((4, 12), 2):
        exponent = int(sequence.name.removeprefix("2^-"))
        for problem in sequence.problems:
            smallest = np.linalg.svd(problem.levels[0].A, compute_uv=False)[-1]
            assert 0.1 < smallest * 2.0**exponent < 10.0
