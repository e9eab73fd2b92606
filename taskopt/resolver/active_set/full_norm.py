"""Norms W that are full matrices, solved in z = L x with W = LᵀL, where the norm is the identity.

Bounds on single unknowns become hard rows in z; the multipliers stay the same.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.linalg import solve_triangular

from taskopt.arrays import Array
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered, fit_again
from taskopt.resolver.tick_review import TickReview


def whitened(hierarchy: Hierarchy) -> tuple[Hierarchy, Array]:
    """Rewrite a hierarchy in the unknowns z = L x.

    Args:
        hierarchy: A hierarchy with a full norm, (n, n).

    Returns:
        The same problem in z, with its box as hard rows, and L⁻¹ (n, n), so that x = L⁻¹ z.
    """
    n = hierarchy.n
    factor = np.linalg.cholesky(hierarchy.norm_matrix()).T
    inverse = solve_triangular(factor, np.eye(n))
    layout = _with_box_as_rows(hierarchy.layout)
    result = Hierarchy.view(layout, np.zeros(layout.size), np.ones(n))
    result.A[:] = np.vstack([inverse, hierarchy.A @ inverse])
    result.lower[:] = np.concatenate([hierarchy.box_lower, hierarchy.lower])
    result.upper[:] = np.concatenate([hierarchy.box_upper, hierarchy.upper])
    result.weight[:] = np.concatenate([np.ones(n), hierarchy.weight])
    result.label[n:] = hierarchy.label
    result.box_lower[:], result.box_upper[:] = -np.inf, np.inf
    return result, inverse


def resolve_full_norm(
    resolve: Callable[[Hierarchy, Memory], tuple[Resolution, Memory]],
    hierarchy: Hierarchy,
    memory: Memory | None,
) -> tuple[Resolution, Memory]:
    """Resolve a hierarchy with a full norm by a resolver that handles only diagonal norms.

    Args:
        resolve: The resolver for diagonal norms.
        hierarchy: A hierarchy with a full norm, (n, n).
        memory: Memory of the last tick, or None.

    Returns:
        The resolution, certified on the rows as declared, and the memory for the next tick.
    """
    n = hierarchy.n
    problem, inverse = whitened(hierarchy)
    last = np.zeros(hierarchy.layout.width, dtype=np.int8) if memory is None else memory.state
    answer, after = resolve(problem, Memory(np.concatenate([np.zeros(n, dtype=np.int8), last])))
    x = np.clip(inverse @ answer.x, hierarchy.box_lower, hierarchy.box_upper)
    state = after.state[n:]
    claim, kept = answered(hierarchy, x, answer.multipliers[:, n:], state, answer.status, answer.iterations)
    if claim.claimed and not claim.kkt_met():
        status = Status.SOLVED if fit_again(hierarchy, claim.answer) else Status.FAILED
        claim = Resolution(hierarchy, claim.answer, state, status, claim.iterations, TickReview)
    return claim, kept


@lru_cache(maxsize=16)
def _with_box_as_rows(layout: Layout) -> Layout:
    """Return the layout with the box as hard rows; indices of multipliers and states stay the same."""
    n = layout.n
    box = Block("box", 0, 0, n, layout.unknowns, ("",) * n)
    moved = tuple(replace(block, start=block.start + n, stop=block.stop + n) for block in layout.blocks)
    return Layout(layout.unknowns, (box, *moved), layout.level_count)
