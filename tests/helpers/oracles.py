"""Exact oracles: the lexicographic optimum in rational arithmetic, and hierarchies to try it on.

Every level is a convex quadratic program, solved by a primal active set with Bland's rule on
`Fraction`s, so that degenerate vertices and ties are decided exactly. Nothing here uses the package
but its declarations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level

KINDS = ("generic", "rank-deficient", "conflicting", "inequality in the middle", "integer-degenerate")


@dataclass(frozen=True)
class Row:
    """lower ≤ a · z ≤ upper, None for no bound."""

    a: tuple[Fraction, ...]
    lower: Fraction | None
    upper: Fraction | None

    @property
    def equality(self) -> bool:
        return self.lower is not None and self.lower == self.upper

    def value(self, z: Sequence[Fraction]) -> Fraction:
        return sum((c * v for c, v in zip(self.a, z, strict=False) if c), Fraction(0))


def lexicographic_optimum(hierarchy: Hierarchy) -> Array:
    """x (n,), exact to the last bit but for the final rounding; ValueError where hard limits contradict."""
    n = hierarchy.n
    eye = np.eye(n)
    hard = [_row(eye[j], hierarchy.box_lower[j], hierarchy.box_upper[j]) for j in range(n)]
    hard += _rows(hierarchy, 0)
    x = [Fraction(0)] * n
    if any(_distance(row, x) for row in hard):
        x, _ = _least_violation(hard, [Fraction(1)] * len(hard), [], x, [])
        if any(_distance(row, x) for row in hard):
            raise ValueError("hard limits contradict each other")
    held, working = hard, []
    for k in range(1, hierarchy.layout.level_count + 1):
        rows = _rows(hierarchy, k)
        weights = [Fraction(w) for w in hierarchy.level(k).weight]
        x, working = _least_violation(rows, weights, held, x, working)
        held = held + [_frozen(row, x) for row in rows]
    W = [[Fraction(value) for value in row] for row in hierarchy.norm_matrix()]
    x, _ = _minimise(W, [Fraction(0)] * n, held, x, working)
    return np.array([float(value) for value in x])


def random_hierarchy(seed: int, kind: str | None = None) -> Hierarchy:
    """A feasible hierarchy of 2 to 5 unknowns and up to 3 levels; kinds take turns with the seed."""
    rng = np.random.default_rng(seed)
    kind = kind or KINDS[seed % len(KINDS)]
    integer = kind == "integer-degenerate"
    n = int(rng.integers(2, 6))
    count = int(rng.integers(2, 4))

    def draw(*shape: int) -> Array:
        return rng.integers(-1, 2, shape).astype(float) if integer else rng.integers(-16, 17, shape) / 8.0

    levels = []
    for k in range(count):
        m = int(rng.integers(1, 4))
        A = draw(m, n)
        if kind == "rank-deficient" and k > 0:
            A[0] = levels[0].A[0] * 2.0 - (A[1] if m > 1 else 0.0)
            A[-1] = A[0] if rng.random() < 0.5 else A[-1]
        if kind == "conflicting":
            A[-1] = A[0]
        b = draw(m) * (3.0 if kind == "conflicting" else 1.0)
        weight = rng.integers(1, 5, m) / 2.0
        unequal = (kind == "inequality in the middle" and k == 1) or rng.random() < 0.25
        if unequal:
            width = np.abs(draw(m))
            lower = np.where(rng.random(m) < 0.3, -np.inf, b - width)
            levels.append(Level(A, lower=lower, upper=b + (width if not integer else 1.0), weight=weight))
        else:
            levels.append(Level(A, b, weight=weight))
    reach = np.abs(draw(n)) + (1.0 if integer else 0.125)
    box = (-reach, reach) if rng.random() < 0.8 else None
    limits = None
    if rng.random() < 0.5:
        limits = Level(draw(2, n), upper=np.abs(draw(2)), lower=np.array([-np.inf, -3.0]))
    norm = None if rng.random() < 0.5 else rng.integers(1, 9, n) / 2.0
    return Hierarchy(levels, box=box, limits=limits, norm=norm)


def _row(a: Array, lower: float, upper: float) -> Row:
    least = None if lower == -np.inf else Fraction(float(lower))
    most = None if upper == np.inf else Fraction(float(upper))
    return Row(tuple(Fraction(float(value)) for value in a), least, most)


def _rows(hierarchy: Hierarchy, k: int) -> list[Row]:
    level = hierarchy.level(k)
    return [_row(a, lower, upper) for a, lower, upper in zip(level.A, level.lower, level.upper, strict=True)]


def _distance(row: Row, z: Sequence[Fraction]) -> Fraction:
    value = row.value(z)
    if row.upper is not None and value > row.upper:
        return value - row.upper
    if row.lower is not None and value < row.lower:
        return value - row.lower
    return Fraction(0)


def _frozen(row: Row, x: Sequence[Fraction]) -> Row:
    """A row that is violated or an equality keeps its value; a satisfied inequality stays one."""
    if row.equality or _distance(row, x):
        return Row(row.a, row.value(x), row.value(x))
    return row


def _least_violation(
    rows: list[Row],
    weights: list[Fraction],
    held: list[Row],
    x: list[Fraction],
    working: list[tuple[int, int]],
) -> tuple[list[Fraction], list[tuple[int, int]]]:
    """Minimise ½ Σ w d² over the rows inside `held`, with one slack for each inequality row."""
    n = len(x)
    soft = [i for i, row in enumerate(rows) if not row.equality]
    size = n + len(soft)
    H = [[Fraction(0)] * size for _ in range(size)]
    g = [Fraction(0)] * size
    for row, w in zip(rows, weights, strict=True):
        if row.equality and row.upper is not None:
            for i in range(n):
                g[i] -= w * row.a[i] * row.upper
                for j in range(n):
                    H[i][j] += w * row.a[i] * row.a[j]
    padding = (Fraction(0),) * len(soft)
    constraints = [Row(row.a + padding, row.lower, row.upper) for row in held]
    for position, i in enumerate(soft):
        H[n + position][n + position] = weights[i]
        slack = tuple(Fraction(-1 if p == position else 0) for p in range(len(soft)))
        constraints.append(Row(rows[i].a + slack, rows[i].lower, rows[i].upper))
    start = [*x, *(_distance(rows[i], x) for i in soft)]
    z, final = _minimise(H, g, constraints, start, working)
    return z[:n], [(i, side) for i, side in final if i < len(held)]


def _minimise(
    H: list[list[Fraction]],
    g: list[Fraction],
    rows: list[Row],
    z: list[Fraction],
    working: list[tuple[int, int]],
) -> tuple[list[Fraction], list[tuple[int, int]]]:
    """Primal active set from a feasible z, Bland's rule twice. Nocedal and Wright (2006), Sect. 16.5."""
    size = len(z)
    scale = lcm(*(value.denominator for line in H for value in line))
    integers = np.array([[int(value * scale) for value in line] for line in H], dtype=object)
    normals = [_integers(row.a) for row in rows]
    tight = [(i, side) for i, side in working if _at(rows[i], side, z)]
    active = _independent([(i, 1) for i, row in enumerate(rows) if row.equality] + tight, normals, size)
    while True:
        slope = [
            sum((h * v for h, v in zip(line, z, strict=True) if h), Fraction(0)) + c
            for line, c in zip(H, g, strict=True)
        ]
        p, y = _direction(integers, scale, slope, [normals[i] for i, _ in active])
        if sum((s * d for s, d in zip(slope, p, strict=True)), Fraction(0)) == 0:
            wrong = [
                (i, side)
                for (i, side), multiplier in zip(active, y, strict=True)
                if not rows[i].equality and multiplier * side < 0
            ]
            if not wrong:
                return z, active
            active = [member for member in active if member != min(wrong)]
            continue
        step, blocking = _longest(rows, active, z, p)
        z = [v + step * d for v, d in zip(z, p, strict=True)]
        if blocking is not None:
            active = [*active, blocking]


