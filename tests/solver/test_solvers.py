"""Every solver of the table, held to its row: optimum, multipliers, infeasibility, empty parts."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, NotInstalled, UnknownName
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.qp import QuadraticProgram, Solution, kkt_residuals
from taskopt.hierarchy.status import Status
from taskopt.resolver.registry import resolve
from taskopt.solver import qpsolvers, registry
from taskopt.solver.base import Solve
from taskopt.solver.registry import Solver, missing_solvers, register_solver, solver, solvers
from taskopt.testing.solver import check_solver, random_program

INSTALLED = [row for row in solvers() if row.installed]
EXACT = [row for row in INSTALLED if row.accuracy <= 1e-6]


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_optimum_and_multipliers_are_as_accurate_as_the_table_says(engine: Solver, seed: int) -> None:
    """All four KKT residuals, ours, stay below the accuracy in the solver's row."""
    qp = random_program(seed)
    solution = engine(qp)
    assert solution.status is Status.SOLVED
    assert max(kkt_residuals(qp, solution)) < engine.accuracy


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_all_solvers_find_one_optimum(engine: Solver) -> None:
    """A strictly convex program has one optimum, so solvers differ by no more than they promise."""
    other = solver("daqp")
    for seed in range(20):
        qp = random_program(seed)
        apart = np.abs(engine(qp).x - other(qp).x).max()
        assert apart < 1e2 * engine.accuracy / np.linalg.eigvalsh(qp.H)[0]


@pytest.mark.parametrize("engine", INSTALLED, ids=lambda row: row.name)
def test_contradicting_rows_are_never_solved(engine: Solver) -> None:
    """a x ≤ 1 and a x ≥ 1.5: whoever can prove it says INFEASIBLE, nobody says SOLVED."""
    for seed in range(5):
        status = engine(random_program(seed, feasible=False)).status
        assert status is Status.INFEASIBLE if engine.proves_infeasible else status is not Status.SOLVED


@pytest.mark.parametrize("engine", EXACT, ids=lambda row: row.name)
def test_every_solver_keeps_the_contract_of_a_solver(engine: Solver) -> None:
    """Optimum, multipliers and their signs, empty parts, order in memory, no state, honest infeasibility."""
    check_solver(engine, accuracy=engine.accuracy, proves_infeasible=engine.proves_infeasible)


def daqp_but(**wrong: Callable[[Solution], Array]) -> Callable[[QuadraticProgram, float], Solution]:
    """DAQP, with some parts of its solution replaced."""

    def solve(qp: QuadraticProgram, accuracy: float) -> Solution:
        found = solver("daqp")(qp, accuracy)
        return replace(found, **{part: lie(found) for part, lie in wrong.items()})

    return solve


def in_place(qp: QuadraticProgram, accuracy: float) -> Solution:
    """It scales the gradient where it lies."""
    found = solver("daqp")(qp, accuracy)
    qp.g[:] *= 2.0
    return found


class Remembering:
    """It answers with what it found the time before."""

    last: Solution | None = None

    def __call__(self, qp: QuadraticProgram, accuracy: float) -> Solution:
        found = solver("daqp")(qp, accuracy)
        old = self.last
        self.last = replace(found, x=found.x + 1e-3)
        return found if old is None else old


@pytest.mark.parametrize(
    ("lie", "sentence"),
    [
        (daqp_but(x=lambda found: found.x + 1e-6), "of random program 0 is"),
        (daqp_but(y=lambda found: -found.y), "of random program 0 is"),
        (daqp_but(y_box=lambda found: found.y_box[:-1]), r"y_box of shape \(4,\) instead of \(5,\)"),
        (daqp_but(status=lambda found: Status.FAILED), "claims FAILED of random program 0"),
        (daqp_but(status=lambda found: Status.SOLVED), "contradict each other"),
        (in_place, "changed the arrays"),
        (Remembering(), "solved a second time"),
    ],
)
def test_the_check_catches_a_solver_that_lies(lie: Solve, sentence: str) -> None:
    """Each planted fault is named in the sentence of the error."""
    with pytest.raises(AssertionError, match=sentence):
        check_solver(lie, proves_infeasible=True)


