"""`hqp/<solver>`, a cascade of quadratic programs, one for each level, in the null space of those before.

A level is first stated as equality rows, with the least norm as cost. If limits or its own rows make that
infeasible, it is solved in least squares. Its residuals, and the rows that hold it back, are then fixed for
the levels below.

Source: Kanoun, Lamiraux and Wieber (2011), IEEE Trans. Robotics 27(4).
"""

from dataclasses import dataclass, replace

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, inverse_root, row_scale
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY, INVISIBLE_ROW, LEVEL_MULTIPLIER, LEVEL_VIOLATION
from taskopt.resolver.base import Memory, answered, checked, final_state
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.level_qp import (
    RowSet,
    RowSVD,
    free_directions,
    hides_short_rows,
    least_norm_solution,
    least_violation,
    row_svd,
    shortest_row,
)
from taskopt.resolver.solver_accuracy import checked_accuracy, solve_to
from taskopt.solver.registry import solver


@dataclass(frozen=True)
class HierarchicalQP:
    """Resolve strict priorities with any solver, by one quadratic program for each level.

    It promises the lexicographic optimum within the accuracy of the solver. If a program fails although a
    point inside the limits is known, its level and those below are not solved and the status is
    ITERATION_LIMIT; the limits and the levels before are kept. So is the status of an answer whose proximal
    steps did not converge, or whose solver took more iterations than `Solver.most_iterations`. The status is
    INFEASIBLE, with x = NaN, if and only if phase one finds that the hard limits contradict each other. It
    does not use a warm start.

    Attributes:
        solver: Name of the solver, see `taskopt.solver.registry.solvers`.
        accuracy: Requested accuracy of x, relative to its largest entry; the tolerances of the solver follow
            from it.
        rule: Decides ranks; the ranks are the memory of this resolver.
    """

    solver: str
    accuracy: float = ACCURACY
    rule: RankRule = RULE

    def __post_init__(self) -> None:
        checked_accuracy(self.accuracy)

    @property
    def name(self) -> str:
        """Name of the resolver, such as "hqp/daqp"."""
        return f"hqp/{self.solver}"

    @property
    def strict(self) -> bool:
        """True: priorities between levels are exact."""
        return True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned; the rank rule needs its ranks for the hysteresis.

        Returns:
            The answer, and a memory with its active set and ranks.

        Raises:
            InvalidValue: The memory belongs to a hierarchy of another layout.
            UnknownName: There is no solver of that name.
            NotInstalled: The package of the solver cannot be imported.
        """
        memory = checked(memory, hierarchy.layout)
        cascade = _Cascade(hierarchy, self, memory.ranks if memory else ())
        for k in range(1, hierarchy.layout.level_count + 1):
            if not cascade.level(k):
                break
        else:
            cascade.finish()
        if not cascade.feasible:
            return no_answer(hierarchy, cascade.status, cascade.iterations)
        x = cascade.inverse @ cascade.xi
        y = find_multipliers(hierarchy, x)
        state, levels = final_state(hierarchy, x, y), tuple(cascade.accounts)
        claim = cascade.claim, cascade.iterations
        return refuse_broken_claim(answered(hierarchy, x, y, state, *claim, self.accuracy, levels))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return task_priority(hierarchy)


class _Cascade:
    """The state between levels: ξ so far, a basis Z of the free directions, and the inequality rows.

    Rows are on ξ = L x with W = Lᵀ L and scaled by √w.
    """

    def __init__(self, hierarchy: Hierarchy, resolver: HierarchicalQP, ranks: tuple[int, ...]) -> None:
        self.hierarchy = hierarchy
        engine = solver(resolver.solver)
        self.solve = solve_to(engine, resolver.accuracy, engine.most_iterations, refine=engine.promises)
        self.rule, self.previous_ranks = resolver.rule, ranks
        self.accounts: list[LevelAccount] = []
        self.inverse = inverse_root(hierarchy.norm)
        self.xi, self.Z = np.zeros(hierarchy.n), np.eye(hierarchy.n)
        self.status, self.iterations = Status.SOLVED, 0
        self.converged = True  # whether the proximal steps of all levels so far did
        self.hidden = False  # whether a row was given up because it is short beside others of its level
        self.feasible = False  # whether ξ is known to keep the limits
        self.least = False  # whether ξ has the least norm inside the levels so far
        limits = self._rows(0)
        equal = limits.lower == limits.upper
        self.rows = limits.selected(~equal)
        self._eliminate(limits.selected(equal))
        if self.status is Status.SOLVED:  # x = 0 keeps the limits of most robots
            self.feasible |= not equal.any() and self.rows.contain(self.xi, 0.0)

    @property
    def claim(self) -> Status:
        """The status of the answer; not claimed without convergence, or where long rows hide a short one."""
        return self.status if self.converged and not self.hidden else Status.ITERATION_LIMIT

    def level(self, k: int) -> bool:
        """Resolve level k; return False if no program could be solved."""
        if self.status is not Status.SOLVED:
            return False
        own = self._rows(k)
        equal = own.lower == own.upper
        equalities, inequalities = own.selected(equal), own.selected(~equal)
        root = np.sqrt(self.hierarchy.level(k).weight)
        met = self._decompose(k, equalities, row_scale(own.G, root))
        own_here = inequalities.seen_from(self.xi, self.Z, False)
        if not len(met.goal) and not len(own_here.lower):
            return True
        before = self.rows.seen_from(self.xi, self.Z, self.feasible)
        exact = least_norm_solution(self.solve, self.Z.T @ self.xi, met, before.joined(own_here))
        self.iterations += exact.iterations
        if exact.status is Status.SOLVED:
            self._advance(exact.x, met.free)
            self.rows, self.least = self.rows.joined(inequalities), True
            return True
        return self._in_least_squares(met, inequalities, own_here, before)

    def finish(self) -> None:
        """Minimise the norm over what is still free, unless ξ has the least norm already."""
        if self.least or not self.Z.shape[1] or self.status is not Status.SOLVED:
            return
        nothing = row_svd(np.empty((0, self.Z.shape[1])), np.empty(0), len)
        before = self.rows.seen_from(self.xi, self.Z, self.feasible)
        solution = least_norm_solution(self.solve, self.Z.T @ self.xi, nothing, before)
        self.iterations += solution.iterations
        if solution.status is Status.SOLVED:
            self._advance(solution.x, nothing.free)
        else:
            self._stop(solution.status)

    def _in_least_squares(self, met: RowSVD, inequalities: RowSet, own_here: RowSet, before: RowSet) -> bool:
        """Resolve a level that cannot be met, and fix its residuals and the rows that hold it back."""
        found = least_violation(self.solve, met, own_here, before)
        self.iterations += found.iterations
        if found.status is not Status.SOLVED:
            self._stop(found.status)
            return False
        self.converged &= found.complete
        self.hidden |= met.shortest < INVISIBLE_ROW  # squares of residuals beside those of the longest row
        xi = self.xi + self.Z @ found.z
        value = inequalities.G @ xi
        gap = excess(value, inequalities.lower, inequalities.upper)
        terms = np.abs(inequalities.G * xi).max(axis=1, initial=0.0)
        violated = gap > LEVEL_VIOLATION * np.maximum(1.0, terms)
        multiplier = np.abs(found.multipliers[: len(before.lower)])
        active = multiplier > max(LEVEL_MULTIPLIER * float(multiplier.max(initial=0.0)), LEVEL_VIOLATION)
        moving = violated & np.isin(inequalities.index, own_here.index)  # a redundant row freezes nothing
        free = free_directions(met, inequalities.selected(moving).G @ self.Z, before.selected(active).G)
        self._advance(found.z, free)
        self.rows, self.least = self.rows.joined(inequalities.selected(~violated)), False
        return True

    def _advance(self, z: Array, free: Array) -> None:
        """Move ξ by Z z, and keep those directions of Z that are still free."""
        self.xi = self.xi + self.Z @ z
        self.Z = self.Z @ free
        self.feasible = True

    def _stop(self, status: Status) -> None:
        """Note a status other than SOLVED; if ξ is inside the limits, the status is ITERATION_LIMIT."""
        self.status = Status.ITERATION_LIMIT if self.feasible else status

    def _decompose(self, k: int, equalities: RowSet, scale: float) -> RowSVD:
        """Decompose the equality rows of level k on z, and record the rank that is decided."""
        M = equalities.G @ self.Z

        def rank(sigma: Array) -> int:
            """Apply the rank rule and record the account of this level."""
            account = self.rule.account(k, len(M), M.shape[1], sigma, scale, self.previous_ranks)
            self.accounts.append(account)
            if account.lost:
                self.hidden |= hides_short_rows(equalities.G, M, account.rank, self.rule.lost)
            return account.rank

        decided = row_svd(M, equalities.upper - equalities.G @ self.xi, rank)
        return replace(decided, shortest=shortest_row(equalities.G))

    def _eliminate(self, fixed: RowSet) -> None:
        """Satisfy the hard equalities, which contradict each other if a residual remains."""
        if not len(fixed.lower):
            self.accounts.append(LevelAccount(0, 0, self.Z.shape[1], 0, np.inf, 0.0))
            return
        decided = self._decompose(0, fixed, row_scale(fixed.G, np.ones(1)))
        self.xi, self.Z = decided.solution, decided.free
        left = fixed.G @ self.xi - fixed.upper
        inside = not self.Z.shape[1] and self.rows.contain(self.xi)
        if np.abs(left).max() > LEVEL_VIOLATION * max(1.0, float(np.abs(fixed.upper).max())):
            self.status = Status.INFEASIBLE
        elif not self.Z.shape[1]:
            self.feasible, self.least = inside, True
            self.status = Status.SOLVED if inside else Status.INFEASIBLE

    def _rows(self, k: int) -> RowSet:
        """Return the rows of level k on ξ, scaled by √w; level 0 is the box and the hard rows."""
        hierarchy, level = self.hierarchy, self.hierarchy.level(k)
        index = hierarchy.n + int(hierarchy.layout.offsets[k]) + np.arange(len(level.lower))
        if k:
            root = np.sqrt(level.weight)
            G = (root[:, None] * level.A) @ self.inverse
            return RowSet(G, root * level.lower, root * level.upper, index)
        box = RowSet(self.inverse, hierarchy.box_lower, hierarchy.box_upper, np.arange(hierarchy.n))
        rows = box.joined(RowSet(level.A @ self.inverse, level.lower, level.upper, index))
        return rows.selected((rows.lower > -np.inf) | (rows.upper < np.inf))
