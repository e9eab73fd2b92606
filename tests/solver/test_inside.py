"""The clock of the time inside solvers: it runs while a package solves, in its own thread, and only then."""

from threading import Thread
from time import perf_counter_ns, sleep

import numpy as np
import pytest

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.inside import nanoseconds_inside
from taskopt.solver.registry import Solver, solver

PROGRAM = QuadraticProgram.checked(
    np.eye(2), [-1.0, 0.0], C=[[1.0, 1.0]], upper=[0.5], box_lower=[-1.0, -1.0]
)
NAP = 0.02  # [s]


def sleeping(qp: QuadraticProgram, accuracy: float) -> Solution:
    """Sleep, and return zeros: a solver of a user."""
    sleep(NAP)
    return Solution(np.zeros(qp.n), np.zeros(len(qp.C)), np.zeros(qp.n), Status.SOLVED)


def test_the_clock_counts_the_whole_function_of_a_user() -> None:
    """A function that sleeps is inside for at least its nap, and the clock stands still afterwards."""
    row, before = Solver("sleeper", "user", 1e-8, function=sleeping), nanoseconds_inside()
    row(PROGRAM)
    spent = nanoseconds_inside() - before
    sleep(NAP)
    assert spent >= 1e9 * NAP
    assert nanoseconds_inside() - before == spent


@pytest.mark.parametrize("name", ["daqp", "proxqp", "clarabel", "quadprog", "piqp", "osqp"])
def test_each_package_is_timed(name: str) -> None:
    """Each solver moves the clock, and by less than the whole call."""
    if not Solver(name, "", 1.0, name if name != "proxqp" else "proxsuite").installed:
        pytest.skip(f"{name} is not installed")
    engine = solver(name)
    engine(PROGRAM)
    before, begin = nanoseconds_inside(), perf_counter_ns()
    engine(PROGRAM)
    spent, whole = nanoseconds_inside() - before, perf_counter_ns() - begin
    assert 0 < spent < whole


def test_the_clock_stops_if_the_package_raises() -> None:
    """An error ends the time inside."""

    def failing(qp: QuadraticProgram, accuracy: float) -> Solution:
        sleep(NAP)
        raise ValueError("no solution")

    before, row = nanoseconds_inside(), Solver("failing", "user", 1e-8, function=failing)
    with pytest.raises(ValueError, match="no solution"):
        row(PROGRAM)
    assert nanoseconds_inside() - before >= 1e9 * NAP


def test_each_thread_has_a_clock_of_its_own() -> None:
    """What another thread solves meanwhile is not counted here."""
    other: list[int] = []

    def work() -> None:
        sleeping_solver(PROGRAM)
        other.append(nanoseconds_inside())

    sleeping_solver = Solver("sleeper", "user", 1e-8, function=sleeping)
    before = nanoseconds_inside()
    thread = Thread(target=work)
    thread.start()
    thread.join()
    assert nanoseconds_inside() == before
    assert other[0] >= 1e9 * NAP
