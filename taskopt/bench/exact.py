"""The exact lexicographic optimum of a hierarchy in rational arithmetic, as a reference for resolvers.

Each level is a convex quadratic program in x and a slack for each of its inequalities. Its KKT conditions are
a linear complementarity problem w = M z + q, w, z ≥ 0, wᵀ z = 0, with a bisymmetric positive semidefinite M,
in which x, slacks and multipliers of equalities are free. The criss-cross method solves it: free unknowns
are made basic first; then the first pair with a negative value is pivoted until there is none. Least indices
make it finite without any start and without any tolerance. All numbers are integers over one denominator,
and every division is exact.

It shares nothing with the resolvers but the declaration of a hierarchy.

Source: den Hertog, Roos and Terlaky (1993), "The linear complementarity problem, sufficient matrices, and the
criss-cross method", Linear Algebra and its Applications 187; Edmonds (1967), J. Research NBS 71B (integer
pivots).
"""

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import Infeasible
from taskopt.hierarchy.problem import Hierarchy, LevelRows

Rational = list[Fraction]


@dataclass(frozen=True)
class _Row:
    """lower ≤ a · x ≤ upper; None for no bound."""

    a: Rational
    lower: Fraction | None
    upper: Fraction | None

    @property
    def equality(self) -> bool:
        """True if the row has one value only."""
        return self.lower is not None and self.lower == self.upper

    def at(self, x: Rational) -> Fraction:
        """Return a · x."""
        return sum((c * v for c, v in zip(self.a, x, strict=True) if c), Fraction(0))

    def kept(self, x: Rational) -> "_Row":
        """Return what levels below have to keep: the value where it is missed, else the interval."""
        value = self.at(x)
        missed = (self.lower is not None and value < self.lower) or (
            self.upper is not None and value > self.upper
        )
        return _Row(self.a, value, value) if self.equality or missed else self


def exact_optimum(hierarchy: Hierarchy) -> list[Fraction]:
    """Compute the lexicographic optimum of the declared numbers without any rounding.

    Args:
        hierarchy: The problem.

    Returns:
        x, n fractions.

    Raises:
        Infeasible: The hard limits contradict each other.
    """
    n = hierarchy.n
    box = LevelRows(np.eye(n), hierarchy.box_lower, hierarchy.box_upper, np.ones(n))
    held = [*_rows(box), *_rows(hierarchy.limits)]
    zero = Fraction(0)
    for level in hierarchy.levels:
        rows, weights = _rows(level), [Fraction(float(w)) for w in level.weight]
        soft = [i for i, row in enumerate(rows) if not row.equality]
        size = n + len(soft)
        H, g = [[zero] * size for _ in range(size)], [zero] * size
        for row, w in zip(rows, weights, strict=True):
            if row.equality and row.upper is not None:
                for i in range(n):
                    g[i] -= w * row.a[i] * row.upper
                    for j in range(n):
                        H[i][j] += w * row.a[i] * row.a[j]
        constraints = [_Row([*row.a, *[zero] * len(soft)], row.lower, row.upper) for row in held]
        for place, i in enumerate(soft):
            H[n + place][n + place] = weights[i]
            slack = [Fraction(-1 if other == place else 0) for other in range(len(soft))]
            constraints.append(_Row([*rows[i].a, *slack], rows[i].lower, rows[i].upper))
        x = _minimise(H, g, constraints)[:n]
        held += [row.kept(x) for row in rows]
    W = [[Fraction(float(value)) for value in line] for line in hierarchy.norm_matrix()]
    return _minimise(W, [zero] * n, held)


def as_floats(x: list[Fraction]) -> Array:
    """Return the nearest doubles.

    Args:
        x: Fractions.

    Returns:
        The same numbers, rounded.
    """
    return np.array([float(value) for value in x])


def _rows(level: LevelRows) -> list[_Row]:
    """Return the rows of a level as fractions."""
    return [
        _Row(
            [Fraction(float(value)) for value in a],
            None if low == -np.inf else Fraction(float(low)),
            None if high == np.inf else Fraction(float(high)),
        )
        for a, low, high in zip(level.A, level.lower, level.upper, strict=True)
    ]


