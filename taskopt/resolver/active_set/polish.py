"""The polished answer: solved again, by orthogonal factorisation, from the active set that a solver found.

It is kept apart from the raw answer everywhere: solvers are compared by the raw one.
"""

from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import NO_OPTIMUM, Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory

_NOTHING_TO_POLISH = NO_OPTIMUM | {Status.INFEASIBLE}


def polish(resolution: Resolution) -> Resolution:
    """Solve the same problem again, with the final active set of an answer as equalities.

    Where that set is wrong, rows change from there on by our own search.

    Args:
        resolution: The answer of any resolver.

    Returns:
        The polished answer with its own status and certificate. Its `iterations` count the factorisations: 1
        if and only if the set was right as it stood. What did not aim at an optimum, such as a closed form or
        brakes, is returned as it is.
    """
    if resolution.status in _NOTHING_TO_POLISH:
        return resolution
    return ActiveSet(fast_path=False)(resolution.problem, Memory(resolution.state))[0]
