"""Which solvers there are: a table. A new one is a file beside this, and a row here."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from importlib.util import find_spec

from taskopt.errors import NotInstalled, UnknownName
from taskopt.hierarchy.qp import QuadraticProgram, Solution

Solve = Callable[[QuadraticProgram, float], Solution]


@dataclass(frozen=True)
class Solver:
    """One row of the table; the package is imported on first use.

    `accuracy`: the KKT residual, relative to max(1, largest term), that it can be held to on a
    well-scaled program. `proves_infeasible`: whether it says so, rather than giving up.
    """

    name: str
    package: str
    install: str
    method: str
    accuracy: float
    proves_infeasible: bool = True
    module: str = "qpsolvers"

    @property
    def installed(self) -> bool:
        """Whether its package can be imported."""
        return find_spec(self.package) is not None

    def __call__(self, qp: QuadraticProgram, accuracy: float = 1e-10) -> Solution:
        """Solve; `accuracy` is the KKT residual asked for."""
        return _loaded(self)(qp, accuracy)


@cache
def _loaded(row: Solver) -> Solve:
    if not row.installed:
        raise NotInstalled(f"solver {row.name}", row.install)
    solve = import_module(f"taskopt.solver.{row.module}").solve
    return partial(solve, row.name) if row.module == "qpsolvers" else solve


_TABLE = (
    Solver("daqp", "daqp", "daqp", "dual active set", 1e-11, module="daqp"),
    Solver("clarabel", "clarabel", "clarabel", "interior point", 1e-9, module="clarabel"),
    Solver("proxqp", "proxsuite", "proxsuite", "augmented Lagrangian", 1e-9, False, module="proxqp"),
    Solver("quadprog", "quadprog", "quadprog", "dual active set", 1e-11, False),
    Solver("piqp", "piqp", "piqp", "proximal interior point", 1e-9, False),
    # Of 1000 random programs it gave up 11, and called 2 solved with an error of 0.5: held to nothing.
    Solver("highs", "highspy", "highspy", "active set", math.inf, False),
    Solver("osqp", "osqp", "osqp", "operator splitting", 1e-8, False),
    Solver("scs", "scs", "scs", "operator splitting", 1e-8, False),
)
_KNOWN = {row.name: row for row in _TABLE}


def solvers() -> tuple[Solver, ...]:
    """The table, and whatever else qpsolvers finds installed."""
    return _TABLE + _others()


def solver(name: str) -> Solver:
    """The solver of that name. Raises `UnknownName`, or `NotInstalled` with the line that installs it."""
    found = _KNOWN.get(name) or next((row for row in _others() if row.name == name), None)
    if found is None:
        raise UnknownName("solver", name, [row.name for row in solvers()])
    if not found.installed:
        raise NotInstalled(f"solver {name}", found.install)
    return found


def _others() -> tuple[Solver, ...]:
    """Solvers of qpsolvers that the table does not know: held to little, as nothing is known of them."""
    if find_spec("qpsolvers") is None:
        return ()
    from qpsolvers import available_solvers

    names = (name for name in available_solvers if name not in _KNOWN)
    return tuple(Solver(name, "qpsolvers", "qpsolvers", "by qpsolvers", 1e-5, False) for name in names)
