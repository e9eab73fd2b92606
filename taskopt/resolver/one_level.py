"""Hierarchies of one level with the norm as rows, which one quadratic program answers.

The resolvers that put all levels into one program state such a problem each, and answer it by this module.
"""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.layout import Block, Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.qp import QuadraticProgram
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import UNFINISHED_VIOLATION
from taskopt.resolver.base import Memory, answered_by_x
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.refinement import has_numbers
from taskopt.resolver.solver_accuracy import SolverTo
from taskopt.resolver.weighted_kernels import inverse_of, orthogonal_rows, unknowns_of
from taskopt.solver.registry import solver


def answer_one_level(
    problem: Hierarchy, name: str, accuracy: float, counted: float
) -> tuple[Resolution, Memory]:
    """Answer a hierarchy of one level by one program.

    Args:
        problem: The problem; its equality rows have full column rank.
        name: Name of the solver.
        accuracy: Accuracy wanted in x, relative to its largest entry.
        counted: Least multiplier that makes a row active, see `taskopt.resolver.base.final_state`.

    Returns:
        The answer to this problem, and a memory in which no row is active.

    Raises:
        UnknownName: There is no solver of that name.
        NotInstalled: The package of the solver cannot be imported.
    """
    qp, B, diagonal = orthogonal_program(problem)
    engine = solver(name)
    inverse = partial(inverse_of, B, diagonal)
    solve = SolverTo(engine, accuracy, engine.most_iterations, inverse, refine=engine.promises)
    solution = solve(qp)
    if solution.status in (Status.INFEASIBLE, Status.FAILED) or not has_numbers(solution):
        return no_answer(problem, solution.status, solution.iterations)
    x = unknowns_of(B, diagonal, solution.x)
    claim = solution.status, solution.iterations
    resolution = answered_by_x(problem, x, *claim, accuracy, counted=counted)
    if solution.status is not Status.SOLVED and resolution.broken_limit > UNFINISHED_VIOLATION:
        return no_answer(problem, *claim)
    return refuse_broken_claim((resolution, Memory(np.zeros(problem.layout.width, dtype=np.int8))))


def orthogonal_program(problem: Hierarchy) -> tuple[QuadraticProgram, Array, Array]:
    """Convert a hierarchy of one level to a program whose Hessian is the identity.

        min ½ ‖u − Qᵀ c‖² + ½ ‖t‖²   in u = R x and slacks t,   where √w A = Q R and c = √w b

    in which A and b are the equality rows of the level. No normal equations are formed.

    Args:
        problem: A hierarchy of one level whose equality rows have full column rank, as after
            `with_rows_of_norm`.

    Returns:
        The program in (u, t), and the two arrays from which `unknowns_of` finds x.

    Source:
        Lawson and Hanson (1974), "Solving Least Squares Problems", Chapter 23.
    """
    B, diagonal, g, C, lower, upper = orthogonal_rows(problem.buffer, problem.n, problem.layout.offsets)
    none = np.full(len(g), np.inf)
    return QuadraticProgram(np.eye(len(g)), g, C, lower, upper, -none, none), B, diagonal


def with_rows_of_norm(hierarchy: Hierarchy, *, units: bool, norm_units: bool) -> Hierarchy:
    """Copy a hierarchy into one of a single level, with n rows for the norm after the others.

    Args:
        hierarchy: The problem with strict levels.
        units: True if rows that are unit vectors are to stay such.
        norm_units: True if row i of the norm is to be the unit vector e_i.

    Returns:
        A hierarchy with the same names and norm I. The rows A and weights of the norm are left for the caller
        to fill, as are the weights of all other rows.
    """
    layout = one_level_layout(hierarchy.layout, units=units, norm_units=norm_units)
    problem = Hierarchy.view(layout, np.zeros(layout.size), np.ones(hierarchy.n))
    problem.owner[:] = hierarchy.owner
    count = hierarchy.layout.row_count
    problem.A[:count] = hierarchy.A
    problem.lower[:count] = hierarchy.lower
    problem.upper[:count] = hierarchy.upper
    problem.label[:count] = hierarchy.label
    problem.box_lower[:], problem.box_upper[:] = hierarchy.box_lower, hierarchy.box_upper
    return problem


@lru_cache(maxsize=64)
def one_level_layout(layout: Layout, *, units: bool, norm_units: bool) -> Layout:
    """Return the layout of one level: all blocks in level 1, then the rows of the norm.

    Args:
        layout: Layout of the problem with strict levels.
        units: As of `with_rows_of_norm`.
        norm_units: As of `with_rows_of_norm`.

    Returns:
        The layout.
    """
    blocks = tuple(replace(block, level=min(block.level, 1)) for block in layout.blocks)
    start, n = layout.row_count, layout.n
    norm = Block("norm", 1, start, start + n, layout.unknowns, ("",) * n)
    column = (units and layout.column) or (-1,) * start
    own = tuple(range(n)) if norm_units else (-1,) * n
    return Layout(layout.unknowns, (*blocks, norm), 1, layout.owners, (*column, *own))
