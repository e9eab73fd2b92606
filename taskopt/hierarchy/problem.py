"""What a stack becomes at one tick: rows in strict levels inside hard limits, and their names.

Level k = 1, 2, … asks for lower ≤ A x ≤ upper in weighted least squares (equality is
lower = upper), strictly after the levels before it; what stays free is decided by the norm:

    lex min ( ½ Σ w_i d_i(x)² of level 1, of level 2, …, ½ xᵀ W x )
    s.t.    box_lower ≤ x ≤ box_upper,  lower_0 ≤ A_0 x ≤ upper_0,

d_i being the distance of (A x)_i to its interval. Kanoun, Lamiraux and Wieber (2011), IEEE Trans.
Robotics 27(4); Escande, Mansard and Wieber (2014), Int. J. Robotics Research 33(7).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taskopt.arrays import Array, bound, finite
from taskopt.errors import Infeasible, InvalidValue
from taskopt.hierarchy.layout import Block, Layout, numbered


class Level:
    """Rows of one priority: A x = b, or lower ≤ A x ≤ upper, each with a weight and a name.

    `A` is (m, n). Give `b` for equalities, `lower` and/or `upper` for inequalities (±inf: no bound
    on that side); with both, the level holds the equalities and, below them, the inequalities on
    the same A. `weight` multiplies ½ d² of each row: one number, or one a row.
    """

    def __init__(
        self,
        A: ArrayLike,
        b: ArrayLike | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        *,
        weight: ArrayLike = 1.0,
        name: str = "",
    ) -> None:
        matrix = finite("A", A, (None, None))
        m = matrix.shape[0]
        if b is None and lower is None and upper is None:
            raise InvalidValue("a level needs b, or lower and upper: it has neither")
        parts = [] if b is None else [(finite("b", b, (m,)),) * 2]
        if lower is not None or upper is not None:
            low = np.full(m, -np.inf) if lower is None else bound("lower", lower, (m,))
            high = np.full(m, np.inf) if upper is None else bound("upper", upper, (m,))
            parts.append((low, high))
        self.name = name
        self.A = np.vstack([matrix] * len(parts))
        self.lower = np.concatenate([low for low, _ in parts])
        self.upper = np.concatenate([high for _, high in parts])
        _ordered(self.lower, self.upper, name or "level")
        self.weight = _weights(weight, m, len(parts))

    def __repr__(self) -> str:
        equal = int((self.lower == self.upper).sum())
        return f"Level({self.name!r}, {equal} equalities, {len(self.lower) - equal} inequalities)"


@dataclass(frozen=True, eq=False)
class LevelRows:
    """The rows of one level as views into a hierarchy: A (m, n), lower, upper, weight (m,)."""

    A: Array
    lower: Array
    upper: Array
    weight: Array

    def distance(self, x: Array) -> Array:
        """Signed distance of A x to [lower, upper], (m,): > 0 above upper, < 0 below lower."""
        value = self.A @ x
        return value - np.clip(value, self.lower, self.upper)

    def cost(self, x: Array) -> float:
        """½ Σ w d², what this level minimises."""
        return 0.5 * float(self.weight @ self.distance(x) ** 2)


class Hierarchy:
    """Levels of rows in strict order, hard limits around them, and the norm of what stays free.

    `levels`: `Level`s, or (A, b) pairs, highest priority first. `box`: bounds (lower, upper) on x,
    (n,) each. `limits`: a `Level` (or pair) whose rows must hold. `norm`: W, the diagonal (n,) or symmetric
    positive definite (n, n); default identity. `unknowns`: names of x. Raises `InvalidValue` for
    wrong shapes or NaN, and `Infeasible` where a lower bound exceeds its upper bound.
    """

    def __init__(
        self,
        levels: Sequence[Level | tuple[Any, Any]],
        box: tuple[ArrayLike, ArrayLike] | None = None,
        limits: Level | tuple[Any, Any] | None = None,
        norm: ArrayLike | None = None,
        unknowns: Sequence[str] = (),
    ) -> None:
        if isinstance(levels, Level) or not isinstance(levels, Iterable):
            raise InvalidValue(f"levels must be a sequence of levels, got {type(levels).__name__}")
        ranks = [_as_level(level, "a level") for level in levels]
        hard = [] if limits is None else [_as_level(limits, "limits")]
        n = _common_columns([*ranks, *hard], box)
        self.layout = _layout(ranks, hard[0] if hard else None, n, unknowns)
        self.norm = checked_norm(norm, n)
        self.buffer = np.empty(self.layout.size)
        self.owner[:] = 0.0
        stacked = hard + ranks
        if stacked:
            self.A[:] = np.vstack([level.A for level in stacked])
            self.lower[:] = np.concatenate([level.lower for level in stacked])
            self.upper[:] = np.concatenate([level.upper for level in stacked])
            self.weight[:] = np.concatenate([level.weight for level in stacked])
        low, high = (np.full(n, -np.inf), np.full(n, np.inf)) if box is None else box
        self.box_lower[:] = bound("box lower", low, (n,))
        self.box_upper[:] = bound("box upper", high, (n,))
        _ordered(self.box_lower, self.box_upper, "box")

    @staticmethod
    def view(layout: Layout, buffer: Array, norm: Array) -> "Hierarchy":
        """A hierarchy over arrays that somebody else fills; nothing is copied or checked."""
        self = object.__new__(Hierarchy)
        self.layout, self.buffer, self.norm = layout, buffer, norm
        return self

    def copy(self) -> "Hierarchy":
        """The same problem in memory of its own."""
        return Hierarchy.view(self.layout, self.buffer.copy(), self.norm)

    def save(self, path: str | Path) -> None:
        """Write the problem, names and all, to one .npz file, to be resolved elsewhere."""
        from taskopt.hierarchy.io import write

        write(self, Path(path))

    @staticmethod
    def load(path: str | Path) -> "Hierarchy":
        """What `save` wrote, bit by bit. Raises `MissingFile`, or `InvalidValue` if it is no such file."""
        from taskopt.hierarchy.io import read

        return read(Path(path))

    @property
    def norm(self) -> Array:
        """W, (n,) or (n, n), read-only: copies and resolutions share it."""
        return self._norm

    @norm.setter
    def norm(self, W: Array) -> None:
        self._norm = W.view()
        self._norm.flags.writeable = False

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self.layout.n

    @cached_property
    def A(self) -> Array:
        """All rows, (M, n): hard limits, then level by level."""
        return self._part(0, self.layout.row_count * self.n).reshape(self.layout.row_count, self.n)

    @cached_property
    def lower(self) -> Array:
        return self._vector(0)

    @cached_property
    def upper(self) -> Array:
        return self._vector(1)

    @cached_property
    def weight(self) -> Array:
        return self._vector(2)

    @cached_property
    def box_lower(self) -> Array:
        return self._part(self.layout.size - 4 * self.n, self.n)

    @cached_property
    def box_upper(self) -> Array:
        return self._part(self.layout.size - 3 * self.n, self.n)

    @cached_property
    def owner(self) -> Array:
        """(2, n): which of `layout.owners` each lower and each upper bound of the box comes from."""
        return self._part(self.layout.size - 2 * self.n, 2 * self.n).reshape(2, self.n)

    @cached_property
    def limits(self) -> LevelRows:
        """The hard rows that are not bounds on a single unknown."""
        return self.level(0)

    @cached_property
    def levels(self) -> tuple[LevelRows, ...]:
        """The levels in order of priority."""
        return tuple(self.level(k) for k in range(1, self.layout.level_count + 1))

    def level(self, k: int) -> LevelRows:
        """Rows of level k (0: hard limits, 1: first priority, …), as views."""
        rows = self.layout.rows_of_level(k)
        return LevelRows(self.A[rows], self.lower[rows], self.upper[rows], self.weight[rows])

    def norm_matrix(self) -> Array:
        """W as (n, n)."""
        return np.diag(self.norm) if self.norm.ndim == 1 else self.norm

    def bound_name(self, j: int, upper: bool) -> str:
        """Name of the limit that the bound on unknown j comes from, and of the unknown."""
        owner = self.layout.owners[int(self.owner[int(upper), j])]
        return f"{owner}/{self.layout.unknowns[j]}"

    def _part(self, start: int, length: int) -> Array:
        return self.buffer[start : start + length]

    def _vector(self, which: int) -> Array:
        count = self.layout.row_count
        return self._part(count * self.n + which * count, count)

    def __repr__(self) -> str:
        levels = ", ".join(str(len(level.lower)) for level in self.levels)
        return f"Hierarchy({self.n} unknowns, rows by level: {levels}; {len(self.limits.lower)} hard rows)"


def checked_norm(norm: ArrayLike | None, n: int) -> Array:
    """W as an array: the diagonal (n,) or a symmetric positive definite (n, n) matrix."""
    if norm is None:
        return np.ones(n)
    diagonal = np.ndim(norm) <= 1
    matrix = finite("norm", norm, (n,) if diagonal else (n, n))
    smallest = matrix.min() if diagonal else np.linalg.eigvalsh((matrix + matrix.T) / 2).min()
    if smallest <= 0.0 or not (diagonal or np.allclose(matrix, matrix.T, rtol=1e-12, atol=0.0)):
        raise InvalidValue(f"norm must be symmetric and positive definite; least eigenvalue {smallest:g}")
    return matrix


def _common_columns(levels: Sequence[Level], box: tuple[ArrayLike, ArrayLike] | None) -> int:
    """The number of unknowns that all parts agree on."""
    sizes = {level.A.shape[1] for level in levels}
    if box is not None:
        if not isinstance(box, Sequence | np.ndarray) or len(box) != 2:
            raise InvalidValue(f"box must be a pair (lower, upper), got {box!r}")
        sizes |= {int(np.size(side)) for side in box}
    if len(sizes) != 1:
        what = "no level and no box" if not sizes else f"columns {sorted(sizes)}"
        raise InvalidValue(f"all levels, limits and the box must have one number of unknowns, got {what}")
    return sizes.pop()


def _layout(ranks: Sequence[Level], limits: Level | None, n: int, unknowns: Sequence[str]) -> Layout:
    """Blocks in order, each under a name of its own."""
    if unknowns and (len(unknowns) != n or len(set(unknowns)) != n):
        raise InvalidValue(f"unknowns must be {n} names, each different, got {tuple(unknowns)}")
    parts = [(k, level) for k, level in enumerate([limits, *ranks]) if level is not None]
    names = numbered(level.name or (f"level {k}" if k else "limits") for k, level in parts)
    blocks: list[Block] = []
    start = 0
    for name, (k, level) in zip(names, parts, strict=True):
        m = len(level.lower)
        rows = tuple(f"row {i}" for i in range(m))
        blocks.append(Block(name, k, start, start + m, rows, ("",) * m))
        start += m
    of_x = tuple(unknowns) or tuple(f"x{j}" for j in range(n))
    return Layout(of_x, tuple(blocks), len(ranks))


def _as_level(value: Any, what: str) -> Level:
    """A `Level`, or an (A, b) pair made one."""
    if isinstance(value, Level):
        return value
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise InvalidValue(f"{what} must be a Level or a pair (A, b), got {type(value).__name__}")
    return Level(*value)


def _ordered(lower: Array, upper: Array, name: str) -> None:
    wrong = np.flatnonzero((lower > upper) | (lower == np.inf) | (upper == -np.inf))
    if wrong.size:
        i = int(wrong[0])
        raise Infeasible(
            f"{name}: bound {i} is empty, lower {lower[i]:g} and upper {upper[i]:g}; "
            "lower must not exceed upper"
        )


def _weights(weight: ArrayLike, m: int, parts: int) -> Array:
    w = finite("weight", weight, (m,) if np.ndim(weight) else ())
    if (w <= 0.0).any():
        raise InvalidValue(f"weight must be > 0, got {w.min():g}")
    return np.tile(np.broadcast_to(w, (m,)), parts)
