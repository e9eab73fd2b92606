"""A hierarchy scaled by powers of two, which changes no number: rows and the norm of about size one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof.double_double import two_sum_arrays
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.tolerances import LARGEST_SCALED, SMALLEST_SCALED


@dataclass(frozen=True, eq=False)
class Scaled:
    """The unknowns z of x = column z, and the rows of the box and of all levels in z.

    Attributes:
        hierarchy: The problem as it was declared.
        column: Powers of two, (n,).
        A: Rows of the box, the hard rows, and the levels, each with a largest entry in [1, 2), (n + M, n).
        lower: Their lower bounds, (n + M,).
        upper: Their upper bounds, (n + M,).
        weight: Their weights, (n + M,); 1 for hard rows.
        level: Level of each row, 0 for the box and the hard rows, (n + M,).
        exact: True if no number changed, so that the scaled problem is the declared one.
    """

    hierarchy: Hierarchy
    column: Array
    A: Array
    lower: Array
    upper: Array
    weight: Array
    level: IntArray
    exact: bool

    @staticmethod
    def of(hierarchy: Hierarchy) -> "Scaled":
        """Scale a hierarchy.

        Args:
            hierarchy: The problem.

        Returns:
            The scaled problem.
        """
        n, offsets = hierarchy.n, hierarchy.layout.offsets
        diagonal = hierarchy.norm if hierarchy.norm.ndim == 1 else np.diagonal(hierarchy.norm)
        column = np.exp2(-np.round(0.5 * np.log2(diagonal)))
        A = np.vstack([np.eye(n), hierarchy.A])
        lower, upper = hierarchy.bounds()
        weight = np.concatenate([np.ones(n), hierarchy.weight])
        level = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        level = np.concatenate([np.zeros(n, dtype=np.int64), level])
        weight[level == 0] = 1.0
        row = _row_powers(A * column)
        scaled = A * column * row[:, None], lower * row, upper * row, weight / row / row
        back = scaled[0] / row[:, None] / column, scaled[1] / row, scaled[2] / row, scaled[3] * row * row
        norm = hierarchy.norm_matrix() * column * column[:, None]
        back = *back, norm / column / column[:, None]
        declared = A, lower, upper, weight, hierarchy.norm_matrix()
        exact = all(map(_same, back, declared)) and all(map(_in_range, (*scaled, norm)))
        return Scaled(hierarchy, column, *scaled, level, exact)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.column)

    @cached_property
    def equality(self) -> Mask:
        """True for equalities, (n + M,)."""
        return self.lower == self.upper

    @cached_property
    def zero(self) -> Mask:
        """True for rows without any coefficient, which no unknown can change, (n + M,)."""
        return (self.A == 0.0).all(axis=1)

    @cached_property
    def levels(self) -> int:
        """Number of levels, the hard rows and the norm not counted."""
        return self.hierarchy.layout.level_count

    @cached_property
    def W(self) -> Enclosure:
        """The symmetric part of the norm in z, exactly, (n, n)."""
        matrix = self.hierarchy.norm_matrix() * self.column * self.column[:, None]
        halves = two_sum_arrays(matrix, np.ascontiguousarray(matrix.T))
        return Enclosure(np.stack([*halves, np.zeros(matrix.shape)])).scaled(np.full((1, 1), 0.5))

    @cached_property
    def root(self) -> Array:
        """L of W ≈ L Lᵀ, (n, n), lower triangular; it need not be exact."""
        return np.asarray(np.linalg.cholesky(self.W.middle), dtype=np.float64)

    @cached_property
    def directions(self) -> Array:
        """Rows in the metric of the norm, divided by their lengths, (n + M, n); they need not be exact."""
        rows = np.asarray(np.linalg.solve(self.root, self.A.T).T, dtype=np.float64)
        length = np.where(self.zero, 1.0, np.linalg.norm(rows, axis=1))
        return np.asarray(rows / length[:, None], dtype=np.float64)

    @cached_property
    def pull(self) -> Array:
        """Weight of each row times the square of its length, (n + M,); 1 for hard rows."""
        length = np.linalg.norm(np.linalg.solve(self.root, self.A.T), axis=0)
        return np.where(self.level == 0, 1.0, self.weight * length**2)

    def unit_rows(self, rows: IntArray) -> list[tuple[int, int]]:
        """Return which of some rows are unit vectors, whose value is an unknown exactly.

        Args:
            rows: Indices of rows, (m,).

        Returns:
            Pairs of a place in `rows` and an unknown.
        """
        chosen = self.A[rows]
        units = np.flatnonzero(((chosen != 0.0).sum(axis=1) == 1) & (chosen.sum(axis=1) == 1.0))
        return [(int(a), int(np.argmax(chosen[a]))) for a in units]

    def name(self, i: int, side: int) -> str:
        """Return the name of a row with its side.

        Args:
            i: Index of an unknown, i < n, or n plus the index of a row.
            side: −1 for the lower bound, 1 for the upper one, 0 for an equality.

        Returns:
            A name such as "upper bound of velocity/joint4".
        """
        name = self.hierarchy.name_of(i, side > 0)
        return name if side == 0 else f"{'upper' if side > 0 else 'lower'} bound of {name}"


def _row_powers(A: Array) -> Array:
    """Return a power of two for each row that brings its largest entry into [1, 2)."""
    largest = np.abs(A).max(axis=1, initial=0.0)
    return np.exp2(1.0 - np.frexp(np.where(largest > 0.0, largest, 1.0))[1])


def _same(a: Array, b: Array) -> bool:
    """Return True if two arrays have the same numbers."""
    return bool(np.array_equal(a, b))


def _in_range(value: Array) -> bool:
    """Return True if products of the numbers neither overflow nor underflow."""
    size = np.abs(value[np.isfinite(value) & (value != 0.0)])
    return bool(((size > SMALLEST_SCALED) & (size < LARGEST_SCALED)).all())
