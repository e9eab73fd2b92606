"""What of a hierarchy is an equality, level by level, and the norm as a change of unknowns."""

from collections.abc import Iterator

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy


def equality_levels(hierarchy: Hierarchy) -> Iterator[tuple[Array, Array, Array]]:
    """(A, b, weight) of the equality rows: hard ones (fixed unknowns among them), then level by level."""
    fixed = hierarchy.box_lower == hierarchy.box_upper
    for k in range(hierarchy.layout.level_count + 1):
        level = hierarchy.level(k)
        equal = level.lower == level.upper
        A, b, weight = level.A[equal], level.upper[equal], level.weight[equal]
        if k == 0:
            A = np.vstack([np.eye(hierarchy.n)[fixed], A])
            b = np.concatenate([hierarchy.box_upper[fixed], b])
            weight = np.ones(len(b))
        yield A, b, weight


def root_of(W: Array) -> Array:
    """L with W = Lᵀ L, (n, n) upper triangular."""
    return np.asarray(np.diag(np.sqrt(W)) if W.ndim == 1 else np.linalg.cholesky(W).T, dtype=np.float64)


def inverse_root(W: Array) -> Array:
    """L⁻¹ with W = Lᵀ L, (n, n)."""
    inverse = np.diag(1.0 / np.sqrt(W)) if W.ndim == 1 else np.linalg.inv(root_of(W))
    return np.asarray(inverse, dtype=np.float64)
