"""`pinv` and `dls`: the chapter's formulas as resolvers. They know no limit, and claim nothing."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import CONSTANT, NONE, ConstantDamping, Damping, NoDamping
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, equality_levels
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered, checked
from taskopt.resolver.closed_form import descend, refuse_inequalities, task_priority


@dataclass(frozen=True)
class PseudoInverse:
    """(3.54) for two levels, task priority of Siciliano and Slotine (1991) for any number.

    With q̇₀ as second level the recursion is (3.54): (I N)† (q̇₀ − J† v) = N q̇₀. Limits are not
    looked at; hard equalities are the first level. Its memory are the ranks, which `rule` decides.
    Raises `InvalidValue` where a level holds a true inequality.
    """

    rule: RankRule = RULE
    name: str = "pinv"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return _formula(hierarchy, self.name, NONE, self.rule, memory)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


@dataclass(frozen=True)
class DampedLeastSquares:
    """Task priority with the damped inverse (3.59) at each level, the projector undamped.

    `damping`: the policy that gives k² (see `taskopt.hierarchy.damping`). Its twin is the undamped
    formula, so that the distance to it is what damping costs. Raises `InvalidValue` where a level
    holds a true inequality.
    """

    damping: Damping = CONSTANT
    rule: RankRule = RULE
    strict: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.damping, NoDamping) or not callable(self.damping):
            raise InvalidValue(
                f"damping must be a policy such as Chiaverini(0.05, 0.05), got {self.damping}; "
                "without damping it is pinv"
            )

    @property
    def name(self) -> str:
        constant = isinstance(self.damping, ConstantDamping)
        return "dls" if constant else f"dls/{self.damping.name}"

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return _formula(hierarchy, self.name, self.damping, self.rule, memory)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


def _formula(
    hierarchy: Hierarchy, name: str, damping: Damping, rule: RankRule, memory: Memory | None
) -> tuple[Resolution, Memory]:
    refuse_inequalities(hierarchy, name)
    known = checked(memory, hierarchy.layout)
    before = known.ranks if known else ()
    x, levels = descend(equality_levels(hierarchy), hierarchy.norm, damping, rule, before)
    state = np.zeros(hierarchy.n + hierarchy.layout.row_count, dtype=np.int8)
    return answered(hierarchy, x, find_multipliers(hierarchy, x), state, Status.FORMULA, levels=levels)
