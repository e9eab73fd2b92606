"""`pinv` and `dls`, the formulas of the chapter as resolvers, which ignore limits and claim no optimum."""

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
from taskopt.resolver.closed_form import descend, task_priority


@dataclass(frozen=True)
class PseudoInverse:
    """Resolve by task priority with the pseudo-inverse, for any number of levels.

    For two levels with q̇₀ as the second level it is (3.54), since N (I N)† (q̇₀ − J† v) = N Nᵀ q̇₀. It
    promises the lexicographic optimum of the equalities, with the hard equalities before the first level. It
    ignores limits, and its status is always FORMULA. It refuses levels with inequalities.

    Attributes:
        rule: Decides ranks; the ranks are the memory of this resolver.
        name: Name of the resolver.
        strict: True: priorities between levels are exact.

    Source:
        Siciliano and Slotine (1991), ICAR; (3.54).
    """

    rule: RankRule = RULE
    name: str = "pinv"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy by formula.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned; None for a cold start.

        Returns:
            The answer, and a memory that holds the ranks.

        Raises:
            InvalidValue: A level holds an inequality, or the memory belongs to another layout.
        """
        return _by_formula(hierarchy, self.name, NONE, self.rule, memory)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return task_priority(hierarchy)


@dataclass(frozen=True)
class DampedLeastSquares:
    """Resolve by task priority with the damped inverse at each level and the projector undamped.

    It promises velocities that stay bounded near a singularity, at the cost of errors of the task. It ignores
    limits, and its status is always FORMULA. Its closed-form answer is that of `PseudoInverse`, so that the
    distance between the two is the effect of the damping. It refuses levels with inequalities.

    Attributes:
        damping: Policy that gives k² for each singular value, see `taskopt.hierarchy.damping`.
        rule: Decides ranks; the ranks are the memory of this resolver.
        strict: False: a damped level is not met exactly.

    Source:
        (3.59).
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
        """Name of the resolver: "dls" for constant damping, else "dls/" and the name of the policy."""
        constant = isinstance(self.damping, ConstantDamping)
        return "dls" if constant else f"dls/{self.damping.name}"

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy by formula.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned; None for a cold start.

        Returns:
            The answer, and a memory that holds the ranks.

        Raises:
            InvalidValue: A level holds an inequality, or the memory belongs to another layout.
        """
        return _by_formula(hierarchy, self.name, self.damping, self.rule, memory)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of task priority without damping; see `task_priority`."""
        return task_priority(hierarchy)


def _by_formula(
    hierarchy: Hierarchy, name: str, damping: Damping, rule: RankRule, memory: Memory | None
) -> tuple[Resolution, Memory]:
    """Solve the levels in order, and return x with the multipliers that fit it best."""
    _refuse_inequalities(hierarchy, name)
    memory = checked(memory, hierarchy.layout)
    previous_ranks = memory.ranks if memory else ()
    x, levels = descend(equality_levels(hierarchy), hierarchy.norm, damping, rule, previous_ranks)
    state = np.zeros(hierarchy.layout.width, dtype=np.int8)
    return answered(hierarchy, x, find_multipliers(hierarchy, x), state, Status.FORMULA, levels=levels)


def _refuse_inequalities(hierarchy: Hierarchy, name: str) -> None:
    """Raise `InvalidValue` if a level holds an inequality; the error names its row."""
    first = int(hierarchy.layout.offsets[1])
    lower, upper = hierarchy.lower[first:], hierarchy.upper[first:]
    out_of_force = (lower == -np.inf) & (upper == np.inf)  # asks for nothing, and so is no inequality
    unequal = np.flatnonzero((lower != upper) & ~out_of_force)
    if unequal.size:
        row = hierarchy.layout.row_names[first + int(unequal[0])]
        raise InvalidValue(
            f"{name} is a closed form and knows no inequality, got {row}; use hqp/… or active-set"
        )
