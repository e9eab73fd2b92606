"""`hqp/<solver>`, a cascade of quadratic programs, one for each level, in the null space of those before.

A level is first stated as equality rows, with the least norm as cost. If limits or its own rows make that
infeasible, it is solved in least squares. Its residuals, and the rows that hold it back, are then fixed for
the levels below.

Source: Kanoun, Lamiraux and Wieber (2011), IEEE Trans. Robotics 27(4).
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, inverse_root, row_scale
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import (
    ACCURACY,
    COUNTED_MULTIPLIER,
    INVISIBLE_ROW,
    LEVEL_MULTIPLIER,
    LEVEL_VIOLATION,
)
from taskopt.resolver.base import Memory, answered_by_x, checked
from taskopt.resolver.cascade_kernels import (
    IDLE,
    IRREGULAR,
    OPEN,
    exact_level,
    level_rows,
    limit_rows,
    move_on,
)
from taskopt.resolver.cascade_memory import CascadeMemory, give_back, take_memory
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.descent import scaling_of
from taskopt.resolver.descent_kernels import scale_back
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
from taskopt.resolver.solver_accuracy import SolverTo, checked_accuracy
from taskopt.solver.registry import solver

_SOLVED = Status.SOLVED  # looking it up in the Enum costs as much as a short call


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
            The answer, and a memory with its ranks; no row is active in it.

        Raises:
            InvalidValue: The memory belongs to a hierarchy of another layout.
            UnknownName: There is no solver of that name.
            NotInstalled: The package of the solver cannot be imported.
        """
        layout = hierarchy.layout
        memory = checked(memory, layout)
        arrays = take_memory(layout)
        cascade = _Cascade(hierarchy, self, memory.ranks if memory else (), arrays)
        for k in range(1, layout.level_count + 1):
            if not cascade.level(k):
                break
        else:
            cascade.finish()
        if not cascade.feasible:
            return no_answer(hierarchy, cascade.status, cascade.iterations)
        x, levels = np.empty(hierarchy.n), partial(_accounts, cascade.accounts)
        scale_back(cascade.xi, cascade.scaling, x)
        give_back(arrays)
        claim = cascade.claim, cascade.iterations
        answer = answered_by_x(hierarchy, x, *claim, self.accuracy, levels, COUNTED_MULTIPLIER)
        ranks = tuple([level.rank for level in cascade.accounts])
        return refuse_broken_claim((answer, Memory(np.zeros(layout.width, np.int8), ranks)))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return task_priority(hierarchy)


