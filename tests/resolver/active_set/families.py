"""Families of hierarchies on which the search needs its heuristics; each draw is fixed by its seed."""

import numpy as np

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.base import Memory


def any_guess(seed: int, hierarchy: Hierarchy) -> Memory:
    """Return a memory that knows nothing: a random side for each unknown and row."""
    state = np.random.default_rng(seed).integers(-1, 2, hierarchy.layout.width).astype(np.int8)
    return Memory(state)


def saturated(seed: int) -> Hierarchy:
    """A 6 × 7 Jacobian with a smallest singular value of 1e-1 to 1e-9, in a box that forbids its target."""
    rng = np.random.default_rng([seed, 7])
    U, sigma, Vt = np.linalg.svd(rng.normal(size=(6, 7)))
    sigma[-1] = 10.0 ** -rng.uniform(1, 9)
    J = (U * sigma) @ Vt[:6]
    box = np.abs(rng.normal(size=7)) * 0.7 + 0.05
    return Hierarchy([Level(J, J @ rng.normal(size=7)), Level(np.eye(7), rng.normal(size=7))], (-box, box))


def cone(seed: int) -> Hierarchy:
    """Up to 150 hard rows a · x ≥ 0 in 3 to 9 unknowns, of any size: all of them tie at zero."""
    rng = np.random.default_rng([seed, 9])
    size, count, n = 10.0 ** rng.uniform(-5, 0), int(rng.integers(20, 151)), int(rng.integers(3, 10))
    normals = rng.normal(size=(count, n)) * 10.0 ** rng.uniform(-1, 1, (count, 1)) * size
    normals[:, 0] = np.abs(normals[:, 0]) + (0.5 * size if seed % 2 else 0.0)
    sizes = n // 3, n // 2, n // 2 + 1
    levels = [Level(rng.normal(size=(m, n)), 10.0 * rng.normal(size=m)) for m in sizes]
    return Hierarchy(levels, (-np.ones(n), np.ones(n)), Level(normals, lower=np.zeros(count)))


def near_pairs(seed: int) -> Hierarchy:
    """Hard rows in pairs that nearly oppose each other, below targets far away."""
    rng = np.random.default_rng([seed, 11])
    n, k, apart = int(rng.integers(3, 8)), int(rng.integers(2, 6)), 10.0 ** -rng.integers(3, 12)
    a = rng.normal(size=(k, n))
    rows = np.vstack([a, -a + apart * rng.normal(size=(k, n))])
    levels = [Level(rng.normal(size=(3, n)), 100.0 * rng.normal(size=3)) for _ in range(2)]
    return Hierarchy(levels, (-np.ones(n), np.ones(n)), Level(rows, lower=np.zeros(2 * k)))


def degenerate(seed: int) -> Hierarchy:
    """4 to 19 unknowns, levels of integer rows −1, 0, 1, most of them inequalities: ties everywhere."""
    rng = np.random.default_rng([seed, 13])
    n = int(rng.integers(4, 20))
    levels = []
    for _ in range(rng.integers(2, 6)):
        m = int(rng.integers(2, 15))
        A, b = rng.integers(-1, 2, (m, n)).astype(float), rng.integers(-1, 2, m).astype(float)
        if rng.random() < 0.35:
            levels.append(Level(A, b * 3))
        else:
            levels.append(Level(A, upper=b) if rng.random() < 0.5 else Level(A, lower=b - 1, upper=b))
    return Hierarchy(levels, (-np.ones(n), np.ones(n)) if rng.random() < 0.7 else None)
