"""quadprog, a dual active-set solver.

Source: Goldfarb and Idnani (1983), Mathematical Programming 27; McGibbon et al., quadprog, software, GPL-2.0.
"""

from typing import Any

import numpy as np
import quadprog as package

from taskopt.hierarchy.qp import QuadraticProgram, Solution
from taskopt.hierarchy.status import Status
from taskopt.solver.forms import join_sides, list_sides, write_sides
from taskopt.solver.inside import inside

quadprog: Any = package  # a compiled module without stubs: a type checker sees no names in it


def solve(qp: QuadraticProgram, accuracy: float) -> Solution:  # noqa: ARG001 (protocol)
    """Solve a strictly convex program; see `taskopt.solver.base.Solve`.

    Args:
        qp: The program; H must be positive definite.
        accuracy: Not used, as quadprog offers no choice.

    Returns:
        The solution with its multipliers. quadprog does not distinguish infeasible programs from failures, so
        that the status is either SOLVED, or FAILED with x = NaN.
    """
    n, m = qp.C.shape[1], len(qp.C)
    place, sign = np.empty(2 * (n + m), dtype=np.int64), np.empty(2 * (n + m))
    given = qp.lower, qp.upper, qp.box_lower, qp.box_upper
    equalities, count = list_sides(given, place, sign)
    if not count:  # quadprog then takes no rows, rather than none of them
        with inside:
            x, _, _, iterations, _, _ = quadprog.solve_qp(qp.H, -qp.g)
        return Solution(x, np.zeros(m), np.zeros(n), Status.SOLVED, int(iterations[0]))
    columns, sides = np.empty((n, count)), np.empty(count)
    write_sides(np.ascontiguousarray(qp.C), given, place, sign, columns, sides)
    try:
        with inside:
            x, _, _, iterations, y, _ = quadprog.solve_qp(qp.H, -qp.g, columns, sides, equalities)
    except ValueError:  # it says so in words only, if there is no solution
        nothing = np.full(n + m, np.nan)
        return Solution(nothing[:n], nothing[n:], nothing[:n], Status.FAILED)
    multipliers = np.zeros(m + n)
    join_sides(place, sign, y, multipliers)
    return Solution(x, multipliers[:m], multipliers[m:], Status.SOLVED, int(iterations[0]))