def _minimise(H: list[Rational], g: Rational, rows: list[_Row]) -> Rational:
    """Return a minimum of ½ xᵀ H x + gᵀ x inside the rows, one of them where there are several."""
    n = len(g)
    equal = [row for row in rows if row.equality]
    sides = [(row.a, row.upper, 1) for row in rows if not row.equality and row.upper is not None]
    sides += [(row.a, row.lower, -1) for row in rows if not row.equality and row.lower is not None]
    borders = [(row.a, row.upper, 1) for row in equal] + sides
    size = n + len(borders)
    T = np.zeros((size, size + 1), dtype=object)
    # The cost and every row may be multiplied by any positive number: make all of them integers.
    cost = _integers([value for line in H for value in line] + g)
    T[:n, :n] = np.array(cost[: n * n], dtype=object).reshape(n, n)
    T[:n, -1] = cost[n * n :]
    for place, (a, bound, sign) in enumerate(borders, n):
        *numbers, b = _integers([*a, bound or Fraction(0)])
        T[:n, place] = [sign * number for number in numbers]
        T[place, :n] = [-sign * number for number in numbers]
        T[place, -1] = sign * b
    return _CrissCross(T, n + len(equal)).solution(n)


def _integers(values: Rational) -> list[int]:
    """Return the values times the positive number that makes them the smallest integers."""
    common = lcm(*(value.denominator for value in values))
    numbers = [value.numerator * (common // value.denominator) for value in values]
    divisor = gcd(*numbers) or 1
    return [number // divisor for number in numbers]


class _CrissCross:
    """The tableau of D · basic = T · (nonbasic, 1), in which pair i is z_i and w_i, of which one is basic."""

    def __init__(self, T: np.ndarray, free: int) -> None:
        self.T, self.D, self.free = T, 1, free
        self.size = len(T)
        self.z_basic = [False] * self.size

    def solution(self, n: int) -> Rational:
        """Return the first n entries of z at the solution."""
        self._make_free_unknowns_basic()
        while (row := self._first_negative()) is not None:
            if self.T[row, row]:
                self._pivot(row, row)
                continue
            column = next((j for j in self._movable() if self.T[row, j] > 0), None)
            if column is None:
                raise Infeasible("the hard limits contradict each other, in exact arithmetic")
            self._exchange(row, column)
        return [Fraction(self.T[i, -1], self.D) if self.z_basic[i] else Fraction(0) for i in range(n)]

    def _make_free_unknowns_basic(self) -> None:
        """Pivot every free unknown into the basis, alone or with a partner; redundant ones stay at zero."""
        moved = True
        while moved:
            moved = sum(self._make_basic(i) for i in range(self.free)) > 0
        for i in range(self.free):
            if not self.z_basic[i] and self.T[i, -1]:
                raise Infeasible("the hard equalities contradict each other, in exact arithmetic")

    def _make_basic(self, i: int) -> bool:
        """Pivot free unknown i into the basis, and return True if that can be done."""
        if self.z_basic[i]:
            return False
        if self.T[i, i]:
            self._pivot(i, i)
            return True
        partner = next((j for j in range(self.size) if not self.z_basic[j] and self.T[i, j]), None)
        if partner is not None:
            self._exchange(i, partner)
        return partner is not None

    def _first_negative(self) -> int | None:
        """Return the first pair with a sign whose basic member is negative."""
        return next((i for i in range(self.free, self.size) if self.T[i, -1] < 0), None)

    def _movable(self) -> range:
        """Return the pairs with a sign; nonbasic members of free pairs are zero for ever."""
        return range(self.free, self.size)

    def _exchange(self, i: int, j: int) -> None:
        """Pivot on (i, j) and (j, i), which leaves the basis complementary."""
        self._pivot(i, j)
        self._pivot(j, i)
        # The members of i and j have changed rows: put each back into the row of its own pair.
        self.T[[i, j]] = self.T[[j, i]]
        self.T[:, [i, j]] = self.T[:, [j, i]]

    def _pivot(self, row: int, column: int) -> None:
        """Make the nonbasic member of a column basic instead of that of a row."""
        T, pivot = self.T, self.T[row, column]
        line, beside = T[row].copy(), T[:, column].copy()
        T = (pivot * T - np.outer(beside, line)) // self.D
        T[row] = -line
        T[:, column] = beside
        T[row, column] = self.D
        self.T, self.D = (T, pivot) if pivot > 0 else (-T, -pivot)
        self.z_basic[row] = not self.z_basic[row]
