"""The one place where rank is decided: which singular values count, and which directions are lost."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.review import LevelAccount

LOST = 1e-10


@dataclass(frozen=True)
class RankRule:
    """A direction is lost where σ ≤ lost · scale; once lost, it is back where σ > regained · scale.

    `scale` is the size of the rows that σ comes from, before projection. Between the two thresholds
    the rank stays what it was a tick ago, so that it does not chatter. A larger `lost` gives a
    direction up sooner: velocities stay below 1/(lost · scale) times the task's, and the task is
    missed along that direction. Golub and Van Loan (2013), Sect. 5.4, put the threshold of a single
    matrix at max(m, n) · ε.
    """

    lost: float = LOST
    regained: float = 10.0 * LOST

    def __post_init__(self) -> None:
        if not 0.0 < self.lost <= self.regained < 1.0:
            raise InvalidValue(f"0 < lost ≤ regained < 1 is needed, got {self.lost} and {self.regained}")

    def rank(self, sigma: Array, scale: float, before: int | None = None) -> int:
        """How many of the singular values (falling) count; `before` is last tick's rank, if there was one."""
        kept = int(np.count_nonzero(sigma > self.lost * scale))
        if before is None:
            return kept
        sure = int(np.count_nonzero(sigma > self.regained * scale))
        return min(max(before, sure), kept)

    def account(
        self, level: int, rows: int, free: int, sigma: Array, scale: float, before: Sequence[int]
    ) -> LevelAccount:
        """The rank of a level with its evidence; `before` are last tick's ranks of all levels, or none."""
        r = self.rank(sigma, scale, before[level] if level < len(before) else None)
        kept = float(sigma[r - 1]) / scale if r else np.inf
        dropped = float(sigma[r]) / scale if r < len(sigma) else 0.0
        return LevelAccount(level, rows, free, r, kept, dropped)


RULE = RankRule()


def row_scale(J: Array, root: Array) -> float:
    """Size of weighted rows before projection, root being √w: max of √w and row norms."""
    return float(max(root.max(initial=0.0), np.sqrt((J**2).sum(axis=1)).max(initial=0.0)))
