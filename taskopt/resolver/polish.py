"""The polished answer: the hierarchy solved again with the rows that a solver found active as equalities.

It is kept apart from the raw answer everywhere: solvers are compared by the raw one.
"""

import numpy as np

from taskopt.problem.multipliers import find_multipliers
from taskopt.problem.resolution import Resolution
from taskopt.resolver.base import answered
from taskopt.resolver.closed_form import descend
from taskopt.resolver.review import held_levels


def polish(resolution: Resolution) -> Resolution:
    """The same problem, by orthogonal factorisation on the final active set of `resolution`.

    Status, state and iterations are those of the raw answer; the certificate is of the new x. Where
    the active set is wrong, so is x, and the certificate says so.
    """
    problem, state = resolution.problem, resolution.state
    if not np.isfinite(resolution.x).all():
        return resolution
    x = descend(held_levels(problem, state), problem.norm).x
    return answered(
        problem, x, find_multipliers(problem, x), state, resolution.status, resolution.iterations
    )[0]
