"""`pinv` and `dls`, the formulas of the chapter as resolvers, which ignore limits and claim no optimum."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.damping import CONSTANT, NONE, ConstantDamping, Damping, NoDamping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel
from taskopt.resolver.base import Memory, answered_by_x, checked
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.descent import accounts_of, descend_hierarchy


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
    """Solve the levels in order, and return x; multipliers that fit it best are found when asked for."""
    refuse_inequalities(hierarchy, name)
    memory = checked(memory, hierarchy.layout)
    before = memory.ranks if memory else ()
    x = np.empty(hierarchy.n)
    ranks = descend_hierarchy(hierarchy, damping, rule, before, x)
    own = partial(accounts_of, damping=damping, rule=rule, previous_ranks=before)
    resolution = answered_by_x(hierarchy, x, Status.FORMULA, levels=own)
    return resolution, Memory(np.zeros(hierarchy.layout.width, dtype=np.int8), ranks)


def refuse_inequalities(hierarchy: Hierarchy, name: str) -> None:
    """Refuse levels with inequalities.

    Args:
        hierarchy: The problem.
        name: Name of the resolver that refuses.

    Raises:
        InvalidValue: A level holds an inequality; the error names its row.
    """
    layout = hierarchy.layout
    first = first_inequality(hierarchy.lower, hierarchy.upper, layout.offsets)
    if first >= 0:
        row = layout.row_names[first]
        raise InvalidValue(
            f"{name} is a closed form and knows no inequality, got {row}; use hqp/… or active-set"
        )


@kernel
def first_inequality(lower: Array, upper: Array, offsets: IntArray) -> int:
    """Return the first row of the levels that is an inequality, or −1 if there is none.

    A row without bounds asks for nothing, and so is no inequality.

    Args:
        lower: (M,) lower bounds of the rows.
        upper: (M,) upper bounds of the rows.
        offsets: First rows of the levels, (levels + 2,).

    Returns:
        Index of the row.
    """
    for i in range(offsets[1], lower.size):
        if lower[i] != upper[i] and not (lower[i] == -np.inf and upper[i] == np.inf):
            return i
    return -1
