"""Jacobians with the singular values that a test needs."""

import numpy as np

from taskopt.arrays import Array


def jacobian(seed: int, smallest: float = 0.1) -> Array:
    """(6, 7) with singular values from 1 down to `smallest`, evenly spread on a logarithmic scale."""
    return with_singular_values(seed, np.geomspace(1.0, smallest, 6))


def with_singular_values(seed: int, sigma: Array) -> Array:
    """(r, 7) with the r singular values given, along generic directions."""
    rng, r = np.random.default_rng(seed), len(sigma)
    U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (r, 7))
    return U @ np.diag(sigma) @ V[:r]
