"""Damped least squares (3.59) as rows of a level; a policy gives the factor k² of each singular direction."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import CONSTANT, Damping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, equality_levels, inverse_root, root_of, row_scale
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, Task


@dataclass(frozen=True, eq=False)
class LevelDamping(Task):
    """Damp the level that it stands in: k_i u_iᵀ v = 0 in each direction u_i that the level decides.

    The u_i are the right singular vectors of the equality rows of the other tasks, as they stand in the null
    space of the levels before. The level then costs ½ ‖b − J v‖² + ½ Σ k_i² (u_iᵀ v)² and is answered by
    (3.59). Unlike `DampingTask` it asks for nothing else: what the level leaves free stays free for the
    levels below. If every level has one, the resolver `dls` computes the same answer in closed form. A level
    has at most one `LevelDamping`, beside at least one other task. Inequality rows are not damped. Rows have
    no unit.

    Args:
        damping: Policy that gives k_i² for each singular value, see `taskopt.hierarchy.damping`. Larger k_i²
            keep velocities smaller near singularities, and let the tasks lag farther behind.
        name: Name in logs and plots. Default: the name of the policy and "damping".

    Raises:
        InvalidValue: `damping` is no policy.

    Source:
        Equation (3.59).
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
        """Return the name of the policy and "damping"."""
        return f"{self.damping.name} damping"

    def bind(self, robot: Robot, name: str) -> "BoundLevelDamping":
        """Return the rows for a robot; see `Task.bind`."""
        return BoundLevelDamping(self.damping, name, robot.nv)


class BoundLevelDamping(BoundTask):
    """The rows of a `LevelDamping`; the plan calls `fit` to set their number, and `damp` to write them.

    Args:
        damping: Policy that gives k_i².
        name: Name of the task in its plan.
        most: The largest possible number of rows, nv.
    """

    constant = True
    curved = False

    def __init__(self, damping: Damping, name: str, most: int) -> None:
        self._damping, self._most = damping, most
        self._rank: int | None = None
        self._size(name, most)

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return no gain, since no error dies out here; see `Part.adjustable`."""
        return {}

    def fit(self, rows: int) -> None:
        """Set the number of rows to the largest rank that the level can have.

        Args:
            rows: Number of rows of the other tasks of the level.
        """
        self._size(self.name, min(rows, self._most))

    def _size(self, name: str, count: int) -> None:
        """Set the number of rows to `count`."""
        names = [f"direction {i}" for i in range(1, count + 1)]
        super().__init__(name, names, ("",) * count, gain=0.0)

    def recall(self) -> int | None:
        """Return the rank of the last tick; see `Part.recall`."""
        return self._rank

    def remember(self, kept: object) -> None:
        """Restore the rank of the last tick; see `Part.remember`."""
        assert kept is None or isinstance(kept, int), "it is what `recall` returned"
        self._rank = kept

    def start(self, configuration: Configuration, t: float) -> None:  # noqa: ARG002
        """Forget the rank of the last tick."""
        self._rank = None

    def damp(self, hierarchy: Hierarchy, level: int, own: slice) -> None:
        """Write the rows; all other rows of the hierarchy must have been written before.

        Args:
            hierarchy: The hierarchy of this tick.
            level: Level of this task, counted from 1.
            own: Slice of the rows of this task in the hierarchy.
        """
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
        scale = row_scale(J, root)
        moved = RULE.moved(J, scale)
        self._rank = r = RULE.rank(sigma, scale, self._rank)
        k = np.sqrt(self._damping(sigma[: np.count_nonzero(moved)], (root * b)[moved])[:r])
        hierarchy.A[own][:r] = k[:, None] * (Vt[:r] @ Z.T @ root_of(hierarchy.norm))
        hierarchy.lower[own] = hierarchy.upper[own] = 0.0


def _null_space(J: Array, root: Array, Z: Array) -> Array:
    """Return a basis, in the coordinates of Z, of the directions that the rows leave free."""
    _, sigma, Vt = np.linalg.svd(J @ Z)
    return Vt[RULE.rank(sigma, row_scale(J, root)) :].T
