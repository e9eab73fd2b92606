"""How much worse each level is met than it could be: the leak of anybody's answer to a hierarchy."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import Infeasible, NotSolved
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.status import Status
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.infeasible import find_conflict


def regret(hierarchy: Hierarchy, x: ArrayLike) -> Array:
    """ℓ_k(x) = ‖d_k(x)‖_w − ‖d_k(x*)‖_w of each level, (levels,), in the units of its rows.

    x* is the lexicographic optimum, d_k what the rows of level k lack, and ‖d‖_w² = Σ w d². Above 0: the
    level was given up for a lower one, by weights that are not infinite or a cost that is projected; below
    0: x met it better, at the cost of a level before it or of a hard limit. Raises `InvalidValue` for an x
    that is not (n,) finite numbers, `Infeasible` where hard limits contradict each other, and `NotSolved`
    where the optimum could not be proven.
    """
    x = finite("x", x, (hierarchy.n,))
    best = ActiveSetWithFallback()(hierarchy)[0]
    if best.status is Status.INFEASIBLE:
        raise Infeasible(f"no level has an optimum: {find_conflict(hierarchy)}", hierarchy.copy())
    if not best.certified():
        raise NotSolved(f"no leak without the optimum: {best.certificate}", best)
    return level_residuals(hierarchy, x) - level_residuals(hierarchy, best.x)


def level_residuals(hierarchy: Hierarchy, x: Array) -> Array:
    """‖d_k(x)‖_w of each level, (levels,)."""
    return np.array([np.sqrt(2.0 * level.cost(x)) for level in hierarchy.levels])
