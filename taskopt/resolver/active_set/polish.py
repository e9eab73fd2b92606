"""Polishing: solving again by orthogonal factorisation, from the active set that a solver found.

The polished answer is never mixed with the raw answer of a solver, by which solvers are compared.
"""

from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import NO_OPTIMUM, Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory

_NOTHING_TO_POLISH = NO_OPTIMUM | {Status.INFEASIBLE}


def polish(resolution: Resolution) -> Resolution:
    """Solve the same problem again, with the final active set of an answer as equalities.

    If that active set is not optimal, our own search changes it.

    Args:
        resolution: The answer of any resolver.

    Returns:
        The polished answer with its own status and certificate. Its `iterations` count the factorisations;
        they are 1 if and only if the active set was optimal. An answer that does not aim at an optimum, such
        as a closed form or braking, is returned unchanged.
    """
    if resolution.status in _NOTHING_TO_POLISH:
        return resolution
    return ActiveSet(fast_path=False)(resolution.problem, Memory(resolution.state))[0]
