"""Programs of other collections and for qpbenchmark, and problems of a log: the same numbers come back."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import qpsolvers

from taskopt import Controller, JointTask, PositionTask, Stack, open_log, planar_arm
from taskopt.bench.comparison.capture import capture_log
from taskopt.bench.comparison.catalogue import problem_set
from taskopt.bench.comparison.exchange import KEYS, export, hierarchy_of, load_parquet, program_of
from taskopt.bench.comparison.problem_set import make_set
from taskopt.errors import InvalidValue
from taskopt.resolver.one_level import orthogonal_program
from taskopt.resolver.registry import resolve
from taskopt.resolver.weighted import weighted_problem
from taskopt.resolver.weighted_kernels import unknowns_of
from taskopt.testing.resolver import random_hierarchy


def program(seed: int) -> dict[str, Any]:
    """A random program with all its parts, of which x = 0 keeps the inequalities."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 5))
    return {
        "P": root.T @ root, "q": rng.normal(size=5), "G": rng.normal(size=(3, 5)), "h": rng.uniform(0, 1, 3),
        "A": rng.normal(size=(1, 5)), "b": np.zeros(1), "lb": np.full(5, -0.7), "ub": np.full(5, np.inf),
    }  # fmt: skip


def optimum(parts: dict[str, Any]) -> np.ndarray:
    """By quadprog, which is handed the program as it is."""
    found = qpsolvers.solve_problem(qpsolvers.Problem(**parts), "quadprog")
    assert found.x is not None
    return found.x


def test_a_program_as_a_hierarchy_has_the_same_optimum() -> None:
    """With all parts, and with none but P and q."""
    for seed in range(10):
        parts = program(seed)
        np.testing.assert_allclose(resolve(hierarchy_of(parts)).x, optimum(parts), atol=1e-9)
    bare = dict.fromkeys(KEYS) | {"P": parts["P"], "q": parts["q"]}
    np.testing.assert_allclose(
        resolve(hierarchy_of(bare)).x, -np.linalg.solve(bare["P"], bare["q"]), atol=1e-9
    )


def test_what_is_no_least_squares_is_refused() -> None:
    """P that is not convex, and a cost that falls for ever; a flat direction without cost is none."""
    parts = program(0)
    with pytest.raises(InvalidValue, match="is not convex: P has the eigenvalue -1"):
        hierarchy_of(parts | {"P": np.diag([1.0, 1.0, 1.0, 1.0, -1.0])})
    flat = np.diag([1.0, 1.0, 1.0, 1.0, 0.0])
    with pytest.raises(InvalidValue, match="linear cost of 2 in a direction without curvature"):
        hierarchy_of(parts | {"P": flat, "q": np.array([0, 0, 0, 0, 2.0])})
    free = dict.fromkeys(KEYS) | {"P": flat, "q": np.array([1.0, 0, 0, 0, 0])}
    np.testing.assert_allclose(resolve(hierarchy_of(free)).x, [-1, 0, 0, 0, 0], atol=1e-12)


def test_a_file_of_qpsolvers_is_a_set(tmp_path: Path) -> None:
    """Complete, and without inequalities, which qpsolvers writes as a pickled None."""
    whole, part = program(1), {"P": np.eye(2), "q": np.array([1.0, -2.0])}
    qpsolvers.Problem(**whole).save(str(tmp_path / "whole.npz"))
    qpsolvers.Problem(**part).save(str(tmp_path / "part.npz"))
    for name, parts in (("whole", whole), ("part", part)):
        found = problem_set(str(tmp_path / f"{name}.npz"))
        assert (found.name, found.count) == (name, 1)
        np.testing.assert_allclose(resolve(found.sequences[0].problems[0]).x, optimum(parts), atol=1e-9)


def test_what_is_exported_is_read_again(tmp_path: Path) -> None:
    """Parquet and back: the optimum of each program is that of `wqp/`, in the unknowns of the program."""
    problems = [random_hierarchy(seed) for seed in range(4)]
    path, script = export(make_set("mine", problems, "Some."), tmp_path / "some_set.parquet")
    assert "class SomeSet(ParquetTestSet)" in script.read_text(encoding="utf-8")
    compile(script.read_text(encoding="utf-8"), script.name, "exec")
    for name in (str(path), path):
        read = problem_set(name) if isinstance(name, str) else load_parquet(name)
        assert [one.problems[0].layout.level_count for one in read.sequences] == [1] * 4
    for problem, sequence in zip(problems, read.sequences, strict=True):
        u = resolve(sequence.problems[0]).x[: problem.n]
        _, B, diagonal = orthogonal_program(weighted_problem(problem))
        x = unknowns_of(B, diagonal, u)
        np.testing.assert_allclose(x, resolve(problem, "wqp/daqp").x, atol=1e-8)


