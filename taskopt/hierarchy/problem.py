"""A hierarchy: rows in strict levels inside hard limits at one tick, with their names.

Level k = 1, 2, … asks for lower ≤ A x ≤ upper in weighted least squares (an equality is lower = upper),
without making any level before it worse. The norm decides the directions that all levels leave free:

    lex min ( ½ Σ w_i d_i(x)² of level 1, of level 2, …, ½ xᵀ W x )
    s.t.    box_lower ≤ x ≤ box_upper,  lower_0 ≤ A_0 x ≤ upper_0,

where d_i is the distance of (A x)_i to its interval. Kanoun, Lamiraux and Wieber (2011), IEEE Trans.
Robotics 27(4); Escande, Mansard and Wieber (2014), Int. J. Robotics Research 33(7).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from taskopt.arrays import Array, ArrayLike, bound, finite
from taskopt.errors import Infeasible, InvalidValue
from taskopt.hierarchy import io, lexls_file
from taskopt.hierarchy.intervals import signed_distance
from taskopt.hierarchy.layout import Block, Layout, numbered
from taskopt.hierarchy.tolerances import SYMMETRY
from taskopt.hierarchy.view import Rows, box_of, rows_of

Pair = tuple[ArrayLike, ArrayLike]  # (A, b) of equalities


class Level:
    """Rows of one priority: A x = b, or lower ≤ A x ≤ upper, each with a weight.

    If both `b` and bounds are given, the level has the equalities first and then the inequalities on the same
    A.

    Args:
        A: Rows, (m, n).
        b: Right-hand sides of equalities, (m,).
        lower: Lower bounds of A x, (m,); −inf where there is none.
        upper: Upper bounds of A x, (m,); inf where there is none.
        weight: Factor w > 0 of ½ d² of each row: one number, or (m,).
        name: Name of the level's rows in tables and sentences.

    Raises:
        InvalidValue: A shape is wrong, a number is NaN, a weight is not positive, or all of `b`, `lower` and
            `upper` are missing.
        Infeasible: A lower bound exceeds its upper bound.
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
            below = np.full(m, -np.inf) if lower is None else bound("lower", lower, (m,))
            above = np.full(m, np.inf) if upper is None else bound("upper", upper, (m,))
            parts.append((below, above))
        self.name = name
        self.A = np.vstack([matrix] * len(parts))
        self.lower = np.concatenate([below for below, _ in parts])
        self.upper = np.concatenate([above for _, above in parts])
        _check_order(self.lower, self.upper, name or "level")
        self.weight = _weights(weight, m, len(parts))

    def __repr__(self) -> str:
        equal = int((self.lower == self.upper).sum())
        return f"Level({self.name!r}, {equal} equalities, {len(self.lower) - equal} inequalities)"


@dataclass(frozen=True, eq=False)
class LevelRows:
    """The rows of one level, as views into a hierarchy.

    Attributes:
        A: Rows, (m, n).
        lower: Lower bounds of A x, (m,).
        upper: Upper bounds of A x, (m,).
        weight: Weights, (m,).
        label: Labels, see `view.Rows`, (m,); empty where nobody reads or writes them.
    """

    A: Array
    lower: Array
    upper: Array
    weight: Array
    label: Array = field(default_factory=lambda: np.zeros(0))

    def distance(self, x: Array) -> Array:
        """Return the signed distance of A x to its interval.

        Args:
            x: The unknowns, (n,).

        Returns:
            (m,): positive above the upper bound, negative below the lower one, 0 inside.
        """
        return signed_distance(self.A @ x, self.lower, self.upper)

    def cost(self, x: Array) -> float:
        """Return the cost that the level minimises, ½ Σ w d².

        Args:
            x: The unknowns, (n,).

        Returns:
            The cost at x.
        """
        return 0.5 * float(self.weight @ self.distance(x) ** 2)


