"""The regret of each level, by which an answer is worse there than the lexicographic optimum.

It compares answers to one hierarchy from any source, such as a weighted QP, a pseudo-inverse or another
library.
"""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import Infeasible, NotSolved
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.status import Status
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.infeasible import find_conflict


def regret(hierarchy: Hierarchy, x: ArrayLike) -> Array:
    """Return the regret r_k(x) = ‖d_k(x)‖_w − ‖d_k(x*)‖_w of each level.

    x* is the lexicographic optimum, d_k(x) the distance of the rows of level k to their bounds, and
    ‖d‖_w² = Σ w d². A positive regret means that x makes the level worse in favour of a lower one, as finite
    weights do. A negative regret means that x meets the level better than the optimum, at the cost of a level
    before it or of a hard limit.

    Args:
        hierarchy: The problem.
        x: (n,) an answer to it.

    Returns:
        (levels,) regrets, in the units of the rows of each level.

    Raises:
        InvalidValue: x is not an array of n finite numbers.
        Infeasible: The hard limits contradict each other.
        NotSolved: No optimum was found.
    """
    x = finite("x", x, (hierarchy.n,))
    best = ActiveSetWithFallback()(hierarchy)[0]
    if best.status is Status.INFEASIBLE:
        raise Infeasible(f"no level has an optimum: {find_conflict(hierarchy)}", hierarchy.copy())
    if not best.claimed:
        raise NotSolved(f"no regret without the optimum: {best.certificate}", best)
    return level_residuals(hierarchy, x) - level_residuals(hierarchy, best.x)


def level_residuals(hierarchy: Hierarchy, x: Array) -> Array:
    """Return ‖d_k(x)‖_w of each level, with the distances d_k(x) of its rows to their bounds.

    Args:
        hierarchy: The problem.
        x: (n,) an answer to it.

    Returns:
        (levels,) norms, in the units of the rows of each level.
    """
    return np.array([np.sqrt(2.0 * level.cost(x)) for level in hierarchy.levels])
