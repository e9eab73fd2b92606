"""The formulas of Sect. 3.5 on arrays, each written as the equation it cites.

Siciliano, Sciavicco, Villani and Oriolo (2009), "Robotics: Modelling, Planning and Control",
Ch. 3; task priority after Siciliano and Slotine (1991), ICAR. J is (m, n), v (m,) [m/s, rad/s],
W (n, n) or its diagonal (n,). None of them knows an inequality or a limit.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.problem.hierarchy import Hierarchy

RANK = 1e-10  # a direction is lost if its singular value is below this times the largest row norm
SPREAD = 1e6  # weight of the first level over that of the norm, where one cost stands for all levels


def pseudo_inverse(J: Array) -> Array:
    """J† = Jᵀ (J Jᵀ)⁻¹ (3.52), by singular values, so that it is also right where rank is lost; (n, m)."""
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    kept = independent(sigma, float(sigma.max(initial=0.0)))
    return (Vt[kept].T / sigma[kept]) @ U[:, kept].T


def weighted_pseudo_inverse(J: Array, W: Array) -> Array:
    """W⁻¹ Jᵀ (J W⁻¹ Jᵀ)⁻¹ (3.50), as L⁻¹ (J L⁻¹)† with W = Lᵀ L; (n, m)."""
    inverse = inverse_root(W)
    return inverse @ pseudo_inverse(J @ inverse)


def null_space_projector(J: Array) -> Array:
    """P = I − J† J (3.54), from a basis of the null space, so that J P = 0 to rounding; (n, n)."""
    _, sigma, Vt = np.linalg.svd(J)
    basis = Vt[np.count_nonzero(independent(sigma, float(sigma.max(initial=0.0)))) :]
    return basis.T @ basis


def null_space_motion(J: Array, v: Array, v0: Array) -> Array:
    """q̇ = J† v + (I − J† J) q̇₀ (3.54); (n,)."""
    return pseudo_inverse(J) @ v + null_space_projector(J) @ v0


def damped_inverse(J: Array, damping: float) -> Array:
    """J* = Jᵀ (J Jᵀ + k² I)⁻¹ (3.59); more of k = `damping` > 0 is slower and smoother; (n, m)."""
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    return (Vt.T * (sigma / (sigma**2 + damping**2))) @ U.T


def task_priority(hierarchy: Hierarchy, damping: float = 0.0) -> Array:
    """`prioritised` on the equalities of a hierarchy, hard ones first; inequalities are passed over."""
    return prioritised(equality_levels(hierarchy), hierarchy.norm, damping)


def prioritised(levels: Iterable[tuple[Array, Array, Array]], W: Array, damping: float = 0.0) -> Array:
    """x_k = x_{k−1} + (J_k N_{k−1})† (v_k − J_k x_{k−1}), level by level (J, v, weight), any rank; (n,).

    Siciliano and Slotine (1991). N stands for an orthonormal basis of the true null space of all
    levels before; with `damping` only the inverse becomes (3.59), never N. Weights act within a
    level, W over the whole: what stays free has the least xᵀ W x.
    """
    inverse = inverse_root(W)
    z, Z = np.zeros(len(inverse)), np.eye(len(inverse))
    for A, b, weight in levels:
        if not len(b):
            continue
        root = np.sqrt(weight)
        J, v = (root[:, None] * A) @ inverse, root * b
        U, sigma, Vt = np.linalg.svd(J @ Z)
        kept = int(np.count_nonzero(independent(sigma, row_scale(J, root))))
        s = sigma[:kept]
        z = z + Z @ (Vt[:kept].T @ (s / (s**2 + damping**2) * (U[:, :kept].T @ (v - J @ z))))
        Z = Z @ Vt[kept:].T
    return inverse @ z


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
    return prioritised([fixed, (S, c, np.ones(len(c)))], np.ones(n))


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


def refuse_inequalities(hierarchy: Hierarchy, name: str) -> None:
    """Raise `InvalidValue` where a level asks for a true inequality."""
    first = int(hierarchy.layout.offsets[1])
    unequal = np.flatnonzero(hierarchy.lower[first:] != hierarchy.upper[first:])
    if unequal.size:
        row = hierarchy.layout.row_names[first + int(unequal[0])]
        raise InvalidValue(
            f"{name} is a closed form and knows no inequality, got {row}; use hqp/… or active-set"
        )


def independent(sigma: Array, scale: float) -> np.ndarray:
    """The one rank rule: which singular values count, `scale` being the size of the rows they come from."""
    return sigma > RANK * scale


def row_scale(J: Array, root: Array) -> float:
    """Size of weighted rows before projection, root being √w: max of √w and row norms."""
    return float(max(root.max(initial=0.0), np.sqrt((J**2).sum(axis=1)).max(initial=0.0)))


def root_of(W: Array) -> Array:
    """L with W = Lᵀ L, (n, n) upper triangular."""
    return np.asarray(np.diag(np.sqrt(W)) if W.ndim == 1 else np.linalg.cholesky(W).T, dtype=np.float64)


def inverse_root(W: Array) -> Array:
    """L⁻¹ with W = Lᵀ L, (n, n)."""
    inverse = np.diag(1.0 / np.sqrt(W)) if W.ndim == 1 else np.linalg.inv(root_of(W))
    return np.asarray(inverse, dtype=np.float64)