class Hierarchy:
    """A problem of one tick: levels of rows in strict order, hard limits, and the norm W.

    Args:
        levels: The levels, highest priority first, each a `Level` or a pair (A, b).
        box: Bounds (lower, upper) of x, (n,) each; None for no bounds.
        limits: Hard rows, as a `Level` or a pair (A, b); they hold whatever the levels ask for.
        norm: W, symmetric and positive definite (n, n), or its diagonal (n,). Of all x that are optimal for
            all levels, that with the least ½ xᵀ W x is the answer. None for the identity.
        unknowns: Names of the entries of x; by default x0, x1, ….

    Raises:
        InvalidValue: A shape is wrong, a number is NaN, or W is not positive definite.
        Infeasible: A lower bound exceeds its upper bound.
    """

    def __init__(
        self,
        levels: Sequence[Level | Pair],
        box: Pair | None = None,
        limits: Level | Pair | None = None,
        norm: ArrayLike | None = None,
        unknowns: Sequence[str] = (),
    ) -> None:
        if isinstance(levels, Level) or not isinstance(levels, Iterable):
            raise InvalidValue(f"levels must be a sequence of levels, got {type(levels).__name__}")
        ranks = [_as_level(level, "a level") for level in levels]
        hard = [] if limits is None else [_as_level(limits, "limits")]
        n = _common_columns([*ranks, *hard], box)
        self.layout = _layout(ranks, hard[0] if hard else None, n, unknowns)
        self.norm = _read_only(checked_norm(norm, n))
        self.buffer = np.empty(self.layout.size)
        self.owner[:] = 0.0
        self.label[:] = 0.0
        stacked = hard + ranks
        if stacked:
            self.A[:] = np.vstack([level.A for level in stacked])
            self.lower[:] = np.concatenate([level.lower for level in stacked])
            self.upper[:] = np.concatenate([level.upper for level in stacked])
            self.weight[:] = np.concatenate([level.weight for level in stacked])
        below, above = (np.full(n, -np.inf), np.full(n, np.inf)) if box is None else box
        self.box_lower[:] = bound("box lower", below, (n,))
        self.box_upper[:] = bound("box upper", above, (n,))
        _check_order(self.box_lower, self.box_upper, "box")

    @staticmethod
    def view(layout: Layout, buffer: Array, norm: Array) -> "Hierarchy":
        """Make a hierarchy of existing arrays, without copies and checks.

        Args:
            layout: Names and sizes.
            buffer: The flat buffer, (`layout.size`,).
            norm: W, (n,) or (n, n).

        Returns:
            The hierarchy; it changes when the buffer is written to.
        """
        self = object.__new__(Hierarchy)
        self.layout, self.buffer, self.norm = layout, buffer, _read_only(norm)
        return self

    def copy(self) -> "Hierarchy":
        """Copy the problem; the layout and the norm, which never change, are shared."""
        return Hierarchy.view(self.layout, self.buffer.copy(), self.norm)

    def save(self, path: str | Path) -> None:
        """Write the problem with its names to one .npz file, so that it can be resolved elsewhere.

        Args:
            path: The file; it is written completely or not at all.
        """
        io.write(Path(path), self.layout, self.buffer, self.norm)

    @staticmethod
    def load(path: str | Path) -> "Hierarchy":
        """Read a hierarchy that `save` wrote, with all numbers the same to the last bit, or a file of LexLS.

        In a file of LexLS (see `taskopt.hierarchy.lexls_file`) a first objective of simple bounds is the box.
        The others are the levels, and the norm is the identity.

        Args:
            path: The file.

        Returns:
            The hierarchy.

        Raises:
            MissingFile: There is no such file.
            InvalidValue: `save` did not write it, and it is no file of LexLS.
        """
        if Path(path).is_file() and lexls_file.is_lexls(Path(path)):
            box, levels = lexls_file.read(Path(path))
            return Hierarchy([Level(A, lower=low, upper=up) for A, low, up in levels], box=box)
        return Hierarchy.view(*io.read(Path(path)))

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self.layout.n

    @cached_property
    def rows(self) -> Rows:
        """All numbers as views into the buffer."""
        layout = self.layout
        return rows_of(self.buffer, layout.n, self.norm, layout.offsets, layout.columns)

    @property
    def A(self) -> Array:
        """All rows, (M, n): hard rows first, then level by level."""
        return self.rows.A

    @property
    def lower(self) -> Array:
        """Lower bounds of A x, (M,)."""
        return self.rows.lower

    @property
    def upper(self) -> Array:
        """Upper bounds of A x, (M,)."""
        return self.rows.upper

    @property
    def weight(self) -> Array:
        """Weights of the rows in their levels, (M,)."""
        return self.rows.weight

    @property
    def label(self) -> Array:
        """Label of each row, (M,): 0 for its own name, else a number in `choices` of its block, from 1 on."""
        return self.rows.label

    @property
    def box_lower(self) -> Array:
        """Lower bounds of x, (n,)."""
        return self.rows.box_lower

    @property
    def box_upper(self) -> Array:
        """Upper bounds of x, (n,)."""
        return self.rows.box_upper

    @cached_property
    def owner(self) -> Array:
        """Index in `layout.owners` of the limit behind each lower and each upper bound of x, (2, n)."""
        return box_of(self.buffer, self.layout.n)[2:]

    @cached_property
    def limits(self) -> LevelRows:
        """The hard rows that are not bounds on a single unknown."""
        return self.level(0)

    @cached_property
    def levels(self) -> tuple[LevelRows, ...]:
        """The levels in order of priority."""
        return tuple(self.level(k) for k in range(1, self.layout.level_count + 1))

    def level(self, k: int) -> LevelRows:
        """Return the rows of one level as views.

        Args:
            k: 0 for the hard rows, 1 for the first priority, and so on.

        Returns:
            The rows.
        """
        rows = self.layout.rows_of_level(k)
        parts = self.A, self.lower, self.upper, self.weight, self.label
        return LevelRows(*(part[rows] for part in parts))

    def norm_matrix(self) -> Array:
        """Return W as a matrix, (n, n)."""
        return np.diag(self.norm) if self.norm.ndim == 1 else self.norm

    def bounds(self, stop: int | None = None) -> tuple[Array, Array]:
        """Return the lower and the upper bounds of the unknowns, followed by those of the rows.

        Args:
            stop: Take only the rows before this one; None for all.

        Returns:
            Two copies, (n + M,) each.
        """
        lower = np.concatenate([self.box_lower, self.lower[:stop]])
        return lower, np.concatenate([self.box_upper, self.upper[:stop]])

    def values(self, x: Array, stop: int | None = None) -> Array:
        """Return x followed by A x, which are the values that `bounds` bounds.

        Args:
            x: The unknowns, (n,).
            stop: Take only the rows before this one; None for all.

        Returns:
            (n + M,).
        """
        return np.concatenate([x, self.A[:stop] @ x])

    def name_of(self, i: int, upper: bool) -> str:
        """Return the name of a bound: that of its limit and unknown, or that of its row.

        Args:
            i: Index of an unknown, i < n, or n plus the index of a row.
            upper: True for the upper bound; the two bounds of an unknown may come from different limits.

        Returns:
            A name such as "velocity/joint4" or "hand/x".
        """
        n = self.layout.n
        if i >= n:
            return self.layout.row_name(i - n, int(self.label[i - n]))
        owner = self.layout.owners[int(self.owner[int(upper), i])]
        return f"{owner}/{self.layout.unknowns[i]}"

    def __repr__(self) -> str:
        levels = ", ".join(str(len(level.lower)) for level in self.levels)
        return f"Hierarchy({self.n} unknowns, rows by level: {levels}; {len(self.limits.lower)} hard rows)"


