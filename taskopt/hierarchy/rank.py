"""Decisions on rank: singular values that count, equality rows of each level, and roots of W."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, Mask
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.tolerances import LOST, REGAINED, ZERO_ROW


@dataclass(frozen=True)
class RankRule:
    """A threshold with hysteresis for singular values.

    A direction is lost if σ ≤ lost · scale. Once lost, it is regained if σ > regained · scale. `scale` is the
    size of the rows that σ comes from, before they are projected. Between the two thresholds the rank stays
    as in the last tick, so that it does not alternate. A larger `lost` gives up a direction sooner: the
    velocity is at most 1/(lost · scale) times the velocity of the task, and the task is missed along a lost
    direction.

    Attributes:
        lost: Relative singular value at or below which a direction is lost.
        regained: Relative singular value above which a lost direction is regained.

    Raises:
        InvalidValue: 0 < lost ≤ regained < 1 does not hold.

    Source:
        Golub and Van Loan (2013), "Matrix Computations", Sect. 5.4; for a single matrix they put the
        threshold at max(m, n) times the machine precision.
    """

    lost: float = LOST
    regained: float = REGAINED

    def __post_init__(self) -> None:
        both = self.lost, self.regained
        if not all(isinstance(share, float | int) for share in both) or not 0.0 < both[0] <= both[1] < 1.0:
            raise InvalidValue(f"0 < lost ≤ regained < 1 is needed, got {self.lost} and {self.regained}")

    def rank(self, sigma: Array, scale: float, before: int | None = None) -> int:
        """Return the number of singular values that count.

        Args:
            sigma: Singular values, falling, (r,).
            scale: Size of the rows before projection.
            before: The rank of the last tick; None if there was none.

        Returns:
            The rank.
        """
        kept = int(np.count_nonzero(sigma > self.lost * scale))
        if before is None:
            return kept
        sure = int(np.count_nonzero(sigma > self.regained * scale))
        return min(max(before, sure), kept)

    def moved(self, J: Array, scale: float) -> Mask:
        """Find the rows that some unknown moves.

        A row of zeros, such as the height of a planar arm's tip, has nothing to do with how near the others
        are to a singularity. What is left out is far below the threshold of a lost direction, so that the
        other rows have at least the rank of all.

        Args:
            J: Rows before projection, multiplied by √w, (m, n).
            scale: Their size, see `row_scale`.

        Returns:
            True for each row that is not zero up to rounding, (m,).
        """
        return np.linalg.norm(J, axis=1) > ZERO_ROW * (self.lost / LOST) * scale

    def account(
        self, level: int, rows: int, free: int, sigma: Array, scale: float, before: Sequence[int]
    ) -> LevelAccount:
        """Return the rank of a level, together with the singular values next to the threshold.

        Args:
            level: 0 for the hard rows, 1 for the first priority, and so on.
            rows: Number of equality rows of the level.
            free: Number of directions that the levels before left free.
            sigma: Singular values of the rows in those directions, falling.
            scale: Size of the rows before projection.
            before: Ranks of all levels in the last tick; empty if there was none.

        Returns:
            The account.
        """
        r = self.rank(sigma, scale, before[level] if level < len(before) else None)
        kept = float(sigma[r - 1]) / scale if r else np.inf
        dropped = float(sigma[r]) / scale if r < len(sigma) else 0.0
        return LevelAccount(level, rows, free, r, kept, dropped)


RULE = RankRule()


def row_scale(J: Array, root: Array) -> float:
    """Return the size of weighted rows before projection, which is the largest of all √w and row norms.

    Args:
        J: Rows multiplied by √w, (m, n).
        root: √w, (m,).

    Returns:
        The size.
    """
    return float(max(root.max(initial=0.0), np.sqrt((J**2).sum(axis=1)).max(initial=0.0)))


def equality_levels(hierarchy: Hierarchy) -> Iterator[tuple[Array, Array, Array]]:
    """Yield A, b and weight of the equality rows: the hard ones first, then level by level.

    Args:
        hierarchy: The problem. An unknown whose two bounds are equal counts as a hard row.

    Yields:
        A (m, n), b (m,) and weight (m,) of each level.
    """
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
    """Return the upper triangular L with W = Lᵀ L, (n, n).

    Args:
        W: The diagonal (n,) or the matrix (n, n).

    Returns:
        L, so that z = L x has the norm ½ zᵀ z = ½ xᵀ W x.
    """
    return np.asarray(np.diag(np.sqrt(W)) if W.ndim == 1 else np.linalg.cholesky(W).T, dtype=np.float64)


def inverse_root(W: Array) -> Array:
    """Return L⁻¹ with W = Lᵀ L, (n, n).

    Args:
        W: The diagonal (n,) or the matrix (n, n).

    Returns:
        L⁻¹, so that x = L⁻¹ z.
    """
    inverse = np.diag(1.0 / np.sqrt(W)) if W.ndim == 1 else np.linalg.inv(root_of(W))
    return np.asarray(inverse, dtype=np.float64)
