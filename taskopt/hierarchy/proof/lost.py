"""Directions that the rank policy of the resolvers drops, and exact arithmetic keeps."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.tolerances import ACCURACY, LOST


def rows_of_lost_directions(hierarchy: Hierarchy, x: Array, optimum: Array) -> tuple[int, ...]:
    """Return the rows that tell x from the exact optimum only because ranks have no tolerance there.

    The direction from x to the optimum is lost at a level if no row that counts there changes by more than
    LOST · max(1, ‖a‖) times its length, which is when the search takes a row as dependent on others. If it is
    lost at the first levels, and the next level costs no more at x than at the optimum, then x is the better
    answer to the level that can be told, and rounding decides.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,).
        optimum: The exact optimum, rounded, (n,).

    Returns:
        Indices of the rows that decide; empty if x is not the optimum for another reason, such as a hard
        limit that it breaks.
    """
    layout, step = hierarchy.layout, optimum - x
    limits = layout.rows_of_level(0).stop
    value = hierarchy.values(x, limits)
    if (excess(value, *hierarchy.bounds(limits)) > ACCURACY * np.maximum(1.0, np.abs(value))).any():
        return ()
    allowed = LOST * np.maximum(1.0, np.linalg.norm(hierarchy.A, axis=1)) * np.linalg.norm(step)
    change, decide = np.abs(hierarchy.A @ step), []
    for k, level in enumerate(hierarchy.levels, start=1):
        rows = layout.rows_of_level(k)
        counts = (level.lower == level.upper) | (level.distance(x) != 0.0) | (level.distance(optimum) != 0.0)
        if (change[rows] > allowed[rows])[counts].any():
            return tuple(decide) if level.cost(x) <= level.cost(optimum) else ()
        decide += [rows.start + int(i) for i in np.flatnonzero(counts & (change[rows] > 0.0))]
    W = hierarchy.norm if hierarchy.norm.ndim == 2 else np.diag(hierarchy.norm)
    return tuple(decide) if x @ W @ x <= optimum @ W @ optimum else ()
