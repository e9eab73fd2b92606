"""Task priority: levels of equalities resolved one after the other, by compiled kernels."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.damping import NONE, ConstantDamping, Damping, NoDamping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, equality_levels, inverse_root
from taskopt.hierarchy.review import LevelAccount
from taskopt.resolver.descent_kernels import advance, descend_kernel, level_svd, unscaled

LevelEqualities: TypeAlias = tuple[Array, Array, Array]
"""Equality rows of one level: A (m, n), b (m,), and a weight > 0 for each row (m,)."""


class TaskPriority(NamedTuple):
    """The result of `descend`.

    Attributes:
        x: (n,) the answer.
        levels: Rank and damping of each level.
    """

    x: Array
    levels: tuple[LevelAccount, ...]


def descend(
    levels: Iterable[LevelEqualities],
    W: Array,
    damping: Damping = NONE,
    rule: RankRule = RULE,
    previous_ranks: Sequence[int] = (),
) -> TaskPriority:
    """Resolve levels of equalities one after the other, by the recursion of task priority.

        x_k = x_{k−1} + N_{k−1} (J_k N_{k−1})† (v_k − J_k x_{k−1})

    N_k is an orthonormal basis of the true null space of all levels up to k. Damping changes only the
    inverse, which becomes (3.59), and never N. Weights act within a level. Of all x that are optimal for the
    levels, that with the least xᵀ W x is returned. The levels may have any rank.

    Args:
        levels: (J, v, weight) of each level, the highest priority first.
        W: (n, n) symmetric positive definite, or its diagonal (n,).
        damping: Policy that gives k² for each singular value.
        rule: Rule that decides which singular values count.
        previous_ranks: Ranks of the last tick, so that ranks change with hysteresis; empty for none.

    Returns:
        x (n,) with rank and damping of each level.

    Source:
        Siciliano and Slotine (1991), ICAR; two levels are (3.54).
    """
    scaling, inverse = scaling_of(W), inverse_root(W)
    n = len(W)
    z, basis, free = np.zeros(n), np.eye(n), n
    accounts = []
    for k, (A, b, weight) in enumerate(levels):
        if not len(b):
            accounts.append(LevelAccount(k, 0, free, 0, np.inf, 0.0))
            continue
        rows = np.ascontiguousarray(A), np.ascontiguousarray(b), np.ascontiguousarray(weight)
        U, sigma, Vt, v, missing, scale = level_svd(*rows, scaling, z, basis, free)
        account = rule.account(k, len(b), free, sigma, scale, previous_ranks)
        moved = rule.moved(np.sqrt(weight)[:, None] * A @ inverse, scale)
        factors = damping(sigma[: np.count_nonzero(moved)], v[moved])
        squared = np.ascontiguousarray(factors[: account.rank], dtype=np.float64)
        free = advance(U, sigma, Vt, missing, squared, z, basis, free)
        accounts.append(account._replace(damping=float(squared.max(initial=0.0))))
    return TaskPriority(unscaled(z, scaling), tuple(accounts))


def descend_hierarchy(
    hierarchy: Hierarchy, damping: Damping, rule: RankRule, previous_ranks: Sequence[int], x: Array
) -> tuple[int, ...]:
    """Resolve the equalities of a hierarchy as `descend` does, the hard ones first.

    Without damping, and with a constant one, this is one compiled call, which computes no singular values
    where the rank of a level is certain without them; `accounts_of` has them.

    Args:
        hierarchy: Any hierarchy; its inequalities are ignored.
        damping: As of `descend`.
        rule: As of `descend`.
        previous_ranks: As of `descend`.
        x: (n,) filled with the answer.

    Returns:
        Rank of each level, the hard rows first.
    """
    squared = _constant(damping)
    if squared is None:
        found = descend(equality_levels(hierarchy), hierarchy.norm, damping, rule, previous_ranks)
        x[:] = found.x
        return tuple([level.rank for level in found.levels])
    ranks = np.empty(hierarchy.layout.level_count + 1, dtype=np.int64)
    descend_kernel(
        hierarchy.buffer,
        scaling_of(hierarchy.norm),
        hierarchy.layout.offsets,
        (rule.lost, rule.regained, squared),
        np.array(previous_ranks, dtype=np.int64),
        x,
        ranks,
    )
    return tuple(ranks.tolist())


def accounts_of(
    hierarchy: Hierarchy, damping: Damping, rule: RankRule, previous_ranks: Sequence[int]
) -> tuple[LevelAccount, ...]:
    """Return rank and damping of each level, as `descend_hierarchy` decides them.

    Args:
        hierarchy: Any hierarchy; its inequalities are ignored.
        damping: As of `descend`.
        rule: As of `descend`.
        previous_ranks: As of `descend`.

    Returns:
        The accounts, the hard rows first.
    """
    return descend(equality_levels(hierarchy), hierarchy.norm, damping, rule, previous_ranks).levels


def scaling_of(W: Array) -> Array:
    """Return what the kernels scale unknowns by: the diagonal of W (n,), or L⁻¹ row by row (n · n,).

    Args:
        W: The diagonal (n,) or the matrix (n, n), W = Lᵀ L.

    Returns:
        An array that may be written to.
    """
    if W.ndim == 1 or len(W) == 1:  # of one unknown W is its own diagonal
        return W.ravel().copy()
    return inverse_root(W).ravel()


def _constant(damping: Damping) -> float | None:
    """Return k² of a policy that gives the same k² for all singular values and right-hand sides, or None."""
    if type(damping) is NoDamping:
        return 0.0
    return damping.k**2 if type(damping) is ConstantDamping else None  # a subclass may vary it
