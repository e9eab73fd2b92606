"""Families of random hierarchies whose numbers differ much in size, tie, or depend on each other.

Each problem comes twice, with right-hand sides that differ by about a percent, so that
a resolver can be tried cold and with the memory of the first one. Numbers are multiples of 1/64, times powers
of two, and every hard limit holds at x = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level

Pair = tuple[Hierarchy, Hierarchy]
Draw = Callable[[np.random.Generator, int], "_Parts"]
_GRID = 64.0  # entries are multiples of 1/64, which keeps exact references quick


@dataclass
class _Parts:
    """The numbers of a hierarchy before it is made.

    Attributes:
        A: Rows of each level, (m, n) each.
        b: Right-hand side of each level, (m,).
        width: Width of the interval below and above b, (m,) of each level; 0 for equalities.
        weight: Weights of each level, (m,).
        reach: Bounds ± of x, (n,); inf for none.
        hard: Hard rows, (h, n).
        room: Bounds ± of the hard rows, (h,); 0 for equalities through x = 0.
        norm: Diagonal of the norm, (n,).
    """

    A: list[Array]
    b: list[Array]
    width: list[Array]
    weight: list[Array]
    reach: Array
    hard: Array
    room: Array
    norm: Array
    target: Array = field(default_factory=lambda: np.zeros(0))

    def made(self) -> Hierarchy:
        """Return the hierarchy."""
        levels = [
            Level(A, lower=b - width, upper=b + width, weight=weight)
            for A, b, width, weight in zip(self.A, self.b, self.width, self.weight, strict=True)
        ]
        middle = self.target if len(self.target) else np.zeros(len(self.hard))
        limits = (
            Level(self.hard, lower=middle - self.room, upper=middle + self.room) if len(self.hard) else None
        )
        return Hierarchy(levels, (-self.reach, self.reach), limits, self.norm)

    def moved(self, rng: np.random.Generator) -> "_Parts":
        """Return the same parts with right-hand sides that are about a percent larger or smaller."""
        return replace(self, b=[b * (1.0 + rng.integers(-2, 3, b.shape) / 256.0) for b in self.b])


def _draw(rng: np.random.Generator, *shape: int) -> Array:
    """Draw normal numbers on the grid."""
    return np.round(_GRID * rng.normal(size=shape)) / _GRID


def _spread(rng: np.random.Generator, decades: float, *shape: int) -> Array:
    """Draw powers of two between 10^−decades and 10^decades."""
    return np.exp2(np.round(np.log2(10.0) * rng.uniform(-decades, decades, shape)))


def _plain(rng: np.random.Generator, n: int) -> _Parts:
    """Draw a well-scaled problem."""
    sizes = rng.integers(1, 4 + n // 8, int(rng.integers(1, 4)))
    A = [_draw(rng, m, n) for m in sizes]
    width = [np.abs(_draw(rng, m)) * (rng.random() < 0.3) for m in sizes]
    reach = np.abs(_draw(rng, n)) + 0.125 if rng.random() < 0.8 else np.full(n, np.inf)
    hard = _draw(rng, int(rng.integers(0, 3)), n)
    room = np.abs(_draw(rng, len(hard))) + 0.125
    b = [2.0 * _draw(rng, m) for m in sizes]
    return _Parts(A, b, width, [np.ones(m) for m in sizes], reach, hard, room, np.ones(n))


def _rows(decades: float) -> Draw:
    """Return a family whose rows of one level, with their bounds, differ in size."""

    def draw(rng: np.random.Generator, n: int) -> _Parts:
        """Draw one problem."""
        parts = _plain(rng, n)
        for k, A in enumerate(parts.A):
            size = _spread(rng, decades, len(A))
            parts.A[k], parts.b[k], parts.width[k] = (
                A * size[:, None],
                parts.b[k] * size,
                parts.width[k] * size,
            )
        return parts

    return draw


def _weights(decades: float) -> Draw:
    """Return a family whose weights in one level differ in size."""

    def draw(rng: np.random.Generator, n: int) -> _Parts:
        """Draw one problem."""
        parts = _plain(rng, n)
        return replace(parts, weight=[_spread(rng, decades, len(b)) for b in parts.b])

    return draw


def _norms(rng: np.random.Generator, n: int) -> _Parts:
    """Draw a problem whose norm weighs unknowns differently."""
    parts = _plain(rng, n)
    return replace(parts, norm=_spread(rng, 4.0, len(parts.norm)))


def _bounds(rng: np.random.Generator, n: int) -> _Parts:
    """Draw a problem whose bounds differ in size."""
    parts = _plain(rng, n)
    size, room = _spread(rng, 9.0, len(parts.norm)), _spread(rng, 9.0, len(parts.room))
    return replace(parts, reach=np.where(rng.random(len(size)) < 0.5, size, 1.0), room=room)


def _ties(rng: np.random.Generator, n: int) -> _Parts:
    """Draw small integers, with which bounds and rows meet in points and multipliers are zero."""
    parts = _plain(rng, n)
    for k, A in enumerate(parts.A):
        parts.A[k] = rng.integers(-1, 2, A.shape).astype(float)
        parts.b[k] = rng.integers(-2, 3, len(A)).astype(float)
        parts.width[k] = rng.integers(0, 2, len(A)).astype(float)
    hard = rng.integers(-1, 2, parts.hard.shape).astype(float)
    return replace(parts, reach=np.ones_like(parts.norm), hard=hard, room=np.ones(len(hard)))


def _dependent(rng: np.random.Generator, n: int) -> _Parts:
    """Draw a problem in which one row depends on another one up to 1e-9 … 1e-4."""
    parts = _plain(rng, n)
    last, first = parts.A[-1], parts.A[0]
    last[-1] = first[0] * float(rng.choice([-1.0, 1.0, 2.0])) + _spread(rng, 2.5) * 2.0**-21 * _draw(
        rng, len(first[0])
    )
    if rng.random() < 0.5:
        parts.b[-1][-1] = parts.b[0][0]
    return parts


def _light(rng: np.random.Generator, n: int) -> _Parts:
    """Draw a problem in whose first level a posture weighs 1e-6 beside the rows, or is that much shorter."""
    parts = _plain(rng, n)
    m = len(parts.b[0])
    light, short = (2.0**-20, 1.0) if rng.random() < 0.5 else (1.0, 2.0**-20)
    parts.A[0] = np.vstack([parts.A[0], short * np.eye(n)])
    parts.b[0] = np.concatenate([parts.b[0], short * _draw(rng, n)])
    parts.width[0] = np.concatenate([parts.width[0], np.zeros(n)])
    parts.weight[0] = np.concatenate([np.ones(m), np.full(n, light)])
    return parts


def _no_level(rng: np.random.Generator, n: int) -> _Parts:
    """Draw hard equalities and a norm, with no level."""
    parts = _plain(rng, n)
    hard = _draw(rng, int(rng.integers(1, n)), n)
    inside = 0.5 * np.sign(_draw(rng, n)) * np.where(np.isinf(parts.reach), 1.0, parts.reach)
    parts = replace(parts, A=[], b=[], width=[], weight=[], hard=hard, room=np.zeros(len(hard)))
    return replace(parts, target=hard @ inside, norm=_spread(rng, 3.0, n))


DEPENDENT = "dependent rows"
"""The family whose rows depend on each other up to rounding, so that not every right answer can be proven."""

FAMILIES: dict[str, Draw] = {
    "well scaled": _plain,
    "no level": _no_level,
    "ties": _ties,
    "rows 1e±3": _rows(3.0),
    "weights 1e±3": _weights(3.0),
    "rows 1e±6": _rows(6.0),
    "weights 1e±6": _weights(6.0),
    "weights 1e±12": _weights(12.0),
    "norms 1e±4": _norms,
    "bounds 1e-9…1e9": _bounds,
    "light rows": _light,
    DEPENDENT: _dependent,
}
"""Families by name."""

ORDINARY = tuple(FAMILIES)[:5]
"""Families with rows and weights within 10^±3."""


def scaled_problem(family: str, seed: int, most: int = 6) -> Pair:
    """Draw a problem, and one before it whose right-hand sides differ by about a percent.

    Args:
        family: A name in `FAMILIES`.
        seed: Another seed draws another problem.
        most: Largest number of unknowns; the smallest is 2.

    Returns:
        The hierarchy before, and the hierarchy.
    """
    rng = np.random.default_rng([seed, most, *family.encode()])
    parts = FAMILIES[family](rng, int(rng.integers(2, most + 1)))
    return parts.moved(rng).made(), parts.made()
