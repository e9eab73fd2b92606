"""Room in the scene: where each resolver's robot stands, and where the camera is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array


@dataclass(frozen=True, eq=False)
class Place:
    """Size of the scene: robots stand side by side so that none hides another."""

    lower: Array  # (3,) of one robot with its task [m]
    upper: Array
    flat: bool  # a robot in the x-y plane, seen from above
    columns: int
    crowded: bool = False  # with obstacles: seen from higher up, so that they hide less

    @property
    def size(self) -> float:
        """Largest extent of one robot [m]."""
        return float((self.upper - self.lower).max())

    def offset(self, index: int) -> Array:
        """Where the base of a resolver's robot stands, (3,) [m]."""
        row, column = divmod(index, self.columns)
        span = self.upper - self.lower
        if self.flat:
            return np.array([column * 1.15 * span[0], -row * 1.15 * span[1], 0.0])
        aside = column + 0.5 * row  # the second row stands in the gaps of the first
        return np.array([-row * (1.2 * span[0] + 0.3), aside * (1.1 * span[1] + 0.35), 0.0])

    def eye(self, count: int) -> tuple[Array, Array, Array]:
        """Position, look-at point and up direction of a camera that sees `count` robots."""
        offsets = np.array([self.offset(i) for i in range(count)])
        lower, upper = (self.lower + offsets).min(axis=0), (self.upper + offsets).max(axis=0)
        centre, span = 0.5 * (lower + upper), float(np.linalg.norm(upper - lower))
        if self.flat:
            return centre + np.array([0.0, 0.0, span]), centre, np.array([0.0, 1.0, 0.0])
        sideways = -0.55 if count == 1 else -0.25 if count == self.columns else 0.0
        toward = np.array([1.0, sideways, 0.9 if self.crowded else 0.4])
        near = 0.85 if self.crowded else 1.35 if count == 1 else 0.95
        return centre + near * span * toward / np.linalg.norm(toward), centre, np.array([0.0, 0.0, 1.0])


def place_for(parts: list[Array], count: int, around: Sequence[Array] = ()) -> Place:
    """Room for a robot at the start, the paths that its references take, and the obstacles around.

    A flat robot stays flat among solid obstacles: they are seen from above too.
    """
    points = np.concatenate(parts)
    span = points.max(axis=0) - points.min(axis=0)
    flat = bool(span[2] < 0.05 * span.max())
    everything = np.concatenate([points, *around])
    lower, upper = everything.min(axis=0), everything.max(axis=0)
    if flat:
        lower[2], upper[2] = points[:, 2].min(), points[:, 2].max()
    columns = count if count <= 3 else -(-count // 2)
    return Place(lower, upper, flat, columns, bool(around))
