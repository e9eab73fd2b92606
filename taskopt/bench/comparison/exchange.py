"""Quadratic programs of other collections as hierarchies, and hierarchies as programs for qpbenchmark.

Programs are min ½ xᵀ P x + qᵀ x subject to G x ≤ h, A x = b and lb ≤ x ≤ ub. Parquet files of
qpbenchmark have one in each row; a file that `qpsolvers.Problem.save` wrote has one.

Source: Caron et al., qpbenchmark and qpsolvers, software, Apache-2.0 and LGPL-3.0, whose formats these are.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.comparison.problem_set import ProblemSet, make_set
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.qp import QuadraticProgram
from taskopt.hierarchy.tolerances import FIT_RANK
from taskopt.recording.columns import read_parquet, write_parquet
from taskopt.resolver.one_level import orthogonal_program
from taskopt.resolver.weighted import weighted_problem
from taskopt.solver.one_sided import one_sided

KEYS = ("P", "q", "G", "h", "A", "b", "lb", "ub")
_CLASS = '''"""The problem set {name} of taskopt, for qpbenchmark: qpbenchmark {file} run"""

from pathlib import Path

from qpbenchmark import ParquetTestSet


class {title}(ParquetTestSet):
    """Programs that wqp/ hands to its solver, before scaling."""

    description = {about!r}
    sparse_only = False
    title = "{name}"

    def __init__(self) -> None:
        super().__init__(Path(__file__).with_suffix(".parquet"))
'''


def load_parquet(path: Path) -> ProblemSet:
    """Read a Parquet file of qpbenchmark.

    Args:
        path: The file.

    Returns:
        A set with a sequence of one problem for each program.

    Raises:
        InvalidValue: It is not such a file, or a program cannot be a hierarchy, see `hierarchy_of`.
    """
    try:
        columns = read_parquet(path)
        rows = [
            {key: columns[key][index] for key in (*KEYS, "name")} for index in range(len(columns["name"]))
        ]
    except (KeyError, OSError, ValueError) as error:
        raise InvalidValue(
            f"{path} is not a Parquet file of qpbenchmark, which has the columns {', '.join(KEYS)} and name: "
            f"{error}"
        ) from error
    problems = [hierarchy_of(row, f"{path.name}, {row['name']}") for row in rows]
    return make_set(path.stem, problems, f"The programs of qpbenchmark's file {path.name}.")


def is_program(path: Path) -> bool:
    """Return True if a file is an archive with the parts P and q, as qpsolvers writes it.

    Args:
        path: An existing file.

    Returns:
        True for a program, complete or not.
    """
    if not is_zipfile(path):
        return False
    with ZipFile(path) as archive:
        return {"P.npy", "q.npy"} <= set(archive.namelist())


def load_program(path: Path) -> ProblemSet:
    """Read a file that `qpsolvers.Problem.save` wrote.

    Args:
        path: The file, .npz.

    Returns:
        A set of one problem.

    Raises:
        InvalidValue: A part of the program is missing, or it cannot be a hierarchy, see `hierarchy_of`.
    """
    with np.load(path, allow_pickle=False) as file:
        absent = [key for key in KEYS if key not in file]
        if absent:
            raise InvalidValue(f"{path} has no {', '.join(absent)}, which qpsolvers.Problem.save writes")
        program = {key: _numbers(file, key) for key in KEYS}
    return make_set(path.stem, [hierarchy_of(program, path.name)], f"The program of the file {path.name}.")


def _numbers(file: Any, key: str) -> Array | None:
    """Return an array of a file; None if it is pickled, as qpsolvers writes None."""
    try:
        return np.asarray(file[key], dtype=np.float64)
    except ValueError:  # nothing is unpickled
        return None


def hierarchy_of(program: Mapping[str, Any], where: str = "the program") -> Hierarchy:
    """State a program as a hierarchy of one level, ½ ‖√Λ Vᵀ x + Λ^(−½) Vᵀ q‖² with P = V Λ Vᵀ.

    Args:
        program: P, q, G, h, A, b, lb and ub, dense, matrices also as flat arrays; None for what there is not.
        where: Name of the program in messages.

    Returns:
        The hierarchy. Where P has directions without curvature, its answer is the least of all optima.

    Raises:
        InvalidValue: P is not convex, or the cost falls for ever in a direction without curvature.
    """
    q = np.array(program["q"], dtype=np.float64).reshape(-1)
    n = len(q)
    P, G, A = (_matrix(program[key], n) for key in ("P", "G", "A"))
    curvature, V = np.linalg.eigh(P)
    least = FIT_RANK * max(float(curvature.max(initial=0.0)), float(np.finfo(np.float64).tiny))
    if curvature.min(initial=0.0) < -least:
        raise InvalidValue(
            f"{where} is not convex: P has the eigenvalue {curvature.min():.2g}; leave it out of the file"
        )
    V, root = V[:, curvature > least], np.sqrt(curvature[curvature > least])
    slope = float(np.abs(q - V @ (V.T @ q)).max(initial=0.0))
    if slope > FIT_RANK * max(1.0, float(np.abs(q).max(initial=0.0))):
        raise InvalidValue(
            f"{where} has a linear cost of {slope:.2g} in a direction without curvature, which no level of "
            "least squares has; add a small multiple of the identity to P, or leave it out of the file"
        )
    h, b = (_side(program[key], len(rows)) for key, rows in (("h", G), ("b", A)))
    limits = Level(
        np.vstack([A, G]), lower=np.concatenate([b, np.full(len(h), -np.inf)]), upper=np.concatenate([b, h])
    )
    lower = np.full(n, -np.inf) if program["lb"] is None else np.asarray(program["lb"], dtype=np.float64)
    upper = np.full(n, np.inf) if program["ub"] is None else np.asarray(program["ub"], dtype=np.float64)
    return Hierarchy([Level(root[:, None] * V.T, -(V.T @ q) / root)], (lower, upper), limits)


def program_of(problem: Hierarchy) -> dict[str, Array | None]:
    """State the program that `wqp/` hands to its solver, before scaling.

    Args:
        problem: Any hierarchy; its levels are weighted as `taskopt.resolver.weighted.weighted_problem` says.

    Returns:
        P, q, G, h, A, b, lb and ub. Its unknowns are R x and a slack for each inequality of a level, see
        `taskopt.resolver.one_level.orthogonal_program`.
    """
    return _plain(orthogonal_program(weighted_problem(problem))[0])


def export(problems: ProblemSet, path: Path) -> tuple[Path, Path]:
    """Write a set as a Parquet file and a test set for qpbenchmark.

    Args:
        problems: The set.
        path: The Parquet file; the name of the other one differs in its ending, .py.

    Returns:
        Both files. `qpbenchmark FILE.py run` runs the set.

    Raises:
        InvalidValue: The name of the file cannot be the name of a Python module, which qpbenchmark imports.
    """
    if not path.stem.isidentifier() or path.suffix != ".parquet":
        raise InvalidValue(
            f"qpbenchmark imports the test set as a Python module, so that '{path.name}' must be a name of "
            "letters, digits and _, followed by .parquet; take another one, such as my_set.parquet"
        )
    columns: dict[str, list[Any]] = {key: [] for key in (*KEYS, "name")}
    for sequence in problems.sequences:
        for index, problem in enumerate(sequence.problems):
            columns["name"].append(f"{sequence.name} {index}")
            for key, value in program_of(problem).items():
                columns[key].append(None if value is None else value.ravel())
    write_parquet(path, {key: _objects(column) for key, column in columns.items()})
    script = path.with_suffix(".py")
    title = path.stem.title().replace("_", "")
    text = _CLASS.format(name=problems.name, file=script.name, title=title, about=problems.description)
    script.write_text(text, encoding="utf-8")
    return path, script


def _plain(qp: QuadraticProgram) -> dict[str, Array | None]:
    """Return a program in one-sided rows; its box is open."""
    rows = one_sided(qp.C, qp.lower, qp.upper)
    above, equal = len(rows.h) > 0, len(rows.b) > 0
    return {
        "P": qp.H, "q": qp.g, "G": rows.G if above else None, "h": rows.h if above else None,
        "A": rows.A if equal else None, "b": rows.b if equal else None, "lb": None, "ub": None,
    }  # fmt: skip


def _objects(column: Iterable[Any]) -> np.ndarray:
    """Return a column of arrays of any lengths."""
    entries = list(column)
    made = np.empty(len(entries), dtype=object)
    for index, entry in enumerate(entries):  # a slice would make a matrix of arrays of one length
        made[index] = entry
    return made


def _matrix(value: Any, n: int) -> Array:
    """Return a matrix with n columns, without rows if there is none."""
    return np.zeros((0, n)) if value is None else np.array(value, dtype=np.float64).reshape(-1, n)


def _side(value: Any, count: int) -> Array:
    """Return a right-hand side."""
    return np.zeros(count) if value is None else np.array(value, dtype=np.float64).reshape(count)
