"""Damped least squares (3.59) as rows of a level, with k² from a policy, in every singular direction."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import CONSTANT, Damping
from taskopt.hierarchy.problem import Hierarchy, LevelRows
from taskopt.hierarchy.rank import RULE, equality_levels, inverse_root, root_of, row_scale
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class LevelDamping:
    """Damp the level that it stands in by a policy: k_i v_iᵀ v = 0 in each direction that the level decides.

    v_i are the right singular vectors of the equality rows of the other tasks, as they stand in the null
    space of the levels before, so that the level costs ½ ‖b − J v‖² + ½ Σ k_i² (v_iᵀ v)² and is answered
    by (3.59). Unlike `DampingTask` it asks for nothing else: what the level leaves free stays free for the
    levels below. `damping`: a policy of `taskopt.hierarchy.damping`. With one in every level the resolver
    `dls` is the closed form. One a level; inequality rows are not damped.
    """

    damping: Damping = CONSTANT
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not callable(self.damping):
            raise InvalidValue(
                f"damping must be a policy such as Chiaverini(0.05, 0.05), got {self.damping!r}; "
                "DampingTask takes a weight"
            )

    def default_name(self) -> str:
        return f"{self.damping.name} damping"

    def bind(self, robot: Robot, name: str) -> "BoundLevelDamping":
        return BoundLevelDamping(self.damping, name, robot.nv)


class BoundLevelDamping:
    """As many rows as its level has directions; the plan says how many, and fills them last."""

    frame = desired = actual = None
    constant = True

    def __init__(self, damping: Damping, name: str, most: int) -> None:
        self.name, self._damping, self._most = name, damping, most
        self.fit(most)

    def fit(self, rows: int) -> None:
        """Know how many rows the other tasks of the level have."""
        count = min(rows, self._most)
        self.row_names: tuple[str, ...] = tuple(f"direction {i}" for i in range(1, count + 1))
        self.row_units: tuple[str, ...] = ("",) * count
        self.column: tuple[int, ...] = (-1,) * count
        self.weight: Array = np.ones(count)
        self.gain: Array = np.zeros(count)
        self.error: Array = np.zeros(count)
        self._rank: int | None = None

    def prepare(self, rows: LevelRows) -> None:
        pass

    def start(self, at: Configuration, t: float) -> None:  # noqa: ARG002 (protocol)
        self._rank = None

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        pass

    def damp(self, hierarchy: Hierarchy, level: int, own: slice) -> None:
        """Write the rows, all others of the hierarchy being there."""
        hierarchy.A[own] = 0.0
        hierarchy.lower[own], hierarchy.upper[own] = -np.inf, np.inf  # no equality of the level meanwhile
        levels = list(equality_levels(hierarchy))
        inverse = inverse_root(hierarchy.norm)
        Z = np.eye(len(inverse))
        for A, _, weight in levels[:level]:
            Z = Z @ _null_space(np.sqrt(weight)[:, None] * A @ inverse, np.sqrt(weight), Z)
        A, b, weight = levels[level]
        root = np.sqrt(weight)
        J = root[:, None] * A @ inverse
        _, sigma, Vt = np.linalg.svd(J @ Z, full_matrices=False)
        self._rank = r = RULE.rank(sigma, row_scale(J, root), self._rank)
        k = np.sqrt(self._damping(sigma, root * b)[:r])
        hierarchy.A[own][:r] = k[:, None] * (Vt[:r] @ Z.T @ root_of(hierarchy.norm))
        hierarchy.lower[own] = hierarchy.upper[own] = 0.0


def _null_space(J: Array, root: Array, Z: Array) -> Array:
    """Basis of the directions of Z that the rows leave free."""
    _, sigma, Vt = np.linalg.svd(J @ Z)
    return Vt[RULE.rank(sigma, row_scale(J, root)) :].T