class _Cascade:
    """The state between levels: ξ so far, a basis Z of the free directions, and the inequality rows.

    Rows are on ξ = L x with W = Lᵀ L and scaled by √w.
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        resolver: HierarchicalQP,
        ranks: tuple[int, ...],
        memory: CascadeMemory,
    ) -> None:
        self.hierarchy, self.memory = hierarchy, memory
        engine = solver(resolver.solver)
        self.solve = SolverTo(engine, resolver.accuracy, engine.most_iterations, refine=engine.promises)
        self.rule, self.previous_ranks = resolver.rule, ranks
        self.accounts: list[LevelAccount | _Later] = []
        layout = hierarchy.layout
        n = hierarchy.n
        self.scaling = scaling_of(hierarchy.norm)
        self.problem = hierarchy.buffer, self.scaling, layout.offsets
        self.status, self.iterations = Status.SOLVED, 0
        self.converged = True  # whether the proximal steps of all levels so far did
        self.hidden = False  # whether a row was given up because it is short beside others of its level
        self.least = False  # whether ξ has the least norm inside the levels so far
        self.place, self.kept, self.free = memory.place, memory.kept, n
        # x = 0 keeps the limits of most robots; `feasible` says whether ξ is known to keep them.
        self.count, equalities, self.feasible = limit_rows(self.problem, self.place, self.kept)
        if equalities:
            self.feasible = False
            limits = self._limits()
            self._eliminate(limits.selected(limits.lower == limits.upper))
        else:
            self.accounts.append(LevelAccount(0, 0, n, 0, np.inf, 0.0))

    @property
    def xi(self) -> Array:
        """The answer ξ so far, (n,), as a view."""
        return self.place[-1]

    @property
    def rows(self) -> RowSet:
        """The inequality rows that must hold, as views."""
        return self._kept(0, self.count)

    @rows.setter
    def rows(self, rows: RowSet) -> None:
        """Replace the inequality rows that must hold."""
        G, bounds, index = self.kept
        self.count = count = len(rows.lower)
        G[:count], bounds[0, :count], bounds[1, :count], index[:count] = (
            rows.G,
            rows.lower,
            rows.upper,
            rows.index,
        )

    def _kept(self, start: int, stop: int) -> RowSet:
        """Return inequality rows as views."""
        G, (lower, upper), index = self.kept
        return RowSet(G[start:stop], lower[start:stop], upper[start:stop], index[start:stop])

    @property
    def claim(self) -> Status:
        """The status of the answer; not claimed without convergence, or where long rows hide a short one."""
        return self.status if self.converged and not self.hidden else Status.ITERATION_LIMIT

    @property
    def Z(self) -> Array:
        """Basis of the free directions in its columns, (n, p)."""
        return self.place[: self.free].T

    def level(self, k: int) -> bool:
        """Resolve level k; return False if no program could be solved."""
        if self.status is not _SOLVED:
            return False
        tried = self._exactly(k)
        if tried is _SOLVED:
            return True
        equalities, inequalities, scale = self._level_rows(k)
        met = self._decompose(k, equalities, scale)
        own_here = inequalities.seen_from(self.xi, self.Z, False)
        if not len(met.goal) and not len(own_here.lower):
            return True
        before = self.rows.seen_from(self.xi, self.Z, self.feasible)
        if tried is not Status.INFEASIBLE:
            exact = least_norm_solution(self.solve, self.Z.T @ self.xi, met, before.joined(own_here))
            self.iterations += exact.iterations
            if exact.status is Status.SOLVED:
                self._advance(exact.x, met.free)
                self.rows, self.least = self.rows.joined(inequalities), True
                return True
        return self._in_least_squares(met, inequalities, own_here, before)

    def _exactly(self, k: int) -> Status | None:
        """Meet level k exactly, if its rank is certain without singular values.

        Returns:
            SOLVED if it is met, else the claim of the solver; None if the rank is not certain.
        """
        p, stage = self.free, self.memory.stage(k, self.free)
        unit, M, Q = stage
        level = k, self.rule.regained, self.count, self.feasible
        code, (e, own, r, count), (scale, size, least) = exact_level(
            self.problem, level, self.place, self.kept, M, Q, unit.arrays, unit.written
        )
        if code == IRREGULAR:
            return None
        if code == OPEN:
            unit.set(count, size, least)
            exact = self.solve.at_unit_size(unit)
            self.iterations += exact.iterations
            if exact.status is not _SOLVED:
                return exact.status
            move_on(exact.x, Q, r, self.place)
        if code != IDLE:
            self.free, self.count, self.feasible, self.least = p - r, self.count + own, True, True
        self.accounts.append(_Later(k, M[:e].copy(), scale, r))
        return _SOLVED

    def _level_rows(self, k: int) -> tuple[RowSet, RowSet, float]:
        """Return equalities and inequalities of level k, multiplied by √w, and the size of its rows."""
        m, n = self.hierarchy.layout.level_sizes[k], self.hierarchy.n
        equal, goal = np.empty((m, n)), np.empty(m)
        e, own, scale = level_rows(self.problem, k, equal, goal, self.kept, self.count)
        equalities = RowSet(equal[:e], goal[:e], goal[:e], np.empty(0, np.int64))
        added = self._kept(self.count, self.count + own)
        return equalities, added.selected(np.ones(own, dtype=bool)), scale

    def finish(self) -> None:
        """Minimise the norm over what is still free, unless ξ has the least norm already."""
        if self.least or not self.free or self.status is not Status.SOLVED:
            return
        nothing = row_svd(np.empty((0, self.free)), np.empty(0), len)
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
        kept = free.T @ self.Z.T
        self.place[-1] += self.Z @ z
        self.free = len(kept)
        self.place[: self.free] = kept
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
        decided = self._decompose(0, fixed, row_scale(fixed.G, np.ones(1)))
        self._advance(decided.solution, decided.free)
        left = fixed.G @ self.xi - fixed.upper
        inside = not self.free and self.rows.contain(self.xi)
        self.feasible = False
        if np.abs(left).max() > LEVEL_VIOLATION * max(1.0, float(np.abs(fixed.upper).max())):
            self.status = Status.INFEASIBLE
        elif not self.free:
            self.feasible, self.least = inside, True
            self.status = Status.SOLVED if inside else Status.INFEASIBLE

    def _limits(self) -> RowSet:
        """Return the box and the hard rows on ξ, as far as they have a bound."""
        hierarchy, level, inverse = self.hierarchy, self.hierarchy.limits, inverse_root(self.hierarchy.norm)
        index = np.arange(hierarchy.n + len(level.lower))
        box = RowSet(inverse, hierarchy.box_lower, hierarchy.box_upper, index[: hierarchy.n])
        rows = box.joined(RowSet(level.A @ inverse, level.lower, level.upper, index[hierarchy.n :]))
        return rows.selected((rows.lower > -np.inf) | (rows.upper < np.inf))


@dataclass(frozen=True, eq=False)
class _Later:
    """Rank of a level whose singular values are found when its account is asked for.

    Attributes:
        level: The level.
        M: (m, p) its equality rows in the directions that the levels before left free.
        scale: Size of its rows.
        rank: Its rank, which is full.
    """

    level: int
    M: Array
    scale: float
    rank: int

    def account(self) -> LevelAccount:
        """Return the account."""
        sigma = np.linalg.svd(self.M, compute_uv=False) if self.M.size else np.zeros(0)
        kept = float(sigma[-1]) / self.scale if self.rank else np.inf
        rows, free = self.M.shape
        return LevelAccount(self.level, rows, free, self.rank, kept, 0.0)


def _accounts(found: list[LevelAccount | _Later], _: Hierarchy) -> tuple[LevelAccount, ...]:
    """Return the accounts of all levels."""
    return tuple(each.account() if isinstance(each, _Later) else each for each in found)
