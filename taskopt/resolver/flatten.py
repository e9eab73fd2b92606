"""All levels of a hierarchy as one, by weights: the problem that `wqp/<solver>` answers."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from taskopt.hierarchy.equality import root_of
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.resolver.closed_form import level_ratio


def flatten(hierarchy: Hierarchy, ratio: float | None = None) -> Hierarchy:
    """The weighted problem as a hierarchy of one level, in which the norm has become n rows more."""
    ratio = ratio or level_ratio(hierarchy.layout.level_count)
    layout = _one_level(hierarchy.layout, hierarchy.norm.ndim == 1)
    problem = Hierarchy.view(layout, np.empty(layout.size), np.ones(hierarchy.n))
    problem.owner[:] = hierarchy.owner
    count, levels = hierarchy.layout.row_count, hierarchy.layout.level_count
    diagonal = hierarchy.norm.ndim == 1
    problem.A[:count] = hierarchy.A
    problem.A[count:] = np.eye(hierarchy.n) if diagonal else root_of(hierarchy.norm)
    problem.lower[:count], problem.lower[count:] = hierarchy.lower, 0.0
    problem.upper[:count], problem.upper[count:] = hierarchy.upper, 0.0
    problem.weight[count:] = hierarchy.norm if diagonal else 1.0
    for k in range(levels + 1):
        rows = hierarchy.layout.rows_of_level(k)
        problem.weight[rows] = hierarchy.weight[rows] * ratio ** (max(k, 1) - 1 - levels)
    problem.box_lower[:], problem.box_upper[:] = hierarchy.box_lower, hierarchy.box_upper
    return problem


@lru_cache(maxsize=64)
def _one_level(layout: Layout, diagonal: bool) -> Layout:
    blocks = tuple(replace(block, level=min(block.level, 1)) for block in layout.blocks)
    start, n = layout.row_count, layout.n
    norm = Block("norm", 1, start, start + n, layout.unknowns, ("",) * n)
    column = layout.column or (-1,) * start
    own = tuple(range(n)) if diagonal else (-1,) * n
    return Layout(layout.unknowns, (*blocks, norm), 1, layout.owners, (*column, *own))
