"""How right the answers are near a singularity: smallest singular value × damping × solver.

A 6×7 Jacobian with singular values from 1 down to σ_min, a generic v, velocity bounds. Each solver
answers twice: as `<family>/<solver>` here, to the accuracy asked for, and at its own defaults with the
normal equations, H = JᵀJ + k² I. Where no bound binds, both are held against (3.52), or (3.59) where it
is damped; where bounds bind, against the exact active set, solved again and certified.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.base import Resolver
from taskopt.resolver.closed_form import damped_inverse, pseudo_inverse
from taskopt.resolver.registry import resolver
from taskopt.solver.qpsolvers import solve_at_defaults
from taskopt.solver.registry import solvers

SIGMA = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
DAMPING = (0.0, 1e-3, 1e-1)  # k
CELLS = len(SIGMA) * len(DAMPING)  # of one solver
ROOMS = (10.0, 0.5)  # bounds relative to the largest velocity of the closed form: none binds, some bind
_FLOOR = 1e-12  # what goes on the diagonal of undamped normal equations, so that they have one solution


@dataclass
class Cell:
    """Relative errors in q̇, one a trial, of one solver at one σ_min and one k."""

    solver: str
    sigma: float
    k: float
    raw: list[float] = field(default_factory=list)
    polished: list[float] = field(default_factory=list)
    flagged: list[bool] = field(default_factory=list)
    default: list[float] = field(default_factory=list)  # at the solver's own defaults; inf where it gave up
    unjudged: int = 0  # trials without a certified optimum to hold answers against

    @property
    def worst_unflagged(self) -> float:
        """The largest raw error of an answer that passes for solved; 0 where none does."""
        passed = (error for error, flagged in zip(self.raw, self.flagged, strict=True) if not flagged)
        return max(passed, default=0.0)


def installed() -> tuple[str, ...]:
    """Names of the solvers that can be compared here."""
    return tuple(row.name for row in solvers() if row.installed)


def measure(
    names: Sequence[str], family: str = "hqp", trials: int = 20, room: float = 10.0, seed: int = 0
) -> Iterator[Cell]:
    """Every solver at every σ_min and k, on the same problems; `family` is "hqp" or "wqp".

    `room`: bounds relative to the largest velocity of the closed form; below 1 some bind.
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
    """(6, 7), singular values evenly spread on a logarithmic scale from 1 to `smallest`."""
    U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (6, 7))
    return (U * np.geomspace(1.0, smallest, 6)) @ V[:6]


def damped_problem(J: Array, v: Array, k: float, bound: float) -> Hierarchy:
    """½‖J q̇ − v‖² + ½ k² ‖q̇‖² as rows (3.59), or J q̇ = v at least norm (3.51), inside ±bound."""
    n = J.shape[1]
    box_of = np.full(n, -bound), np.full(n, bound)
    if k == 0.0:
        return Hierarchy([Level(J, v)], box=box_of)
    weight = np.concatenate([np.ones(len(v)), np.full(n, k**2)])
    rows, sides = np.vstack([J, np.eye(n)]), np.concatenate([v, np.zeros(n)])
    return Hierarchy([Level(rows, sides, weight=weight)], box=box_of)


def _try(cell: Cell, answer: Resolver, J: Array, v: Array, room: float) -> None:
    k = cell.k
    exact = (damped_inverse(J, k) if k else pseudo_inverse(J)) @ v
    bound = room * float(np.abs(exact).max())
    problem = damped_problem(J, v, k, bound)
    resolution, _ = answer(problem)
    goal = exact if answer.strict else answer.closed_form(problem)
    if room < 1.0:
        goal, exact = _optimum(resolution.problem), _optimum(problem)
        if not (np.isfinite(goal).all() and np.isfinite(exact).all()):
            cell.unjudged += 1
            return
    cell.raw.append(_error(resolution.x, goal))
    cell.polished.append(_error(polish(resolution).x, goal))
    cell.flagged.append(not resolution.solved)
    n = len(exact)
    H = J.T @ J + (k**2 or _FLOOR) * np.eye(n)
    found = solve_at_defaults(cell.solver, H, -J.T @ v, np.full(n, -bound), np.full(n, bound))
    cell.default.append(_error(found, exact))


def _optimum(problem: Hierarchy) -> Array:
    """x (n,) inside the bounds: the active set's answer, solved again; NaN if it cannot be certified."""
    best = polish(resolver("active-set")(problem)[0])
    return best.x if best.certified() else np.full(problem.n, np.nan)


def _error(x: Array, exact: Array) -> float:
    """‖x − exact‖∞ / ‖exact‖∞; inf for no answer."""
    distance = float(np.abs(x - exact).max() / np.abs(exact).max())
    return distance if np.isfinite(distance) else np.inf


def table(cells: Sequence[Cell], family: str, room: float) -> Table:
    """Solver and σ_min down, k across; at most 120 columns."""
    trials = len(cells[0].raw) + cells[0].unjudged
    binds = "bounds bind" if room < 1.0 else "nothing binds"
    out = Table(
        title=f"{binds}: relative error in q̇, largest of {trials}, {family}/<solver> and the solver alone",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    out.add_column("solver", no_wrap=True)
    out.add_column("σ_min", justify="right", no_wrap=True)
    for k in DAMPING:
        for heading in (f"k={k:g}\nraw", "pol-\nished", "flag-\nged", "own de-\nfaults"):
            out.add_column(Text(heading), justify="right", no_wrap=True)
    for name in dict.fromkeys(cell.solver for cell in cells):
        for sigma in SIGMA:
            row = [cell for cell in cells if (cell.solver, cell.sigma) == (name, sigma)]
            texts = [text for cell in row for text in _texts(cell)]
            label = name if sigma == SIGMA[0] else ""
            out.add_row(label, f"{sigma:.0e}", *texts, end_section=sigma == SIGMA[-1])
    return out


def _texts(cell: Cell) -> tuple[str, str, str, str]:
    if not cell.raw:
        return "–", "–", "–", "–"
    share = 100.0 * float(np.mean(cell.flagged))
    return _number(max(cell.raw)), _number(max(cell.polished)), f"{share:.0f} %", _number(max(cell.default))


def _number(value: float) -> str:
    return "none" if np.isinf(value) else f"{value:.0e}"


def verdict(cells: Sequence[Cell]) -> str:
    """The largest error that passes for solved, and what the columns mean."""
    worst = max(cells, key=lambda cell: cell.worst_unflagged)
    flags = [flag for cell in cells for flag in cell.flagged]
    flagged, judged = float(np.mean(flags)), len(flags)
    unjudged = sum(cell.unjudged for cell in cells)
    left_out = (
        f"; left out, without a certified optimum: {unjudged} of {unjudged + judged}" if unjudged else ""
    )
    return (
        f"largest error that is not flagged: {worst.worst_unflagged:.1e} ({worst.solver}, "
        f"σ_min {worst.sigma:.0e}, k = {worst.k:g}); flagged: {100.0 * flagged:.1f} % of all{left_out}.\n"
        "raw: the solver's own answer; polished: solved again from its active set; flagged: it gave up, or "
        "x was not shown to be as accurate as was asked for; own defaults: normal equations, "
        f"k² or {_FLOOR:g} on the diagonal; none: no answer."
    )
