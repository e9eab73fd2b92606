"""Task priority in plain NumPy by singular values, as an oracle for the compiled kernels."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.damping import NONE, Damping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, equality_levels, inverse_root, row_scale


def numpy_descent(
    hierarchy: Hierarchy,
    damping: Damping = NONE,
    rule: RankRule = RULE,
    before: Sequence[int] = (),
) -> tuple[Array, list[int], float]:
    """x (n,) of the equalities, the rank of each level, and the least singular value that counts.

    The last is relative to the size of the rows of its level; it tells how exact x can be.
    """
    inverse = inverse_root(hierarchy.norm)
    z, N = np.zeros(len(inverse)), np.eye(len(inverse))
    ranks, least = [], 1.0
    for k, (A, b, weight) in enumerate(equality_levels(hierarchy)):
        root = np.sqrt(weight)
        J, v = (root[:, None] * A) @ inverse, root * b
        U, sigma, Vt = np.linalg.svd(J @ N) if len(b) else (np.eye(0), np.zeros(0), np.eye(N.shape[1]))
        account = rule.account(k, len(b), N.shape[1], sigma, row_scale(J, root) if len(b) else 1.0, before)
        r = account.rank
        least = min(least, account.kept)
        s = sigma[:r]
        moved = np.any(J != 0.0, axis=1)  # rows that no unknown moves are no singularity
        squared = damping(sigma[: moved.sum()], v[moved])[:r]
        z = z + N @ (Vt[:r].T @ (s / (s**2 + squared) * (U[:, :r].T @ (v - J @ z))))
        N = N @ Vt[r:].T
        ranks.append(r)
    return inverse @ z, ranks, least
