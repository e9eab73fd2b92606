"""The formulas of Sect. 3.5 on arrays, each with the number of its equation.

The chapter is Siciliano, Sciavicco, Villani and Oriolo (2009), "Robotics: Modelling, Planning and Control",
Ch. 3. Here J is a task Jacobian (m, n), v a task velocity (m,) [m/s, rad/s], q̇ joint velocities (n,) [rad/s,
m/s], and W a symmetric positive definite (n, n) or its diagonal (n,). None of the formulas considers
inequalities or limits.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import NONE, Damping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, equality_levels, inverse_root, root_of
from taskopt.hierarchy.tolerances import IN_RANGE, WEIGHT_SPREAD
from taskopt.resolver.descent import descend, descend_hierarchy


def square_inverse(J: Array, v: Array) -> Array:
    """Return q̇ = J⁻¹ v, for a square J of full rank.

    Args:
        J: (n, n) Jacobian.
        v: (n,) task velocity [m/s, rad/s].

    Returns:
        q̇ (n,) [rad/s].

    Raises:
        InvalidValue: J is not square or has lost rank. The pseudo-inverse (3.52) or the damped inverse (3.59)
            can be used then.

    Source:
        (3.47).
    """
    if J.shape[0] != J.shape[1]:
        raise InvalidValue(f"J must be square, got {J.shape[0]}×{J.shape[1]}; take pseudo_inverse")
    rank = _rank(np.linalg.svd(J)[1])
    if rank < len(J):
        raise InvalidValue(f"J has rank {rank} of {len(J)}; take pseudo_inverse or damped_inverse")
    return np.asarray(np.linalg.solve(J, v), dtype=np.float64)


def pseudo_inverse(J: Array) -> Array:
    """Return J† = Jᵀ (J Jᵀ)⁻¹, computed from singular values, so that it is also right if rank is lost.

    q̇ = J† v (3.51) has the least norm of all q̇ with J q̇ = v. If v is not in the range of J, it has the
    least norm of all q̇ that bring J q̇ as near to v as possible.

    Args:
        J: (m, n) Jacobian of any rank.

    Returns:
        J† (n, m).

    Source:
        (3.52).
    """
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    r = _rank(sigma)
    return (Vt[:r].T / sigma[:r]) @ U[:, :r].T


def in_range(J: Array, v: Array, tolerance: float = IN_RANGE) -> bool:
    """Return True if v ∈ R(J), so that the arm can follow v even at a singularity.

    The test is ‖v − J J† v‖ ≤ tolerance · ‖v‖, with the basis of the range R(J) for the rank that the rank
    rule decides.

    Args:
        J: (m, n) Jacobian of any rank.
        v: (m,) task velocity [m/s, rad/s].
        tolerance: Largest distance to the range, relative to ‖v‖.

    Returns:
        True for v = 0 and for every v that is a combination of the columns of J up to the tolerance.

    Source:
        Sect. 3.5.2.
    """
    U, sigma, _ = np.linalg.svd(J, full_matrices=False)
    basis = U[:, : _rank(sigma)]
    return bool(np.linalg.norm(v - basis @ (basis.T @ v)) <= tolerance * np.linalg.norm(v))


def weighted_pseudo_inverse(J: Array, W: Array) -> Array:
    """Return W⁻¹ Jᵀ (J W⁻¹ Jᵀ)⁻¹, computed as L⁻¹ (J L⁻¹)† with W = Lᵀ L.

    Multiplied by v it gives the q̇ with J q̇ = v and the least q̇ᵀ W q̇.

    Args:
        J: (m, n) Jacobian of any rank.
        W: (n, n) symmetric positive definite, or its diagonal (n,).

    Returns:
        The weighted pseudo-inverse (n, m).

    Source:
        (3.50).
    """
    inverse = inverse_root(W)
    return inverse @ pseudo_inverse(J @ inverse)


def null_space_projector(J: Array) -> Array:
    """Return P = I − J† J, computed from a basis of the null space, so that J P = 0 to rounding.

    Args:
        J: (m, n) Jacobian of any rank.

    Returns:
        P (n, n), with P = Pᵀ = P².

    Source:
        The projector in (3.54).
    """
    _, sigma, Vt = np.linalg.svd(J)
    basis = Vt[_rank(sigma) :]
    return basis.T @ basis


def internal_motion(J: Array, v0: Array) -> Array:
    """Return q̇ = P q̇₀, which reconfigures the arm and leaves the hand where it is.

    Args:
        J: (m, n) Jacobian of any rank.
        v0: (n,) any joint velocities q̇₀ [rad/s].

    Returns:
        q̇ (n,) [rad/s], with J q̇ = 0.

    Source:
        (3.54) with v = 0.
    """
    return null_space_projector(J) @ v0


def null_space_motion(J: Array, v: Array, v0: Array) -> Array:
    """Return q̇ = J† v + (I − J† J) q̇₀, which is the q̇ nearest to q̇₀ with J q̇ = v.

    Args:
        J: (m, n) Jacobian of any rank.
        v: (m,) task velocity [m/s, rad/s].
        v0: (n,) joint velocities q̇₀ to come near to [rad/s].

    Returns:
        q̇ (n,) [rad/s].

    Source:
        (3.54), which is (3.46) with q̇* = J† v.
    """
    return pseudo_inverse(J) @ v + internal_motion(J, v0)


def gradient_motion(J: Array, v: Array, gradient: Array, k0: float) -> Array:
    """Return (3.54) with q̇₀ = k₀ (∂w/∂q)ᵀ, which follows v and climbs w with the remaining freedom.

    Args:
        J: (m, n) Jacobian of any rank.
        v: (m,) task velocity [m/s, rad/s].
        gradient: (n,) gradient ∂w/∂q of an objective.
        k0: Step size k₀ > 0. More climbs faster and overshoots in one Euler step sooner.

    Returns:
        q̇ (n,) [rad/s].

    Source:
        (3.54) and (3.55).
    """
    return null_space_motion(J, v, k0 * gradient)


def damped_inverse(J: Array, damping: float) -> Array:
    """Return J* = Jᵀ (J Jᵀ + k² I)⁻¹, computed from singular values.

    J* v minimises ‖v − J q̇‖² + k² ‖q̇‖².

    Args:
        J: (m, n) Jacobian of any rank.
        damping: The factor k > 0. A larger k gives a slower and smoother motion with a larger error.

    Returns:
        J* (n, m).

    Source:
        (3.59).
    """
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    return (Vt.T * (sigma / (sigma**2 + damping**2))) @ U.T


def task_priority(hierarchy: Hierarchy, damping: Damping = NONE) -> Array:
    """Return the closed-form answer to the equalities of a hierarchy, the hard equalities first.

    Args:
        hierarchy: Any hierarchy; its inequalities are ignored.
        damping: Damping policy of the inverse at each level.

    Returns:
        x (n,), the closed-form answer of every resolver with strict priorities.
    """
    x = np.empty(hierarchy.n)
    descend_hierarchy(hierarchy, damping, RULE, (), x)
    return x


def level_ratio(levels: int) -> float:
    """Return the weight of a level over the weight of the level before it, in a weighted problem.

    The weights are evenly spaced within `WEIGHT_SPREAD`: 1e-3 for two levels, 1e-2 for three. Beyond that
    spread rounding errors of the first level hide the last one, and no answer in double precision can be
    proven.

    Args:
        levels: Number of levels; one level counts as two, since the norm comes below it.

    Returns:
        A ratio in (0, 1).
    """
    return WEIGHT_SPREAD ** (-1.0 / max(levels, 2))


def weighted_least_squares(hierarchy: Hierarchy, ratio: float) -> Array:
    """Minimise Σ_k ratio^(k−L) ½ Σ w (A_k x − b_k)² + ½ xᵀ W x over the L levels, counted from k = 0.

    All rows are solved by one orthogonal factorisation; hard equalities hold exactly.

    Args:
        hierarchy: Any hierarchy; its inequalities are ignored.
        ratio: Weight of a level over the weight of the level before it, see `level_ratio`.

    Returns:
        x (n,), the closed-form answer of the weighted problem.
    """
    n, levels = hierarchy.n, hierarchy.layout.level_count
    hard, *soft = equality_levels(hierarchy)
    roots = [np.sqrt(ratio ** (k - levels) * weight) for k, (_, _, weight) in enumerate(soft)]
    rows = [root[:, None] * A for root, (A, _, _) in zip(roots, soft, strict=True)]
    sides = [root * b for root, (_, b, _) in zip(roots, soft, strict=True)]
    S = np.vstack([*rows, root_of(hierarchy.norm)])
    c = np.concatenate([*sides, np.zeros(n)])
    return descend([hard, (S, c, np.ones(len(c)))], np.ones(n)).x


def _rank(sigma: Array) -> int:
    """Return the number of singular values (falling) that count, relative to the largest."""
    return RULE.rank(sigma, float(sigma.max(initial=0.0)))
