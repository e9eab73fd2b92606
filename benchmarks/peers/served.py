"""The other side of `handed.py`, for an interpreter that has a peer and NumPy, and not this library.

A peer is a script that calls `serve` with two functions: one that builds the stack of a benchmark case, and
one that answers hierarchies that are handed over as rows. Yours joins the same way.
"""

import gc
import json
import os
import sys

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns, thread_time_ns
from types import SimpleNamespace
from typing import Any

import numpy as np

Tick = Callable[[int], Any]
Made = tuple[str, Tick]
CASE, PROBLEMS = "case.json", "problems.json"
RATIO = 1e-3  # between the weights of levels, ½‖x‖² below the last one, for peers that know weights only


def handed_case(folder: Path, solver: str) -> SimpleNamespace:
    """A case as `hand_over` wrote it; `poses` (ticks, 4, 4), `urdf` its path."""
    case = SimpleNamespace(**json.loads((folder / CASE).read_text(encoding="utf-8")))
    case.poses, case.urdf, case.solver = np.load(folder / "poses.npy"), str(folder / "robot.urdf"), solver
    return case


def handed_problems(folder: Path) -> list[SimpleNamespace]:
    """Problems as `hand_over_rows` wrote them.

    Each has `box` (lower, upper), `hard` (A, lower, upper), and `levels`, a list of (A, b).
    """
    text = json.loads((folder / PROBLEMS).read_text(encoding="utf-8"))
    problems = []
    for one in text:
        n = len(one["box"][0])
        hard = [np.array(part, dtype=float) for part in one["hard"]]
        levels = [(np.array(A, dtype=float).reshape(-1, n), np.array(b)) for A, b in one["levels"]]
        box = tuple(np.array(side, dtype=float) for side in one["box"])
        problems.append(SimpleNamespace(box=box, hard=(hard[0].reshape(-1, n), *hard[1:]), levels=levels))
    return problems


def one_sided(one: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
    """The box and the hard rows of a problem as G x ≤ h, without rows that bound nothing."""
    n, (A, lower, upper) = len(one.box[0]), one.hard
    G = np.vstack([np.eye(n), -np.eye(n), A, -A])
    h = np.concatenate([one.box[1], -one.box[0], upper, -lower])
    return G[np.isfinite(h)], h[np.isfinite(h)]


class DeclaredRows:
    """Rows A x = b as a task whose error is −b, for peers that have such a base class of tasks.

    Args:
        A: The rows, (m, n).
        b: Right-hand sides, (m,).
        cost: Root of their weight.
    """

    def __init__(self, A: np.ndarray, b: np.ndarray, cost: float) -> None:
        super().__init__(cost=np.full(len(b), cost))  # type: ignore[call-arg] (that of the peer)
        self.A, self.b = A, b

    def compute_error(self, configuration: object) -> np.ndarray:  # noqa: ARG002 (theirs)
        return -self.b

    def compute_jacobian(self, configuration: object) -> np.ndarray:  # noqa: ARG002 (theirs)
        return self.A


def stated(problems: list[SimpleNamespace], robot: Any, rows: Any, limits: Any) -> list[tuple[Any, Any, Any]]:
    """State problems as a robot, its tasks and its limits, levels by weights, see `RATIO`.

    Args:
        problems: The problems.
        robot: Returns a robot of n slides, at zero.
        rows: The peer's class of `DeclaredRows`.
        limits: The peer's class of limits, made of a problem.
    """
    return [
        (
            robot(len(one.box[0])),
            [rows(A, b, RATIO ** (k / 2)) for k, (A, b) in enumerate(one.levels)],
            [limits(one)],
        )
        for one in problems
    ]


def serve(
    stack: Callable[[SimpleNamespace], Made],
    rows: Callable[[list[SimpleNamespace], str], Made],
    failure: type[Exception],
) -> None:
    """Run the blocks of ticks that are asked for on standard input, and answer with their microseconds.

    The arguments of the process are the folder, the name of a solver, and the clock.

    Args:
        stack: Returns for a case, see `handed_case`, the name of the peer and its tick number i.
        rows: Returns for problems, see `handed_problems`, and a solver the name of the peer, and what answers
            problem number i by x (n,).
        failure: An error that ends a case, and leaves a problem without an answer; the first one is said.
    """
    folder, solver, clock = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    read_clock = thread_time_ns if clock == "cpu" else perf_counter_ns
    of_case = (folder / CASE).exists()
    name, tick = stack(handed_case(folder, solver)) if of_case else rows(handed_problems(folder), solver)
    print(json.dumps(name), flush=True)
    gc.disable()
    gone = said = False
    for line in sys.stdin:
        first, stop = map(int, line.split())
        times, answers = [float("nan")] * (stop - first), []
        for i in range(first, stop):
            if gone:
                break
            begin = read_clock()
            try:
                x = tick(i)
            except failure as error:
                if not said:
                    print(f"{name}, {i}: {type(error).__name__}: {error}"[:200], file=sys.stderr)
                said = True
                gone = of_case  # the next problem does not depend on this one
                x = None
            times[i - first] = (read_clock() - begin) * 1e-3 if not gone else float("nan")
            answers.append(None if of_case or x is None else [float(value) for value in x])
        gc.collect()
        print(json.dumps({"times": times, "answers": answers}), flush=True)
