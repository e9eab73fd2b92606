"""Measure the accuracy of solvers near a singularity, for each smallest singular value and damping.

The Jacobian is 6×7, with singular values from 1 down to σ_min; velocities are bounded. Each solver answers
twice: as the resolver `<family>/<solver>`, to the requested accuracy, and alone, at its own defaults, from
the normal equations H = JᵀJ + k² I. Where no bound is active, the exact answer is (3.52), or (3.59) with
damping k. Where bounds are active, it is the answer of the active-set method, solved again and proven.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.tolerances import DIAGONAL_OF_UNDAMPED
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.base import Resolver
from taskopt.resolver.closed_form import damped_inverse, pseudo_inverse
from taskopt.resolver.registry import resolver
from taskopt.solver.qpsolvers import solve_at_defaults
from taskopt.solver.registry import solvers

SIGMA = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
DAMPING = (0.0, 1e-3, 1e-1)  # k
CELLS = len(SIGMA) * len(DAMPING)  # of one solver
ROOMS = (10.0, 0.5)  # bounds relative to the largest velocity of the closed form: none is active, some are


@dataclass
class Cell:
    """Relative errors ‖x − exact‖∞ / ‖exact‖∞ of one solver at one σ_min and one k, for each trial.

    Attributes:
        solver: Name of the solver.
        sigma: Smallest singular value σ_min of the Jacobian.
        k: Damping factor.
        raw: Errors of the solver's own answers.
        polished: Errors of the same answers, solved again from their active sets.
        flagged: True where the answer is not proven.
        default: Errors of the solver alone at its own defaults; inf if it gave up.
        unjudged: Trials without a proven optimum to compare with.
        fallbacks: Trials whose optimum came from a fallback of the active-set method.
    """

    solver: str
    sigma: float
    k: float
    raw: list[float] = field(default_factory=list)
    polished: list[float] = field(default_factory=list)
    flagged: list[bool] = field(default_factory=list)
    default: list[float] = field(default_factory=list)
    unjudged: int = 0
    fallbacks: int = 0

    @property
    def worst_unflagged(self) -> float:
        """Largest raw error of the answers that are proven; 0 if none is."""
        passed = (error for error, flagged in zip(self.raw, self.flagged, strict=True) if not flagged)
        return max(passed, default=0.0)


def installed() -> tuple[str, ...]:
    """Return the names of the solvers that are installed."""
    return tuple(row.name for row in solvers() if row.installed)


def measure(
    names: Sequence[str], family: str = "hqp", trials: int = 20, room: float = 10.0, seed: int = 0
) -> Iterator[Cell]:
    """Measure every solver at every σ_min and k, on the same problems.

    Args:
        names: Names of the solvers.
        family: Kind of resolver that uses the solvers, "hqp" or "wqp".
        trials: Number of problems for each cell.
        room: Bounds on the velocities, relative to the largest velocity of the closed form. Below 1 some of
            them are active.
        seed: Another seed draws other problems.

    Yields:
        Cells, one after the other, solver by solver.
    """
    for name in names:
        answer = resolver(f"{family}/{name}")
        for sigma in SIGMA:
            for k in DAMPING:
                cell = Cell(name, sigma, k)
                rng = np.random.default_rng(seed)
                for _ in range(trials):
                    _try(cell, answer, jacobian(rng, sigma), rng.normal(size=6), room)
                yield cell


def jacobian(rng: np.random.Generator, smallest: float) -> Array:
    """Draw a Jacobian.

    Args:
        rng: Source of random numbers.
        smallest: Its smallest singular value.

    Returns:
        (6, 7), with singular values evenly spread on a logarithmic scale from 1 to `smallest`.
    """
    U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (6, 7))
    return (U * np.geomspace(1.0, smallest, 6)) @ V[:6]


def damped_problem(J: Array, v: Array, k: float, bound: float) -> Hierarchy:
    """Make the hierarchy of damped least squares (3.59) or, for k = 0, of (3.51), inside bounds.

    Args:
        J: Jacobian, (m, n).
        v: Velocity of the task, (m,).
        k: Damping factor; for 0, J q̇ = v is met at least norm.
        bound: Largest |q̇_i|.

    Returns:
        A hierarchy with one level.
    """
    n = J.shape[1]
    box_of = np.full(n, -bound), np.full(n, bound)
    if k == 0.0:
        return Hierarchy([Level(J, v)], box=box_of)
    weight = np.concatenate([np.ones(len(v)), np.full(n, k**2)])
    rows, sides = np.vstack([J, np.eye(n)]), np.concatenate([v, np.zeros(n)])
    return Hierarchy([Level(rows, sides, weight=weight)], box=box_of)


def _try(cell: Cell, answer: Resolver, J: Array, v: Array, room: float) -> None:
    """Resolve one problem in all ways, and note the errors in the cell."""
    k = cell.k
    exact = (damped_inverse(J, k) if k else pseudo_inverse(J)) @ v
    bound = room * float(np.abs(exact).max())
    problem = damped_problem(J, v, k, bound)
    resolution, _ = answer(problem)
    goal = exact if answer.strict else answer.closed_form(problem)
    if room < 1.0:
        (goal, one), (exact, other) = _optimum(resolution.problem), _optimum(problem)
        cell.fallbacks += one or other
        if not (np.isfinite(goal).all() and np.isfinite(exact).all()):
            cell.unjudged += 1
            return
    cell.raw.append(_error(resolution.x, goal))
    cell.polished.append(_error(polish(resolution).x, goal))
    cell.flagged.append(not resolution.proven)
    n = len(exact)
    H = J.T @ J + (k**2 or DIAGONAL_OF_UNDAMPED) * np.eye(n)
    found = solve_at_defaults(cell.solver, H, -J.T @ v, np.full(n, -bound), np.full(n, bound))
    cell.default.append(_error(found, exact))


def _optimum(problem: Hierarchy) -> tuple[Array, bool]:
    """Return the proven optimum (n,), NaN if there is none, and True if a fallback found it."""
    found, _ = resolver("active-set")(problem)
    best = polish(found)
    x = best.x if best.proven else np.full(problem.n, np.nan)
    return x, found.fallback is not None


def _error(x: Array, exact: Array) -> float:
    """Return ‖x − exact‖∞ / ‖exact‖∞; inf where x is not finite."""
    distance = float(np.abs(x - exact).max() / np.abs(exact).max())
    return distance if np.isfinite(distance) else np.inf


def table(cells: Sequence[Cell], family: str, room: float) -> Table:
    """Make the table of a measurement, at most 120 columns wide.

    Args:
        cells: Cells that `measure` yielded.
        family: Kind of resolver, as in `measure`.
        room: Bounds relative to the closed form, as in `measure`.

    Returns:
        One row for each solver and σ_min, four columns for each k.
    """
    trials = len(cells[0].raw) + cells[0].unjudged
    binds = "bounds active" if room < 1.0 else "no bound active"
    out = Table(
        title=f"{binds}: relative error in q̇, largest of {trials}, {family}/<solver> and the solver alone",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    out.add_column("solver", no_wrap=True)
    out.add_column("σ_min", justify="right", no_wrap=True)
    for k in DAMPING:
        for heading in (f"k={k:g}\nraw", "pol-\nished", "not\nproven", "solver\nalone"):
            out.add_column(Text(heading), justify="right", no_wrap=True)
    for name in dict.fromkeys(cell.solver for cell in cells):
        for sigma in SIGMA:
            row = [cell for cell in cells if (cell.solver, cell.sigma) == (name, sigma)]
            texts = [text for cell in row for text in _texts(cell)]
            label = name if sigma == SIGMA[0] else ""
            out.add_row(label, f"{sigma:.0e}", *texts, end_section=sigma == SIGMA[-1])
    return out


def _texts(cell: Cell) -> tuple[str, str, str, str]:
    """Return the four entries of a cell; dashes if no trial could be judged."""
    if not cell.raw:
        return "–", "–", "–", "–"
    share = 100.0 * float(np.mean(cell.flagged))
    return _number(max(cell.raw)), _number(max(cell.polished)), f"{share:.0f} %", _number(max(cell.default))


def _number(value: float) -> str:
    """Return one digit and the exponent; "none" for inf, which means that there is no answer."""
    return "none" if np.isinf(value) else f"{value:.0e}"


def verdict(cells: Sequence[Cell]) -> str:
    """Summarise a measurement in a few sentences, and explain the columns of its table.

    Args:
        cells: Cells that `measure` yielded.

    Returns:
        The text.
    """
    worst = max(cells, key=lambda cell: cell.worst_unflagged)
    flags = [flag for cell in cells for flag in cell.flagged]
    flagged, judged = float(np.mean(flags)), len(flags)
    unjudged, fallbacks = sum(cell.unjudged for cell in cells), sum(cell.fallbacks for cell in cells)
    left_out = f", without a proven optimum: {unjudged} of {unjudged + judged}" if unjudged else ""
    found = f" A fallback found the optimum of {fallbacks} problems." if fallbacks else ""
    return (
        f"Largest error of an answer that is proven: {worst.worst_unflagged:.1e} ({worst.solver}, "
        f"σ_min {worst.sigma:.0e}, k = {worst.k:g}); not proven: {100.0 * flagged:.1f} % of all{left_out}."
        f"{found}\n"
        "raw: answer of the solver; polished: solved again from its active set; not proven: the error "
        "bound of some entry is above 1e-8 · max(1, |x_i|), or there is none; solver alone: from the normal "
        f"equations at its defaults, with k² or {DIAGONAL_OF_UNDAMPED:g} on the diagonal; none: no answer."
    )