def _longest(
    rows: list[Row], active: list[tuple[int, int]], z: list[Fraction], p: list[Fraction]
) -> tuple[Fraction, tuple[int, int] | None]:
    """How far z + α p stays inside, at most 1, and the first row that stops it."""
    held = {i for i, _ in active}
    step, blocking = Fraction(1), None
    for i, row in enumerate(rows):
        if i in held or row.equality:
            continue
        speed = row.value(p)
        bound = row.upper if speed > 0 else row.lower
        if speed != 0 and bound is not None:
            reach = (bound - row.value(z)) / speed
            if reach < step:
                step, blocking = reach, (i, 1 if speed > 0 else -1)
    return step, blocking


def _at(row: Row, side: int, z: Sequence[Fraction]) -> bool:
    return not row.equality and row.value(z) == (row.upper if side > 0 else row.lower)


def _integers(a: Sequence[Fraction]) -> list[int]:
    scale = lcm(*(value.denominator for value in a))
    return [int(value * scale) for value in a]


def _independent(
    candidates: list[tuple[int, int]], normals: list[list[int]], size: int
) -> list[tuple[int, int]]:
    """The first rows that are linearly independent, in order."""
    basis: list[tuple[int, list[Fraction]]] = []
    kept = []
    for member in candidates:
        rest = [Fraction(value) for value in normals[member[0]]]
        for pivot, line in basis:
            if rest[pivot]:
                factor = rest[pivot]
                rest = [v - factor * u for v, u in zip(rest, line, strict=True)]
        pivot = next((j for j in range(size) if rest[j]), None)
        if pivot is not None:
            basis.append((pivot, [v / rest[pivot] for v in rest]))
            kept.append(member)
    return kept


def _direction(
    H: np.ndarray, scale: int, slope: list[Fraction], normals: list[list[int]]
) -> tuple[list[Fraction], list[Fraction]]:
    """p, y with H p + Nᵀ y = −slope, N p = 0, fraction-free (Bareiss 1968); y up to positive factors."""
    size, count = len(slope), len(normals)
    common = lcm(*(value.denominator for value in slope))
    K = np.zeros((size + count, size + count + 1), dtype=object)
    K[:size, :size] = H
    for position, a in enumerate(normals):
        K[:size, size + position] = a
        K[size + position, :size] = a
    K[:size, -1] = [-int(value * common) for value in slope]
    last, row, columns = 1, 0, []
    for column in range(size + count):
        pivot = next((i for i in range(row, size + count) if K[i, column]), None)
        if pivot is None:
            continue
        K[[row, pivot]] = K[[pivot, row]]
        head = K[row].copy()
        K = (head[column] * K - np.outer(K[:, column], head)) // last
        K[row] = head
        last, row = head[column], row + 1
        columns.append(column)
    solution = [Fraction(0)] * (size + count)
    for i, column in enumerate(columns):
        solution[column] = Fraction(K[i, -1], last * common)
    return [scale * value for value in solution[:size]], solution[size:]
