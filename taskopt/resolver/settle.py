"""What becomes of a tick whose hard limits contradict each other: an error, least relaxation, or brakes.

That they do is decided by our own phase one (`conflict`), not by the status of a solver; where it finds
none, there is nothing to settle, and the answer stays what it was.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import Infeasible
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Resolver, answered
from taskopt.resolver.infeasible import Conflict, conflict, relaxed
from taskopt.resolver.policy import Policy

_COUNTS = 1e-9  # [rad/s, m/s] a limit that is broken by less is kept


def settle(
    policy: Policy, resolver: Resolver, hierarchy: Hierarchy, answer: Resolution, brakes: Array, when: str
) -> Resolution:
    """What is sent instead of an `answer` that may not be; the same where the limits do agree.

    `brakes` (n,) slows down as hard as it may. Raises `Infeasible` with the conflict in words and a copy
    of the problem.
    """
    found = conflict(hierarchy)
    if found is None:
        return answer
    if policy == "brake":
        return _braked(hierarchy, brakes, found)
    if policy == "raise":
        raise Infeasible(f"{resolver.name} at {when}: {found}", hierarchy.copy())
    result = resolver(relaxed(hierarchy, found))[0]
    status = Status.RELAXED if result.status is Status.SOLVED else result.status
    return result.replaced(status, (f"Relaxed, {found}.",))


def _braked(hierarchy: Hierarchy, brakes: Array, found: Conflict) -> Resolution:
    layout = hierarchy.layout
    nothing = np.zeros((layout.level_count + 1, layout.width))
    state = np.zeros(layout.width, dtype=np.int8)
    result = answered(hierarchy, brakes, nothing, state, Status.BRAKED)[0]
    return result.replaced(notes=(f"Braking, {found}.", *_still_broken(hierarchy, brakes)))


def _still_broken(hierarchy: Hierarchy, v: Array) -> list[str]:
    """Hard limits that not even the brakes keep, by name, with the amount."""
    layout, n = hierarchy.layout, hierarchy.n
    hard = layout.rows_of_level(0)
    value = np.concatenate([v, hierarchy.A[hard] @ v])
    above = value - np.concatenate([hierarchy.box_upper, hierarchy.upper[hard]])
    below = np.concatenate([hierarchy.box_lower, hierarchy.lower[hard]]) - value
    sentences = []
    for i in np.flatnonzero(np.maximum(above, below) > _COUNTS):
        upper, gap = above[i] >= below[i], max(above[i], below[i])
        name = hierarchy.bound_name(int(i), bool(upper)) if i < n else layout.row_names[i - n]
        sentences.append(f"The brakes break {name} by {gap:.3g} {layout.unit(int(i))}".rstrip() + ".")
    return sentences