@pytest.mark.parametrize(
    ("returned", "sentence"),
    [
        (None, "returned NoneType instead of a taskopt.Solution"),
        (np.zeros(2), "returned ndarray instead of a taskopt.Solution"),
        (Solution(np.zeros(2), np.zeros(0), np.zeros(2), "ok"), "returned the status 'ok' instead of"),  # type: ignore[arg-type]
        (Solution([0.0], np.zeros(0), np.zeros(2), Status.SOLVED), "returned x as list instead of an array"),  # type: ignore[arg-type]
        (Solution(np.zeros(9), np.zeros(0), np.zeros(2), Status.SOLVED), r"returned x of shape \(9,\)"),
    ],
    ids=["nothing", "array", "status", "list", "shape"],
)
def test_what_is_no_solution_is_named(returned: Any, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The check and the tick name what a user's solver returned, and what was expected instead."""
    monkeypatch.setattr(registry, "_known", dict(registry._known))
    register_solver("mine", lambda qp, accuracy: returned)
    with pytest.raises(AssertionError, match=f"the solver {sentence}"):
        check_solver(lambda qp, accuracy: returned)
    hierarchy = Hierarchy([Level([[1.0, 1.0]], [5.0])], box=(-np.ones(2), np.ones(2)))
    for family in ("hqp", "wqp"):
        with pytest.raises(InvalidValue, match=f"solver mine {sentence}"):
            resolve(hierarchy, f"{family}/mine")


def test_a_solver_of_ones_own_resolves_hierarchies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Registered by name, it is found by `hqp/` and `wqp/`; other names are suggested, taken ones refused."""
    monkeypatch.setattr(registry, "_known", dict(registry._known))
    row = register_solver("mine", daqp_but(), accuracy=1e-9, proves_infeasible=True)
    check_solver(row, accuracy=row.accuracy, proves_infeasible=True)
    hierarchy = Hierarchy([Level([[1.0, 1.0]], [5.0])], box=(-np.ones(2), np.ones(2)))
    for family in ("hqp", "wqp"):
        np.testing.assert_allclose(resolve(hierarchy, f"{family}/mine").x, [1.0, 1.0], atol=1e-9)
    with pytest.raises(UnknownName, match=r"did you mean .*hqp/mine"):
        resolve(hierarchy, "hqp/mina")
    with pytest.raises(InvalidValue, match="'mine' already"):
        register_solver("mine", daqp_but())
    assert register_solver("mine", daqp_but(), method="other", replace=True).method == "other"


@pytest.mark.parametrize(("name", "function"), [("", len), ("a/b", len), ("c", 3.0)])
def test_what_cannot_be_a_solver_is_refused(name: str, function: Any) -> None:
    """A name that a resolver could not be asked for by, and something that cannot be called."""
    with pytest.raises(InvalidValue, match=r"slash|function"):
        register_solver(name, function)


def test_a_wrong_sign_is_caught() -> None:
    """min ½x² s.t. x ≤ 1 with x = 1, y = −1: stationary and feasible, but no optimum."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], box_upper=[1.0])
    lie = Solution(np.ones(1), np.empty(0), -np.ones(1), Status.SOLVED)
    assert max(kkt_residuals(qp, lie)) > 0.1


@pytest.mark.parametrize(
    ("x", "y", "which"), [(0.5, 0.0, 0), (2.0, -2.0, 1), (1.0, -1.0, 2), (0.5, -0.5, 2), (-1.0, 1.0, 3)]
)
def test_each_residual_catches_its_own_lie(x: float, y: float, which: int) -> None:
    """Minimise ½x² subject to x ≤ 1; the optimum is (0, 0)."""
    qp = QuadraticProgram.checked([[1.0]], [0.0], box_upper=[1.0])
    assert kkt_residuals(qp, Solution(np.array([x]), np.empty(0), np.array([y]), Status.SOLVED))[which] > 0.1


def test_not_a_number_is_no_answer() -> None:
    """NaN anywhere makes every residual infinite."""
    qp = QuadraticProgram.checked([[1.0]], [0.0])
    assert (
        kkt_residuals(qp, Solution(np.array([np.nan]), np.empty(0), np.zeros(1), Status.SOLVED))
        == (np.inf,) * 4
    )


@pytest.mark.parametrize(("name", "finest"), [("ecos", 1e-10), ("qpalm", 1e-11), ("scs", 1e-13)])
def test_no_solver_is_asked_for_more_than_it_can_reach(
    name: str, finest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tolerance below it would make ECOS give up most programs; coarser ones are handed on as they are."""
    asked: list[float] = []

    def remember(package: Any, problem: Any, name: str, options: dict[str, float]) -> None:
        asked.append(min(value for key, value in options.items() if key in ("eps_abs", "abstol")))

    monkeypatch.setattr(qpsolvers, "_solved", remember)
    for accuracy in (1e-15, 1e-6):
        qpsolvers.solve(name, random_program(0), accuracy)
    assert asked == [finest, 1e-6]


def test_elastiqp_is_a_line_of_the_table_and_missing_where_it_is_not_installed() -> None:
    """With the argument of pip; `sip` is called otherwise there."""
    known = {row.name: row for row in solvers()}
    assert known["elastiqp"].installed != ("elastiqp" in missing_solvers())
    assert missing_solvers().get("sip", "sip-qp-python") == "sip-qp-python"


def test_a_solver_that_qpsolvers_does_not_know_has_no_defaults(monkeypatch: pytest.MonkeyPatch) -> None:
    """Asked for them it would give up every program."""
    assert {"daqp", "quadprog"} <= registry.known_to_qpsolvers()
    monkeypatch.setattr(registry, "_known", dict(registry._known))
    register_solver("own", lambda qp, accuracy: solver("daqp")(qp, accuracy))
    with pytest.raises(InvalidValue, match="qpsolvers does not know own"):
        registry.at_defaults("own")


def test_unknown_solvers_get_the_nearest_match() -> None:
    """A mistyped name is answered with the name that was meant."""
    with pytest.raises(UnknownName, match="did you mean daqp"):
        solver("dapq")


def test_a_missing_package_comes_with_the_line_that_installs_it() -> None:
    """A row of the table whose package cannot be imported says how to get it."""
    absent = Solver("nowhere", "none", 1.0, "no_such_package", "no-such-package")
    with pytest.raises(NotInstalled, match="pip install no-such-package"):
        absent(random_program(0))
