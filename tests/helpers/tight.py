"""Hierarchies whose bounds lie at the optimum, or within 1e-9 of it on either side."""

import numpy as np

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.active_set.resolver import ActiveSet
from tests.helpers.oracles import random_hierarchy

_HAIRS = np.array([0.0, 1e-9, -1e-9, 1e-10, -1e-12, 5e-10])


def tight_hierarchy(seed: int) -> Hierarchy:
    """A random hierarchy, its box drawn in to the optimum in about half of the unknowns, but for a hair."""
    loose = random_hierarchy(seed)
    rng = np.random.default_rng([seed, 1])
    x, n = ActiveSet()(loose)[0].x, loose.n
    hair = rng.choice(_HAIRS, n) * rng.random(n).round(1)
    upper, drawn = rng.random(n) < 0.5, rng.random(n) < 0.6
    box_lower, box_upper = loose.box_lower.copy(), loose.box_upper.copy()
    box_upper[drawn & upper] = (x + hair)[drawn & upper]
    box_lower[drawn & ~upper] = (x - hair)[drawn & ~upper]
    levels = [Level(row.A, lower=row.lower, upper=row.upper, weight=row.weight) for row in loose.levels]
    hard = loose.limits
    limits = Level(hard.A, lower=hard.lower, upper=hard.upper) if len(hard.lower) else None
    box = np.minimum(box_lower, box_upper), np.maximum(box_lower, box_upper)
    return Hierarchy(levels, box, limits, loose.norm)
