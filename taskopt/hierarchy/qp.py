"""Quadratic programs, their solutions, and the KKT residuals of a solution.

    min ½ xᵀ H x + gᵀ x   s.t.   lower ≤ C x ≤ upper,  box_lower ≤ x ≤ box_upper

Stationarity is H x + g + Cᵀ y + y_box = 0, so that a multiplier is positive at an upper bound and negative at
a lower one.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskopt.arrays import Array, ArrayLike, Mask, bound, finite
from taskopt.errors import Infeasible, InvalidValue, MissingFile
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import SYMMETRY, SYMMETRY_FLOOR

_PARTS = ("H", "g", "C", "lower", "upper", "box_lower", "box_upper")


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """A convex quadratic program; an equality is lower = upper, and C may have no rows.

    Attributes:
        H: Hessian, symmetric positive semidefinite, (n, n).
        g: Linear term, (n,).
        C: Rows, (m, n).
        lower: Lower bounds of C x, (m,); −inf where there is none.
        upper: Upper bounds of C x, (m,); inf where there is none.
        box_lower: Lower bounds of x, (n,).
        box_upper: Upper bounds of x, (n,).
    """

    H: Array
    g: Array
    C: Array
    lower: Array
    upper: Array
    box_lower: Array
    box_upper: Array

    @staticmethod
    def checked(
        H: ArrayLike,
        g: ArrayLike,
        C: ArrayLike | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        box_lower: ArrayLike | None = None,
        box_upper: ArrayLike | None = None,
    ) -> "QuadraticProgram":
        """Make a program of arrays, and check them. Arrays that are left out mean no rows, or no bounds.

        Args:
            H: Hessian, (n, n).
            g: Linear term, (n,).
            C: Rows, (m, n).
            lower: Lower bounds of C x, (m,).
            upper: Upper bounds of C x, (m,).
            box_lower: Lower bounds of x, (n,).
            box_upper: Upper bounds of x, (n,).

        Returns:
            The program, with copies of the arrays.

        Raises:
            InvalidValue: A shape is wrong, a number is NaN, or H is not symmetric.
            Infeasible: A lower bound exceeds its upper bound.
        """
        gradient = finite("g", g, (None,))
        n = len(gradient)
        hessian = finite("H", H, (n, n))
        if not np.allclose(hessian, hessian.T, rtol=SYMMETRY, atol=SYMMETRY_FLOOR):
            raise InvalidValue(
                f"H must be symmetric; largest difference {np.abs(hessian - hessian.T).max():g}"
            )
        rows = finite("C", np.empty((0, n)) if C is None else C, (None, n))
        sides = [
            bound(name, np.full(size, free) if side is None else side, (size,))
            for name, side, size, free in (
                ("lower", lower, len(rows), -np.inf),
                ("upper", upper, len(rows), np.inf),
                ("box_lower", box_lower, n, -np.inf),
                ("box_upper", box_upper, n, np.inf),
            )
        ]
        for below, above, name in ((*sides[:2], "row"), (*sides[2:], "box")):
            wrong = np.flatnonzero(below > above)
            if wrong.size:
                i = int(wrong[0])
                raise Infeasible(f"{name} {i}: lower {below[i]:g} exceeds upper {above[i]:g}")
        return QuadraticProgram(hessian, gradient, rows, *sides)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.g)

    @property
    def equality(self) -> Mask:
        """True for each row that is an equality, (m,)."""
        return self.lower == self.upper

    def save(self, path: str | Path) -> None:
        """Write the program to an .npz file, so that it can be solved elsewhere.

        Args:
            path: The file.
        """
        np.savez(Path(path), **{name: getattr(self, name) for name in _PARTS})

    @staticmethod
    def load(path: str | Path) -> "QuadraticProgram":
        """Return the program that `save` wrote.

        Args:
            path: The file.

        Returns:
            The program.

        Raises:
            MissingFile: There is no such file.
            InvalidValue: Parts of a program are missing, or do not fit together.
        """
        if not Path(path).is_file():
            raise MissingFile(f"no quadratic program at {path}; write one with QuadraticProgram.save")
        with np.load(Path(path), allow_pickle=False) as parts:
            missing = [name for name in _PARTS if name not in parts]
            if missing:
                raise InvalidValue(f"{path} is no quadratic program: it lacks {', '.join(missing)}")
            return QuadraticProgram.checked(*(parts[name] for name in _PARTS))


@dataclass(frozen=True, eq=False)
class Solution:
    """The answer of a solver.

    Attributes:
        x: The unknowns, (n,).
        y: Multipliers of the rows, (m,); positive at an upper bound.
        y_box: Multipliers of the box, (n,).
        status: Claim of the solver.
        iterations: Number of its iterations.
    """

    x: Array
    y: Array
    y_box: Array
    status: Status
    iterations: int = 0


def kkt_residuals(qp: QuadraticProgram, solution: Solution) -> tuple[float, float, float, float]:
    """Compute the KKT residuals of a solution, which are zero for an optimum.

    Args:
        qp: The program.
        solution: Its solution, with multipliers.

    Returns:
        Stationarity, primal, dual and complementarity residual, each relative to max(1, the largest term of
        its sum). Complementarity is min(|y|, distance to the bound that has the sign of y). All are inf if a
        number is not finite.
    """
    if not all(np.isfinite(part).all() for part in (solution.x, solution.y, solution.y_box)):
        return np.inf, np.inf, np.inf, np.inf
    C = np.vstack([qp.C, np.eye(qp.n)])
    lower, upper = np.concatenate([qp.lower, qp.box_lower]), np.concatenate([qp.upper, qp.box_upper])
    y = np.concatenate([solution.y, solution.y_box])
    terms = np.column_stack([qp.H * solution.x, qp.g, (C * y[:, None]).T])
    scale = max(1.0, float(np.abs(terms).max()))
    value = C @ solution.x
    size = np.maximum(1.0, np.abs(C * solution.x).max(axis=1))
    outside = np.maximum(excess(value, lower, upper), 0.0) / size
    missing = np.where(y > 0.0, upper == np.inf, (y < 0.0) & (lower == -np.inf))
    nearest = np.where(y > 0.0, np.where(upper == np.inf, 0.0, upper), np.where(lower == -np.inf, 0.0, lower))
    distance = np.where((y == 0.0) | missing, 0.0, np.abs(value - nearest)) / size
    return (
        float(np.abs(terms.sum(axis=1)).max()) / scale,
        float(outside.max(initial=0.0)),
        float(np.abs(y * missing).max(initial=0.0)) / scale,
        float(np.minimum(np.abs(y) / scale, distance).max(initial=0.0)),
    )
