"""Enumerations of the active set, and the records of arrays that its kernels share.

Every record is a `NamedTuple` that is built inside compiled code, where it costs nothing. Sizes are n
unknowns, M rows, f free unknowns (those that no bound holds), m rows of the fast path and u columns without a
diagonal.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask

Count = (
    int | np.int64
)  # counts are np.int64 in compiled code: a literal 0 would compile its callees once more


class Held(IntEnum):
    """State of an unknown or a row relative to the working set W."""

    LOWER = -1
    """It is held at its lower bound."""
    FREE = 0
    """It is not in W."""
    UPPER = 1
    """It is held at its upper bound; equalities are held here, too."""


class Verdict(IntEnum):
    """Result of one attempt of the fast path."""

    ACCEPTED = 0
    """The closed form is the optimum."""
    AGAIN = 1
    """One bound of the box joined or left W, so that another attempt may succeed."""
    REFUSED = 2
    """The closed form does not apply here; the search has to run."""


class Outcome(IntEnum):
    """Result of one tick, and of one search."""

    SOLVED = 0
    """The optimum was found; for a tick, it also meets its KKT conditions to `KKT_MET`."""
    ITERATION_LIMIT = 1
    """The search used up its factorisations."""
    CONTRADICTION = 2
    """The search ended at a point where a hard row keeps a residual."""
    NOT_FINITE = 3
    """A row of the problem, or the answer, is not a number."""
    KKT_MISSED = 4
    """The search ended, but a KKT residual of its answer is larger than `KKT_MET`."""
    FAST_PATH_REFUSED = 5
    """Of a tick without the search: the fast path did not accept; nothing was answered or remembered."""
    NEARLY_DEPENDENT = 6
    """As SOLVED, but rows of the working set depend on each other so nearly that digits of x are lost."""
    CYCLED = 7
    """The search came back to where it had been: rounding decides what it adds and drops."""
    STILL_PERTURBED = 8
    """As SOLVED, but x keeps the moved bounds of the second search, and violates true ones by as much."""


class ScaledRows(NamedTuple):
    """The problem of the search: rows times √w, unknowns √W x, so that weights and norm are the identity.

    Attributes:
        A: (M, n) scaled rows, hard rows first, then level by level.
        scale: (M,) √w · max(1, ‖a‖), the size of a row to which its remainder is compared in decisions of
            rank.
        size: (M,) ‖A_i‖, the size of a row to which its violation is compared; at least LOST · scale.
        lower: (M,) scaled lower bounds.
        upper: (M,) scaled upper bounds.
        box_lower: (n,) scaled lower bounds of the unknowns.
        box_upper: (n,) scaled upper bounds of the unknowns.
        offsets: (levels + 2,) first row of level 0 (hard), 1, …, and M.
        rounding: Share of its level's scale up to which a multiplier counts as zero, whatever its own
            rounding error is; 0 for the search that is exact.
    """

    A: Array
    scale: Array
    size: Array
    lower: Array
    upper: Array
    box_lower: Array
    box_upper: Array
    offsets: IntArray
    rounding: float


class Point(NamedTuple):
    """A point of the search with the values of all rows there.

    Attributes:
        x: (n,) the scaled unknowns.
        value: (M,) A x.
    """

    x: Array
    value: Array


class Factor(NamedTuple):
    """The l-QR factorisation of the rows in W: A[order][:, free] = L Qᵀ, level by level.

    Attributes:
        free: (f,) unknowns that no bound holds.
        order: (M,) rows in W, level by level, the pivots of each level first; filled up to starts[-1].
        starts: (levels + 2,) position in `order` where each level begins, and the count of rows in W.
        ranks: (levels + 2,) rank of all levels before each level, and the rank of W.
        L: (M, f) lower trapezoidal factor, row by row as in `order`.
        reflectors: (f, f) Householder vectors of Q, one in each row.
        beta: (f,) their factors: reflection p is I − beta_p v_p v_pᵀ.
        inverse: (f, f) transpose of the inverse of the rows of L that are pivots, upper triangular.
    """

    free: IntArray
    order: IntArray
    starts: IntArray
    ranks: IntArray
    L: Array
    reflectors: Array
    beta: Array
    inverse: Array


class LevelSolution(NamedTuple):
    """The solution of a factorised hierarchy.

    Attributes:
        z: (f,) coordinates Qᵀ x of the free unknowns; each level decides its own part.
        residual: (M,) L z − target of each row in W that is no pivot, as in `Factor.order`.
        terms: (M,) sum of the magnitudes of the summands of each residual; it bounds their rounding error.
    """

    z: Array
    residual: Array
    terms: Array


class LevelMultipliers(NamedTuple):
    """The multipliers of one level, box first, then rows.

    Attributes:
        value: (n + M,) multipliers λ, 0 where there is none.
        terms: (n + M,) to which the rounding error of each λ is proportional: the magnitudes of the summands
            of all equations that lead to it, times the entries of |L⁻ᵀ| by which they do.
    """

    value: Array
    terms: Array


class Locks(NamedTuple):
    """Marks that prevent the search from cycling, for the unknowns first, then for the rows.

    Attributes:
        locked: (n + M,) True for members of W that may not be dropped at present.
        dropped: (n + M,) True for members that were dropped since x last moved.
    """

    locked: Mask
    dropped: Mask


class LastLevel(NamedTuple):
    """The diagonal cost ½ Σ D_j (x_j − x0_j)² of the last level, or of the norm, in the fast path.

    Attributes:
        D: (n,) weights; 0 where an unknown has none.
        x0: (n,) targets.
        row: (≥ n,) the joint row that gives an unknown's weight; −1 if there is none, or if D is the norm.
    """

    D: Array
    x0: Array
    row: IntArray


class SaddlePoint(NamedTuple):
    """The factorised system of the fast path, whose symbols `fast_path` explains.

    Attributes:
        rows: (m,) indices of the rows in M.
        uncovered: (u,) indices of the columns in U.
        first_soft: First row that may keep a residual; rows before it are met exactly.
        S: (m, ≥ n) product M D^-½ in the columns that D covers, 0 in the others.
        K: (m + u, ≥ m) Cholesky factor L of S Sᵀ plus the diagonal 1/w of soft rows; below it (L⁻¹ M_U)ᵀ.
        MU: (u, ≥ m) transpose of the uncovered columns of M, M_Uᵀ.
        G: (u, ≥ u) Cholesky factor of the Schur complement M_Uᵀ K⁻¹ M_U + D_U.
    """

    rows: IntArray
    uncovered: IntArray
    first_soft: int
    S: Array
    K: Array
    MU: Array
    G: Array


class Scratch(NamedTuple):
    """Memory for right-hand sides of the saddle-point system, which its solution overwrites.

    Attributes:
        step: (≥ m,) right-hand side of the rows; then the correction of λ.
        move: (≥ u,) right-hand side of the uncovered columns; then the correction of x_U.
        pull: (n,) Sᵀ times the correction of λ, which gives the correction of the covered columns.
    """

    step: Array
    move: Array
    pull: Array
