"""The table of solvers.

To add a solver to taskopt, write a file beside this one with a function `solve` (see
`taskopt.solver.base.Solve`) and add a line to `_TABLE`. For a solver outside the package, call
`register_solver`.
"""

import math
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property, partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from taskopt.errors import InvalidValue, NotInstalled, UnknownName
from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.solver.base import Solve, fault_of_solution
from taskopt.solver.inside import inside


@dataclass(frozen=True)
class Solver:
    """One line of the table of solvers; the package of a solver is imported at its first use.

    Attributes:
        name: Name of the solver, as in "hqp/daqp".
        method: Kind of algorithm, for tables.
        accuracy: KKT residual, relative to max(1, largest term), that the solver must reach on well-scaled
            programs; inf if none is required.
        package: Package that has to be importable; "" for a solver that is registered by a user.
        install: Argument of `pip install` that provides the package.
        proves_infeasible: True if the solver claims INFEASIBLE for infeasible programs; False if it may only
            give up.
        module: Module of `taskopt.solver` that holds the function `solve`.
        function: The function itself, for a solver that is registered by a user.
        most_iterations: Iterations after which a resolver starts no other program in the same tick.
    """

    name: str
    method: str
    accuracy: float
    package: str = ""
    install: str = ""
    proves_infeasible: bool = True
    module: str = "qpsolvers"
    function: Solve | None = None
    most_iterations: float = math.inf

    @property
    def promises(self) -> bool:
        """True if the solver is held to an accuracy."""
        return math.isfinite(self.accuracy)

    @property
    def installed(self) -> bool:
        """True if the package of the solver can be imported."""
        return not self.package or "_imported" in vars(self) or find_spec(self.package) is not None

    def __call__(self, qp: QuadraticProgram, accuracy: float = 1e-10) -> Solution:
        """Solve a convex quadratic program; see `taskopt.solver.base.Solve`.

        Args:
            qp: The program.
            accuracy: Requested KKT residual.

        Returns:
            The solution of the solver, with its claim.

        Raises:
            NotInstalled: The package of the solver cannot be imported.
            InvalidValue: A user's function returns something that is not a solution of this program.
        """
        if self.function is None:
            return self._imported(qp, accuracy)
        with inside:
            found = self.function(qp, accuracy)
        if fault := fault_of_solution(found, qp):
            raise InvalidValue(f"solver {self.name} {fault}; taskopt.testing.check_solver tries its promises")
        return found

    @cached_property
    def _imported(self) -> Solve:
        """The function of a solver of the table, imported with its package at the first use."""
        if not self.installed:
            raise NotInstalled(f"solver {self.name}", self.install)
        solve = import_module(f"taskopt.solver.{self.module}").solve
        return partial(solve, self.name) if self.module == "qpsolvers" else solve


_MOST = 700  # iterations; one program takes 300 at most, so that no tick takes more than 1,000
_TABLE = (
    Solver("daqp", "dual active set", 1e-11, "daqp", "daqp", module="daqp", most_iterations=_MOST),
    Solver(
        "clarabel", "interior point", 1e-9, "clarabel", "clarabel", module="clarabel", most_iterations=_MOST
    ),
    Solver(
        "proxqp",
        "augmented Lagrangian",
        1e-8,
        "proxsuite",
        "proxsuite",
        False,
        "proxqp",
        most_iterations=_MOST,
    ),
    Solver(
        "quadprog",
        "dual active set",
        1e-11,
        "quadprog",
        "quadprog",
        False,
        "quadprog",
        most_iterations=_MOST,
    ),
    Solver("elastiqp", "dual active set", 1e-11, "elastiqp", "elastiqp", False, "elastic"),
    Solver("piqp", "proximal interior point", 1e-6, "piqp", "piqp", False, most_iterations=_MOST),
    # Of 1000 random programs it gave up 11, and called 2 solved with an error of 0.5: held to nothing.
    Solver("highs", "active set", math.inf, "highspy", "highspy", False),
    Solver("osqp", "operator splitting", 1e-6, "osqp", "osqp", False),
    Solver("scs", "operator splitting", 1e-6, "scs", "scs", False),
)
_known = {row.name: row for row in _TABLE}  # and what users register


def solvers() -> tuple[Solver, ...]:
    """Return the table, the solvers that users registered, and all others that qpsolvers finds installed."""
    return (*_known.values(), *_others())


def solver(name: str) -> Solver:
    """Return the solver of a name.

    Args:
        name: Name such as "daqp"; `solvers()` lists all.

    Returns:
        The line of the table, which can be called to solve a program.

    Raises:
        UnknownName: There is no such solver; the message suggests similar names.
        NotInstalled: Its package cannot be imported; the message states the command that installs it.
    """
    found = _known.get(name) or next((row for row in _others() if row.name == name), None)
    if found is None:
        raise UnknownName("solver", name, [row.name for row in solvers()])
    if not found.installed:
        raise NotInstalled(f"solver {name}", found.install)
    return found


