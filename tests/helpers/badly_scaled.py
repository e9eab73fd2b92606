"""Random hierarchies whose numbers are spread widely, tie, or depend on each other."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level

FAMILIES = (
    "ordinary", "light rows", "weights", "norm", "full norm", "long and short rows", "ties", "dependent",
    "nearly dependent", "inequalities", "wide bounds",
)  # fmt: skip


def badly_scaled(family: str, seed: int, most: int = 4) -> Hierarchy:
    """A feasible hierarchy of 2 to `most` unknowns of one family."""
    rng = np.random.default_rng([FAMILIES.index(family), seed])
    n = int(rng.integers(2, most + 1))
    first = _draw(rng, family, 3, n)
    levels = [_level(rng, family, first, k) for k in range(int(rng.integers(1, 4)))]
    reach = np.abs(_draw(rng, family, n)) + (1.0 if family == "ties" else 0.1)
    if family == "wide bounds":
        reach = _spread(rng, 9.0, n)
    limits = None
    if rng.random() < 0.5:
        upper = np.abs(_draw(rng, family, 2))
        limits = Level(_draw(rng, family, 2, n), upper=upper, lower=np.array([-np.inf, -3.0]))
    return Hierarchy(levels, box=(-reach, reach), limits=limits, norm=_norm(rng, family, n))


def _draw(rng: np.random.Generator, family: str, *shape: int) -> Array:
    return rng.integers(-2, 3, shape).astype(float) if family == "ties" else rng.standard_normal(shape)


def _spread(rng: np.random.Generator, power: float, *shape: int) -> Array:
    return 10.0 ** rng.uniform(-power, power, shape)


def _level(rng: np.random.Generator, family: str, first: Array, k: int) -> Level:
    m, n = int(rng.integers(1, 4)), first.shape[1]
    A, b, weight = _draw(rng, family, m, n), _draw(rng, family, m), np.ones(m)
    if k == 0:
        A = first[:m].copy()
    elif family == "dependent":
        A[0] = np.round(2.0 * rng.standard_normal(3)) @ first
    elif family == "nearly dependent":
        A[0] = first[0] + 10.0 ** rng.uniform(-9.0, -4.0) * rng.standard_normal(n)
    if family == "light rows":
        A, b = A * _spread(rng, 4.0, m, 1), b * _spread(rng, 2.0, m)
    if family == "long and short rows":
        A = A * _spread(rng, 6.0, m, 1)
        b = A @ rng.standard_normal(n) + rng.standard_normal(m) * np.abs(A).max(axis=1)
    if family == "weights":
        weight = _spread(rng, 9.0, m)
    if family == "inequalities" or rng.random() < 0.3:
        width = np.abs(_draw(rng, family, m))
        lower = np.where(rng.random(m) < 0.4, -np.inf, b - width)
        return Level(A, lower=lower, upper=b + np.where(width > 0.0, width, 1.0), weight=weight)
    return Level(A, b, weight=weight)


def _norm(rng: np.random.Generator, family: str, n: int) -> Array | None:
    if family == "norm":
        return _spread(rng, 4.0, n)
    if family == "full norm":
        root = rng.standard_normal((n, n)) + 2.0 * np.eye(n)
        return (root @ root.T + (root @ root.T).T) / 2.0
    return None
