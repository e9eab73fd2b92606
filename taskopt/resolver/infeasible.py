"""Hard limits that contradict each other: phase one, conflicts, the least relaxation, conflict policies.

Only this module decides if the hard limits of a hierarchy contradict each other, because the status of a
solver is only a claim. Phase one solves

    min over x of ½ Σ_i max(a_iᵀ x − b_i, 0)²,

in which every finite hard bound is one row a_iᵀ x ≤ b_i. The optimum is zero if and only if the limits
can hold together. If it is positive, the gaps w_i = max(a_iᵀ x − b_i, 0) are a Farkas certificate,
Σ w_i a_i = 0 with w ≥ 0 and bᵀ w < 0. Their support contains a conflict, and relaxing each bound by its
gap is the least relaxation in the Euclidean norm. The conflict is made minimal by a deletion filter.

Source: Chinneck (2008), "Feasibility and Infeasibility in Optimization", Sect. 6.2 (deletion filter).
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import Infeasible, UnknownName
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import BROKEN_LIMIT, GAP_NOISE, KKT_MET, LIMITS_AGREE, RELAXATION_ROOM
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory, Resolver, answered

_PHASE_ONE_ITERATIONS = 5000  # factorisations; the rows of phase one are degenerate, so allow more than usual

ConflictPolicy = Literal["raise", "relax", "brake"]
"""The conflict policies: the ways to go on when hard limits contradict each other.

