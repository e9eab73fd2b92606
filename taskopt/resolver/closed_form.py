"""The formulas of Sect. 3.5 on arrays, each written as the equation it cites.

Siciliano, Sciavicco, Villani and Oriolo (2009), "Robotics: Modelling, Planning and Control",
Ch. 3; task priority after Siciliano and Slotine (1991), ICAR. J is (m, n), v (m,) [m/s, rad/s],
W (n, n) or its diagonal (n,). None of them knows an inequality or a limit.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import NONE, Damping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, equality_levels, inverse_root, root_of, row_scale
from taskopt.hierarchy.review import LevelAccount

SPREAD = 1e6  # weight of the first level over that of the norm, where one cost stands for all levels


def square_inverse(J: Array, v: Array) -> Array:
    """q̇ = J⁻¹ v (3.47), for a square J of full rank; (n,).

    Raises `InvalidValue` for any other J: the pseudo-inverse (3.52) or the damped one (3.59) take those.
    """
    if J.shape[0] != J.shape[1]:
        raise InvalidValue(f"J must be square, got {J.shape[0]}×{J.shape[1]}; take pseudo_inverse")
    rank = _rank(np.linalg.svd(J)[1])
    if rank < len(J):
        raise InvalidValue(f"J has rank {rank} of {len(J)}; take pseudo_inverse or damped_inverse")
    return np.asarray(np.linalg.solve(J, v), dtype=np.float64)


def pseudo_inverse(J: Array) -> Array:
    """J† = Jᵀ (J Jᵀ)⁻¹ (3.52), by singular values, so that it is also right where rank is lost; (n, m).

    J† v (3.51) is the least ‖q̇‖ with J q̇ = v, or with J q̇ nearest to v where v is not in the range.
    """
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    r = _rank(sigma)
    return (Vt[:r].T / sigma[:r]) @ U[:, :r].T


def in_range(J: Array, v: Array, tolerance: float = 1e-9) -> bool:
    """Whether v ∈ R(J), so that the arm can move along it even at a singularity (Sect. 3.5.2).

    ‖v − J J† v‖ ≤ `tolerance` ‖v‖, with the basis of R(J) that the rank rule leaves.
    """
    U, sigma, _ = np.linalg.svd(J, full_matrices=False)
    basis = U[:, : _rank(sigma)]
    return bool(np.linalg.norm(v - basis @ (basis.T @ v)) <= tolerance * np.linalg.norm(v))


def weighted_pseudo_inverse(J: Array, W: Array) -> Array:
    """W⁻¹ Jᵀ (J W⁻¹ Jᵀ)⁻¹ (3.50), as L⁻¹ (J L⁻¹)† with W = Lᵀ L; (n, m)."""
    inverse = inverse_root(W)
    return inverse @ pseudo_inverse(J @ inverse)


def null_space_projector(J: Array) -> Array:
    """P = I − J† J (3.54), from a basis of the null space, so that J P = 0 to rounding; (n, n)."""
    _, sigma, Vt = np.linalg.svd(J)
    basis = Vt[_rank(sigma) :]
    return basis.T @ basis


def internal_motion(J: Array, v0: Array) -> Array:
    """q̇ = P q̇₀, (3.54) with v = 0: it reconfigures the arm and leaves the hand where it is; (n,)."""
    return null_space_projector(J) @ v0


def null_space_motion(J: Array, v: Array, v0: Array) -> Array:
    """q̇ = J† v + (I − J† J) q̇₀ (3.54), which is (3.46) with q̇* = J† v and any q̇₀; (n,)."""
    return pseudo_inverse(J) @ v + internal_motion(J, v0)


def gradient_motion(J: Array, v: Array, gradient: Array, k0: float) -> Array:
    """(3.54) with q̇₀ = k₀ (∂w/∂q)ᵀ (3.55): the task first, and up the slope of w with what is left; (n,).

    More k₀ climbs faster, and overshoots in one Euler step sooner.
    """
    return null_space_motion(J, v, k0 * gradient)


def damped_inverse(J: Array, damping: float) -> Array:
    """J* = Jᵀ (J Jᵀ + k² I)⁻¹ (3.59); more of k = `damping` > 0 is slower and smoother; (n, m)."""
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    return (Vt.T * (sigma / (sigma**2 + damping**2))) @ U.T


def task_priority(hierarchy: Hierarchy, damping: Damping = NONE) -> Array:
    """x of `descend` on the equalities of a hierarchy, hard ones first; inequalities are passed over."""
    return descend(equality_levels(hierarchy), hierarchy.norm, damping).x


class Descent(NamedTuple):
    """x (n,), and the rank and damping of every level that led to it."""

    x: Array
    levels: tuple[LevelAccount, ...]


def descend(
    levels: Iterable[tuple[Array, Array, Array]],
    W: Array,
    damping: Damping = NONE,
    rule: RankRule = RULE,
    before: Sequence[int] = (),
) -> Descent:
    """x_k = x_{k−1} + (J_k N_{k−1})† (v_k − J_k x_{k−1}), level by level (J, v, weight), any rank.

    Siciliano and Slotine (1991). N stands for an orthonormal basis of the true null space of all
    levels before; with `damping` only the inverse becomes (3.59), never N. Weights act within a
    level, W over the whole: what stays free has the least xᵀ W x. `before`: last tick's ranks.
    """
    inverse = inverse_root(W)
    z, Z = np.zeros(len(inverse)), np.eye(len(inverse))
    accounts = []
    for k, (A, b, weight) in enumerate(levels):
        free = Z.shape[1]
        if not len(b):
            accounts.append(LevelAccount(k, 0, free, 0, np.inf, 0.0))
            continue
        root = np.sqrt(weight)
        J, v = (root[:, None] * A) @ inverse, root * b
        U, sigma, Vt = np.linalg.svd(J @ Z)
        account = rule.account(k, len(b), free, sigma, row_scale(J, root), before)
        r = account.rank
        wanted = v - J @ z
        squared = damping(sigma, v)[:r]
        s = sigma[:r]
        z = z + Z @ (Vt[:r].T @ (s / (s**2 + squared) * (U[:, :r].T @ wanted)))
        Z = Z @ Vt[r:].T
        accounts.append(account._replace(damping=float(squared.max(initial=0.0))))
    return Descent(inverse @ z, tuple(accounts))


def level_ratio(levels: int) -> float:
    """Weight of a level over that of the level before: two levels 1e-3, three 1e-2; one counts as two.

    Evenly spaced within `SPREAD`: beyond it, rounding in the first level hides the last one, and no
    answer in double precision can be certified.
    """
    return SPREAD ** (-1.0 / max(levels, 2))


def weighted_least_squares(hierarchy: Hierarchy, ratio: float) -> Array:
    """min Σ_k ratio^(k−L) ½ Σ w (A_k x − b_k)² + ½ xᵀ W x over L levels, k from 0; (n,).

    One orthogonal factorisation of all rows; hard equalities hold exactly; inequalities are passed over.
    """
    n, levels = hierarchy.n, hierarchy.layout.level_count
    fixed, *ranks = equality_levels(hierarchy)
    rows = [np.sqrt(ratio ** (k - levels) * w)[:, None] * A for k, (A, _, w) in enumerate(ranks)]
    sides = [np.sqrt(ratio ** (k - levels) * w) * b for k, (_, b, w) in enumerate(ranks)]
    S = np.vstack([*rows, root_of(hierarchy.norm)])
    c = np.concatenate([*sides, np.zeros(n)])
    return descend([fixed, (S, c, np.ones(len(c)))], np.ones(n)).x


def refuse_inequalities(hierarchy: Hierarchy, name: str) -> None:
    """Raise `InvalidValue` where a level asks for a true inequality."""
    first = int(hierarchy.layout.offsets[1])
    unequal = np.flatnonzero(hierarchy.lower[first:] != hierarchy.upper[first:])
    if unequal.size:
        row = hierarchy.layout.row_names[first + int(unequal[0])]
        raise InvalidValue(
            f"{name} is a closed form and knows no inequality, got {row}; use hqp/… or active-set"
        )


def _rank(sigma: Array) -> int:
    return RULE.rank(sigma, float(sigma.max(initial=0.0)))
