"""A search for multipliers that make a wrong answer look right.

An x is moved along a direction that neither the first level nor the hard rows notice, and beside it by about
1e-9, so that the gradient of the first level is cancelled by tiny multipliers of bounds far away. KKT
conditions that are looked at up to rounding let them pass, and take such bounds for rows of either sign from
then on; the multipliers of all later levels are fitted by them. Of some tries the one with the smallest KKT
residual is kept.
"""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, Mask, StateArray
from taskopt.hierarchy.certificate import certify
from taskopt.hierarchy.intervals import signed_distance
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.tolerances import FIT_RANK, PLANTED_MULTIPLIER

_TRIES = 4  # plantings, of which the best is kept


class Planted(NamedTuple):
    """A wrong answer with its multipliers.

    Attributes:
        x: The answer, (n,).
        state: The active set that the multipliers suggest, (n + M,).
        residual: Its largest KKT residual.
    """

    x: Array
    state: StateArray
    residual: float


def planted(hierarchy: Hierarchy, right: Array, state: StateArray, rng: np.random.Generator) -> Planted:
    """Move an answer and plant multipliers that hide it.

    Args:
        hierarchy: The problem.
        right: Its optimum, (n,).
        state: The active set of the optimum, (n + M,).
        rng: Source of random numbers.

    Returns:
        The best of some tries.
    """
    tries = [_planting(hierarchy, right, state, rng) for _ in range(_TRIES)]
    return min(tries, key=lambda lie: lie.residual)


def _planting(hierarchy: Hierarchy, right: Array, state: StateArray, rng: np.random.Generator) -> Planted:
    """Move x, plant tiny multipliers of the box at the first level, and fit those of later levels."""
    n, offsets = hierarchy.n, hierarchy.layout.offsets
    rows, (lower, upper) = np.vstack([np.eye(n), hierarchy.A]), hierarchy.bounds()
    x, tiny = _moved(hierarchy, right, rng)
    free = (lower == upper) | (state != 0)
    y = np.zeros((len(offsets) - 1, len(rows)))
    for k, gradient in enumerate(_gradients(hierarchy, x)):
        before = n + int(offsets[k + 1])
        chosen = np.flatnonzero(free[:before])
        rest = -gradient - (tiny if k == 0 else 0.0)
        if len(chosen):
            y[k, chosen] = np.linalg.lstsq(rows[chosen].T, rest, rcond=None)[0]
        if k == 0:
            y[0, :n] += tiny
            free[:n] |= _nearer(x, lower[:n], upper[:n], tiny)
    hint = np.sign(y[np.argmax(y != 0.0, axis=0), np.arange(len(rows))]).astype(np.int8)
    hint[np.isinf(np.where(hint > 0, upper, lower))] = 0
    return Planted(x, hint, certify(hierarchy, x, y).worst)


def _moved(hierarchy: Hierarchy, right: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return x, and multipliers of the box (n,) that cancel what its first gradient has gained."""
    far = right + 10.0 ** rng.uniform(-7.0, 0.0) * _direction(hierarchy, rng) * max(1.0, np.abs(right).max())
    if not hierarchy.levels:
        return far, np.zeros(hierarchy.n)
    first = hierarchy.levels[0]
    root = np.sqrt(first.weight)[:, None] * first.A
    scale = float((root * root).sum(axis=1).max()) * max(1.0, float(np.abs(far).max()))
    tiny = root.T @ rng.normal(size=len(root))
    tiny *= PLANTED_MULTIPLIER * scale / max(float(np.abs(tiny).max()), np.finfo(float).tiny)
    beside = np.linalg.lstsq(root, np.linalg.lstsq(root.T, -tiny, rcond=None)[0], rcond=None)[0]
    return far + beside, tiny


def _direction(hierarchy: Hierarchy, rng: np.random.Generator) -> Array:
    """Return a direction of size 1 that changes no hard row and no row of the first level, if it can."""
    rows = hierarchy.A[: hierarchy.layout.offsets[min(2, len(hierarchy.levels) + 1)]]
    free = np.eye(hierarchy.n)
    if len(rows):
        _, sizes, axes = np.linalg.svd(rows)
        free = axes[int((sizes > FIT_RANK * sizes[0]).sum()) :]
    if not len(free):
        free = np.eye(hierarchy.n)
    direction = rng.normal(size=len(free)) @ free
    return np.asarray(direction / np.abs(direction).max(), dtype=np.float64)


def _gradients(hierarchy: Hierarchy, x: Array) -> list[Array]:
    """Return the gradients of all levels and of the norm, (n,) each."""
    levels = [
        level.A.T @ (level.weight * signed_distance(level.A @ x, level.lower, level.upper))
        for level in hierarchy.levels
    ]
    return [*levels, hierarchy.norm_matrix() @ x]


def _nearer(x: Array, lower: Array, upper: Array, y: Array) -> Mask:
    """Return where multipliers have the sign of the nearer bound, (n,)."""
    return np.where(np.abs(upper - x) <= np.abs(x - lower), y > 0.0, y < 0.0)
