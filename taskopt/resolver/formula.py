"""`pinv` and `dls`: the chapter's formulas as resolvers. They know no limit, and claim nothing."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.problem.hierarchy import Hierarchy
from taskopt.problem.multipliers import find_multipliers
from taskopt.problem.resolution import Resolution, Status
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.closed_form import refuse_inequalities, task_priority


@dataclass(frozen=True)
class PseudoInverse:
    """(3.54) for two levels, task priority of Siciliano and Slotine (1991) for any number.

    With q̇₀ as second level the recursion is (3.54): (I N)† (q̇₀ − J† v) = N q̇₀. Limits are not
    looked at; hard equalities are the first level. Raises `InvalidValue` where a level holds a true
    inequality.
    """

    name: str = "pinv"
    strict: bool = True

    def __call__(
        self,
        hierarchy: Hierarchy,
        memory: Memory | None = None,  # noqa: ARG002 - each tick starts cold
    ) -> tuple[Resolution, Memory]:
        return _formula(hierarchy, self.name, self.twin(hierarchy))

    def twin(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


@dataclass(frozen=True)
class DampedLeastSquares:
    """Task priority with the damped inverse (3.59) at each level, the projector undamped.

    `damping` k: more bounds the velocity near singularities, and costs tracking everywhere. Raises
    `InvalidValue` where a level holds a true inequality.
    """

    damping: float = 0.05
    name: str = "dls"
    strict: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.damping) and self.damping > 0.0):
            raise InvalidValue(f"damping must be > 0, got {self.damping}; without damping it is pinv")

    def __call__(
        self,
        hierarchy: Hierarchy,
        memory: Memory | None = None,  # noqa: ARG002 - each tick starts cold
    ) -> tuple[Resolution, Memory]:
        return _formula(hierarchy, self.name, self.twin(hierarchy))

    def twin(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy, self.damping)


def _formula(hierarchy: Hierarchy, name: str, x: Array) -> tuple[Resolution, Memory]:
    refuse_inequalities(hierarchy, name)
    state = np.zeros(hierarchy.n + hierarchy.layout.row_count, dtype=np.int8)
    return answered(hierarchy, x, find_multipliers(hierarchy, x), state, Status.FORMULA)