"raise": raise `Infeasible`. "relax": let the limits give way by the least relaxation. "brake": slow down to
standstill as hard as the acceleration limits allow.
"""


class Side(NamedTuple):
    """One side of one hard limit: a · x ≤ bound ("upper") or a · x ≥ bound ("lower").

    Attributes:
        name: Name of the limit and of its row or unknown, such as "joint_velocity/joint1".
        side: "lower" or "upper".
        bound: The bound, in the unit of its row.
        unit: Unit of the bound; "" where the unknowns are plain numbers.
    """

    name: str
    side: str
    bound: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.name} {'≤' if self.side == 'upper' else '≥'} {_with_unit(self.bound, 6, self.unit)}"


@dataclass(frozen=True, eq=False)
class Conflict:
    """A minimal set of hard limits that cannot hold together, and the least relaxation of all limits.

    Attributes:
        members: The sides in conflict. The set is minimal: without any one of them the others can hold.
        relaxation: Pairs of a side and the amount (> 0, in the unit of its row) by which it has to give way
            so that all limits can hold. The Euclidean norm of the amounts is the least possible.
    """

    members: tuple[Side, ...]
    relaxation: tuple[tuple[Side, float], ...]

    def __str__(self) -> str:
        members = "; ".join(map(str, self.members))
        least = ", ".join(
            f"{side.name} {side.side} by {_with_unit(gap, 3, side.unit)}" for side, gap in self.relaxation
        )
        return f"these limits exclude each other: {members}; least relaxation: {least}"


def limits_agree(hierarchy: Hierarchy) -> bool:
    """Return True if the hard limits of a hierarchy can hold together, as phase one decides.

    Args:
        hierarchy: Any hierarchy; its levels are ignored.

    Returns:
        False if every x violates at least one hard limit by more than the tolerance of phase one.
    """
    sides, A, bound = _one_sided_limits(hierarchy)
    return not _gaps(A, bound, np.arange(len(sides))).any()


def find_conflict(hierarchy: Hierarchy) -> Conflict | None:
    """Find a minimal set of hard limits that contradict each other.

    The deletion filter starts from the sides that have a gap at the optimum of phase one. It removes one
    side after the other and keeps a side out if the rest is still infeasible.

    Args:
        hierarchy: Any hierarchy; its levels are ignored.

    Returns:
        The conflict with the least relaxation of all limits, or None if the limits can hold together.

    Source:
        Chinneck (2008), "Feasibility and Infeasibility in Optimization", Sect. 6.2.
    """
    sides, A, bound = _one_sided_limits(hierarchy)
    gap = _gaps(A, bound, np.arange(len(sides)))
    if not gap.any():
        return None
    relaxation = tuple((sides[i], float(gap[i])) for i in np.flatnonzero(gap))
    members = np.flatnonzero(gap)
    for candidate in list(members):
        rest = members[members != candidate]
        if _gaps(A, bound, rest).any():
            members = rest
    return Conflict(tuple(sides[i] for i in members), relaxation)


def relax(hierarchy: Hierarchy, conflict: Conflict) -> Hierarchy:
    """Return a copy of a hierarchy whose hard limits are moved outwards by the least relaxation.

    Each bound b moves outwards by its gap plus `RELAXATION_ROOM` · max(1, |b|). Without that extra room the
    feasible set would be as thin as rounding errors, and no solver could find a point in it.

    Args:
        hierarchy: The hierarchy in which `conflict` was found.
        conflict: Its conflict, see `find_conflict`.

    Returns:
        A hierarchy with memory of its own; only bounds of the box and of the hard rows differ.
    """
    relaxed = hierarchy.copy()
    n = relaxed.n
    gaps = {(side.name, side.side): gap for side, gap in conflict.relaxation}
    for i in range(n + relaxed.limits.lower.size):
        for upper in (False, True):
            gap = gaps.get((hierarchy.name_of(i, upper), "upper" if upper else "lower"), 0.0)
            if gap > 0.0:
                box = relaxed.box_upper if upper else relaxed.box_lower
                rows = relaxed.upper if upper else relaxed.lower
                bounds, at = (box, i) if i < n else (rows, i - n)
                room = RELAXATION_ROOM * max(1.0, abs(bounds[at]))
                bounds[at] += gap + room if upper else -gap - room
    return relaxed


def no_answer(hierarchy: Hierarchy, status: Status, iterations: int = 0) -> tuple[Resolution, Memory]:
    """Return an answer with x = NaN, for a resolver that found no velocity that may be sent to a robot.

    The status is INFEASIBLE if and only if phase one finds a contradiction. Solvers claim infeasibility of
    programs that are only hard for them, and give up on programs that are infeasible.

    Args:
        hierarchy: The hierarchy without an answer.
        status: The reason that the solver gave. It is replaced by INFEASIBLE if the limits contradict each
            other, and by FAILED if the solver claimed INFEASIBLE of limits that agree.
        iterations: Iterations that were spent.

    Returns:
        The resolution and a memory in which no row is active.
    """
    if not limits_agree(hierarchy):
        status = Status.INFEASIBLE
    elif status is Status.INFEASIBLE:
        status = Status.FAILED
    width = hierarchy.layout.width
    multipliers = np.zeros((hierarchy.layout.level_count + 1, width))
    state = np.zeros(width, dtype=np.int8)
    return answered(hierarchy, np.full(hierarchy.n, np.nan), multipliers, state, status, iterations)


def refuse_broken_claim(answer: tuple[Resolution, Memory]) -> tuple[Resolution, Memory]:
    """Replace a claimed optimum that violates a hard limit, if phase one finds that every x must do so.

    Args:
        answer: Answer that a resolver is about to return.

    Returns:
        `no_answer` with the status INFEASIBLE if the claim is replaced; otherwise `answer` itself.
    """
    resolution = answer[0]
    broken = resolution.broken_limit
    if not resolution.claimed or broken <= KKT_MET or limits_agree(resolution.problem):
        return answer
    return no_answer(resolution.source, Status.INFEASIBLE, resolution.iterations)


def checked_policy(name: str) -> ConflictPolicy:
    """Check the name of a conflict policy, and return it.

    Args:
        name: "raise", "relax" or "brake".

    Returns:
        The same name, as a `ConflictPolicy`.

    Raises:
        UnknownName: There is no policy of that name.
    """
    for known in get_args(ConflictPolicy):
        if known == name:
            return known
    raise UnknownName("policy for a conflict", name, get_args(ConflictPolicy))


def apply_conflict_policy(
    policy: ConflictPolicy,
    resolver: Resolver,
    hierarchy: Hierarchy,
    answer: Resolution,
    brakes: Array,
    when: str,
) -> Resolution:
    """Decide what to send instead of an answer that may not be sent, if hard limits are the reason.

    Args:
        policy: See `ConflictPolicy`.
        resolver: Resolves the relaxed hierarchy again under the policy "relax".
        hierarchy: The hierarchy of this tick.
        answer: The answer of the resolver, which may not be sent.
        brakes: (n,) velocity [rad/s, m/s] that slows down as hard as the acceleration limits allow.
        when: Time of the tick in words, for the message of the error.

    Returns:
        `answer` itself if phase one finds no contradiction. Otherwise an answer with notes that name the
        conflict, and with the status BRAKED, RELAXED, or that of the resolver for the relaxed hierarchy.

    Raises:
        Infeasible: The policy is "raise" and the limits contradict each other. The error describes the
            conflict and holds a copy of the hierarchy.
    """
    conflict = find_conflict(hierarchy)
    if conflict is None:
        return answer
    if policy == "brake":
        return _braked(hierarchy, brakes, conflict)
    if policy == "raise":
        raise Infeasible(f"{resolver.name} at {when}: {conflict}", hierarchy.copy())
    result = resolver(relax(hierarchy, conflict))[0]
    status = Status.RELAXED if result.status is Status.SOLVED else result.status
    return result.replaced(status, (f"Relaxed, {conflict}.",))


def _braked(hierarchy: Hierarchy, brakes: Array, conflict: Conflict) -> Resolution:
    """Return the braking velocity as an answer whose notes name the conflict and the limits it violates."""
    layout = hierarchy.layout
    multipliers = np.zeros((layout.level_count + 1, layout.width))
    state = np.zeros(layout.width, dtype=np.int8)
    result = answered(hierarchy, brakes, multipliers, state, Status.BRAKED)[0]
    return result.replaced(notes=(f"Braking, {conflict}.", *_broken_limits(hierarchy, brakes)))


def _broken_limits(hierarchy: Hierarchy, v: Array) -> list[str]:
    """Return one sentence with name and amount for each hard limit that v (n,) violates."""
    layout = hierarchy.layout
    stop = layout.rows_of_level(0).stop
    value, (lower, upper) = hierarchy.values(v, stop), hierarchy.bounds(stop)
    gap = excess(value, lower, upper)
    sentences = []
    for i in np.flatnonzero(gap > BROKEN_LIMIT):
        name = hierarchy.name_of(int(i), bool(value[i] > upper[i]))
        amount = _with_unit(gap[i], 3, layout.unit(int(i)))
        sentences.append(f"The brakes break {name} by {amount}.")
    return sentences


def _with_unit(value: float, digits: int, unit: str) -> str:
    """Return a number with the given number of significant digits, followed by its unit if it has one."""
    return f"{value:.{digits}g} {unit}".rstrip()


def _one_sided_limits(hierarchy: Hierarchy) -> tuple[list[Side], Array, Array]:
    """Return every finite hard bound as a · x ≤ b: its description, the rows a (p, n), and b (p,)."""
    n, hard = hierarchy.n, hierarchy.limits
    rows = np.vstack([np.eye(n), hard.A])
    lower, upper = hierarchy.bounds(len(hard.lower))
    sides: list[Side] = []
    a, b = [], []
    for i, row in enumerate(rows):
        for sign, value in ((-1.0, lower[i]), (1.0, upper[i])):
            if np.isfinite(value):
                name, side = hierarchy.name_of(i, sign > 0), "upper" if sign > 0 else "lower"
                sides.append(Side(name, side, float(value), hierarchy.layout.unit(i)))
                a.append(sign * row)
                b.append(sign * value)
    return sides, np.array(a).reshape(-1, n), np.array(b)


def _gaps(A: Array, bound: Array, chosen: IntArray) -> Array:
    """Solve phase one for the chosen rows of A x ≤ bound and return their gaps (p,), 0 for all other rows.

    All gaps are zero if the largest one counts as agreement. Otherwise even small gaps are kept, since the
    remaining rows may be able to hold without the row that has one.
    """
    gap = np.zeros(len(bound))
    if chosen.size:
        rows, upper = A[chosen], bound[chosen]
        phase_one = Hierarchy([Level(rows, upper=upper)])
        x = ActiveSet(iterations=_PHASE_ONE_ITERATIONS)(phase_one)[0].x
        over = np.maximum(rows @ x - upper, 0.0)
        size = np.linalg.norm(rows, axis=1)
        size[size == 0.0] = 1.0
        if (over > LIMITS_AGREE * np.maximum(size, np.abs(upper))).any():
            gap[chosen] = np.where(over > GAP_NOISE * over.max(), over, 0.0)
    return gap