def register_solver(
    name: str,
    solve: Solve,
    *,
    method: str = "user",
    accuracy: float = 1e-8,
    proves_infeasible: bool = False,
    replace: bool = False,
) -> Solver:
    """Add a solver of your own, so that "hqp/NAME" and "wqp/NAME" resolve hierarchies with it.

    `taskopt.testing.check_solver` tests that it keeps the promises of a solver.

    Args:
        name: Name of the solver, without a slash.
        solve: A function (qp, accuracy) -> Solution, see `taskopt.solver.base.Solve`.
        method: Kind of algorithm, for tables.
        accuracy: KKT residual, relative to max(1, largest term), that it keeps on well-scaled programs.
        proves_infeasible: True if it claims INFEASIBLE for infeasible programs; False if it may only give up.
        replace: True to replace a solver that has this name already.

    Returns:
        The new line of the table.

    Raises:
        InvalidValue: The name is empty, has a slash, or is taken; or `solve` cannot be called.
    """
    if not isinstance(name, str) or not name or "/" in name:
        raise InvalidValue(f"a solver needs a name without a slash, got {name!r}")
    if not callable(solve):
        raise InvalidValue(f"solve must be a function (qp, accuracy) -> Solution, got {type(solve).__name__}")
    if name in {row.name for row in solvers()} and not replace:
        raise InvalidValue(f"there is a solver '{name}' already; choose another name, or pass replace=True")
    row = Solver(name, method, accuracy, proves_infeasible=proves_infeasible, module="", function=solve)
    _known[name] = row
    return row


@cache
def known_to_qpsolvers() -> frozenset[str]:
    """Return the names of the installed solvers that qpsolvers can call, as `at_defaults` does."""
    if find_spec("qpsolvers") is None:
        return frozenset()
    from qpsolvers import available_solvers

    return frozenset(available_solvers)


def at_defaults(name: str) -> str:
    """Make a solver of qpsolvers known that keeps its own default tolerances, and return its name.

    Args:
        name: Name of a solver that qpsolvers knows.

    Returns:
        Its name with " at defaults", as in "hqp/osqp at defaults".

    Raises:
        UnknownName: There is no such solver.
        NotInstalled: Its package, or qpsolvers, cannot be imported.
        InvalidValue: qpsolvers does not know it.
    """
    known, new = solver(name), f"{name} at defaults"
    if name not in known_to_qpsolvers():
        raise InvalidValue(f"qpsolvers does not know {name}, so that it has no defaults there; take '{name}'")
    if new not in _known:
        solve = partial(import_module("taskopt.solver.qpsolvers").solve_at_default_tolerances, known.name)
        register_solver(new, solve, method=f"{known.method}, default tolerances", accuracy=math.inf)
    return new


PACKAGES = {
    "copt": "coptpy", "gurobi": "gurobipy", "highs": "highspy", "hpipm": "hpipm-python",
    "jaxopt_osqp": "jaxopt", "mosek": "mosek", "proxqp": "proxsuite", "sip": "sip-qp-python",
}  # fmt: skip
"""Distributions of solvers of qpsolvers that are called otherwise than the solver."""


def solver_versions() -> dict[str, str]:
    """Find the versions of the solvers that are installed.

    Returns:
        Version by name of the solver; those that a user registered have none.
    """
    found = {}
    for row in solvers():
        if row.installed and row.function is None:
            with suppress(PackageNotFoundError):
                found[row.name] = version(PACKAGES.get(row.name, row.name))
    return found


def missing_solvers() -> dict[str, str]:
    """Find the solvers that the table or qpsolvers knows and that are not installed.

    Returns:
        Name of the distribution to install, by name of the solver. Some need a licence or a compiler.
    """
    there = {row.name for row in solvers() if row.installed}
    names = [row.name for row in solvers()]
    package = find_spec("qpsolvers")
    if package is not None and package.submodule_search_locations is not None:
        folder = Path(package.submodule_search_locations[0]) / "solvers"
        names += sorted(file.stem.removesuffix("_") for file in folder.glob("[a-z]*_.py"))
    return {name: PACKAGES.get(name, name) for name in dict.fromkeys(names) if name not in there}


def _others() -> tuple[Solver, ...]:
    """Return the solvers of qpsolvers that the table does not list, for which little is required."""
    if find_spec("qpsolvers") is None:
        return ()
    from qpsolvers import available_solvers

    names = (name for name in available_solvers if name not in _known)
    return tuple(Solver(name, "by qpsolvers", 1e-5, "qpsolvers", "qpsolvers", False) for name in names)