def checked_norm(norm: ArrayLike | None, n: int) -> Array:
    """Check the matrix W of the norm ½ xᵀ W x, and return it as an array.

    Args:
        norm: The diagonal (n,), a symmetric positive definite matrix (n, n), or None for the identity.
        n: Number of unknowns.

    Returns:
        W, (n,) or (n, n).

    Raises:
        InvalidValue: The shape is wrong, or W is not symmetric and positive definite.
    """
    if norm is None:
        return np.ones(n)
    diagonal = np.ndim(norm) <= 1
    matrix = finite("norm", norm, (n,) if diagonal else (n, n))
    smallest = matrix.min() if diagonal else np.linalg.eigvalsh((matrix + matrix.T) / 2).min()
    if smallest <= 0.0 or not (diagonal or np.allclose(matrix, matrix.T, rtol=SYMMETRY, atol=0.0)):
        raise InvalidValue(f"norm must be symmetric and positive definite; least eigenvalue {smallest:g}")
    return matrix


def _read_only(norm: Array) -> Array:
    """Return a read-only view of W, since copies and resolutions share it."""
    view = norm.view()
    view.flags.writeable = False
    return view


def _common_columns(levels: Sequence[Level], box: Pair | None) -> int:
    """Return the number of unknowns that all parts agree on."""
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
    """Return the layout: blocks in order, each under a name of its own."""
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


def _as_level(value: Level | Pair, what: str) -> Level:
    """Return a `Level` as it is, and a pair (A, b) as a level of equalities."""
    if isinstance(value, Level):
        return value
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise InvalidValue(f"{what} must be a Level or a pair (A, b), got {type(value).__name__}")
    return Level(*value)


def _check_order(lower: Array, upper: Array, name: str) -> None:
    """Raise `Infeasible` where an interval is empty."""
    wrong = np.flatnonzero((lower > upper) | (lower == np.inf) | (upper == -np.inf))
    if wrong.size:
        i = int(wrong[0])
        raise Infeasible(
            f"{name}: bound {i} is empty, lower {lower[i]:g} and upper {upper[i]:g}; "
            "lower must not exceed upper"
        )


def _weights(weight: ArrayLike, m: int, parts: int) -> Array:
    """Return the weights of m rows, repeated `parts` times."""
    w = finite("weight", weight, (m,) if np.ndim(weight) else ())
    if (w <= 0.0).any():
        raise InvalidValue(f"weight must be > 0, got {w.min():g}")
    return np.tile(np.broadcast_to(w, (m,)), parts)