def test_names_and_files_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    """A name that Python cannot import, and a Parquet file of something else."""
    with pytest.raises(InvalidValue, match="letters, digits and _"):
        export(make_set("a", [random_hierarchy(0)]), tmp_path / "four-levels.parquet")
    (tmp_path / "text.parquet").write_text("nothing")
    with pytest.raises(InvalidValue, match="not a Parquet file of qpbenchmark"):
        problem_set(str(tmp_path / "text.parquet"))


@pytest.mark.slow
def test_problems_of_a_log_are_those_of_the_loop(tmp_path: Path) -> None:
    """To the last bit; ticks that are not there are refused."""
    arm, path = planar_arm([0.5, 0.4, 0.3]), tmp_path / "run.arrow"
    hand = PositionTask("tip", target=(0.2, 0.9, 0.0), gain=10.0, axes="xy", name="hand")
    control = Controller(arm, Stack([[hand], [JointTask(gain=1.0)]]), dt=0.01, log=path)
    q, buffers = np.array([0.3, 0.8, -0.5]), []
    for k in range(12):
        answer = control.step(q, k * 0.01)
        buffers.append(answer.problem.buffer.copy())
        q = arm.integrate(q, answer.v, 0.01)
    control.log.close()
    sequence = capture_log(path, first=2, ticks=8)
    assert sequence.name == "run, ticks 2 to 9"
    np.testing.assert_array_equal([one.buffer for one in sequence.problems], buffers[2:10])
    make_set("mine", [sequence]).save(tmp_path / "mine.npz")
    assert problem_set(str(tmp_path / "mine.npz")).count == 8
    with pytest.raises(InvalidValue, match="ticks 5 to 14 are not in"):
        capture_log(path, first=5, ticks=10)
    assert len(open_log(path)) == 12


def residuals(parts: dict[str, Any], x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[float, float]:
    """Primal and dual residual of a program in one-sided rows."""
    G, h = np.zeros((0, len(x))) if parts["G"] is None else parts["G"], parts["h"]
    A, b = np.zeros((0, len(x))) if parts["A"] is None else parts["A"], parts["b"]
    primal = max([0.0, *(G @ x - (0.0 if h is None else h)), *np.abs(A @ x - (0.0 if b is None else b))])
    return primal, float(np.abs(parts["P"] @ x + parts["q"] + G.T @ z + A.T @ y).max())


_RUN = """
import sys
from qpbenchmark import Results, run
results = Results("results.csv", ours)
for name in sys.argv[1:]:
    run(ours, results, only_solver=name, only_settings="default")
results.write()
"""


@pytest.mark.slow
def test_qpbenchmark_runs_an_exported_set_and_finds_our_residuals(tmp_path: Path) -> None:
    """Three solvers at default tolerances, so that residuals are far above rounding."""
    pytest.importorskip("qpbenchmark")
    problems = list(problem_set("velocity-bounds").sequences[0].problems[:2])
    export(make_set("bounds", problems), tmp_path / "bounds.parquet")
    solvers = ("osqp", "scs", "proxqp")
    command = f"from bounds import Bounds; ours = Bounds()\n{_RUN}"
    subprocess.run([sys.executable, "-c", command, *solvers], cwd=tmp_path, check=True, capture_output=True)
    lines = [line.split(",") for line in (tmp_path / "results.csv").read_text(encoding="utf-8").splitlines()]
    place = {name: lines[0].index(name) for name in ("problem", "solver", "primal_residual", "dual_residual")}
    theirs = {
        (line[place["problem"]], line[place["solver"]]): (
            float(line[place["primal_residual"]]), float(line[place["dual_residual"]])
        )
        for line in lines[1:]
    }  # fmt: skip
    assert len(theirs) == len(problems) * len(solvers)
    for index, problem in enumerate(problems):
        parts = program_of(problem)
        for name in solvers:
            found = qpsolvers.solve_problem(qpsolvers.Problem(**parts), name)  # type: ignore[arg-type]
            y, z = (np.zeros(0) if one is None else one for one in (found.y, found.z))
            ours = residuals(parts, found.x, y, z)  # type: ignore[arg-type]
            np.testing.assert_allclose(theirs[f"problem {index} 0", name], ours, rtol=0.05, atol=1e-13)
            assert max(ours) > 1e-12
