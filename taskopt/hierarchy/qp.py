"""One quadratic program, and what a solver says of it.

    min ½ xᵀ H x + gᵀ x   s.t.   lower ≤ C x ≤ upper,  box_lower ≤ x ≤ box_upper

with stationarity H x + g + Cᵀ y + y_box = 0: a multiplier is > 0 at the upper bound.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, bound, finite
from taskopt.errors import Infeasible, InvalidValue, MissingFile
from taskopt.hierarchy.status import Status

_PARTS = ("H", "g", "C", "lower", "upper", "box_lower", "box_upper")


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """H (n, n) symmetric, g (n,), rows C (m, n) with lower, upper (m,), box (n,) each; ±inf: no bound.

    An equality is lower = upper; no rows is C with no rows.
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
        """From somebody else's arrays; what is left out is no row, or no bound.

        Raises `InvalidValue` for shapes, NaN or an asymmetric H, `Infeasible` where lower > upper.
        """
        gradient = finite("g", g, (None,))
        n = len(gradient)
        hessian = finite("H", H, (n, n))
        if not np.allclose(hessian, hessian.T, rtol=1e-12, atol=1e-14):
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
        for low, high, name in ((*sides[:2], "row"), (*sides[2:], "box")):
            wrong = np.flatnonzero(low > high)
            if wrong.size:
                raise Infeasible(
                    f"{name} {wrong[0]}: lower {low[wrong[0]]:g} exceeds upper {high[wrong[0]]:g}"
                )
        return QuadraticProgram(hessian, gradient, rows, *sides)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.g)

    @property
    def equality(self) -> np.ndarray:
        """(m,) whether a row is an equality."""
        return self.lower == self.upper

    def save(self, path: str | Path) -> None:
        """Write to an .npz file, so that a program can be solved elsewhere."""
        np.savez(Path(path), **{name: getattr(self, name) for name in _PARTS})

    @staticmethod
    def load(path: str | Path) -> "QuadraticProgram":
        """Read what `save` wrote. Raises `MissingFile`, `InvalidValue`."""
        if not Path(path).is_file():
            raise MissingFile(f"no quadratic program at {path}; write one with QuadraticProgram.save")
        with np.load(Path(path), allow_pickle=False) as parts:
            missing = [name for name in _PARTS if name not in parts]
            if missing:
                raise InvalidValue(f"{path} is no quadratic program: it lacks {', '.join(missing)}")
            return QuadraticProgram.checked(*(parts[name] for name in _PARTS))


@dataclass(frozen=True, eq=False)
class Solution:
    """x (n,), multipliers y (m,) of the rows and y_box (n,), and what the solver claims."""

    x: Array
    y: Array
    y_box: Array
    status: Status
    iterations: int = 0
