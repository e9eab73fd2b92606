"""`hqp/<solver>`: one quadratic program a level, in the null space of the levels before.

A level is first asked for exactly, as equality rows with the least norm; that keeps a raw answer
accurate where normal equations would square the condition number. Where limits forbid it, the level
is solved in least squares, its residuals are frozen, and the rows that hold it back are frozen with
them. Kanoun, Lamiraux and Wieber (2011), IEEE Trans. Robotics 27(4).
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, RankRule, inverse_root, row_scale
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.base import Memory, answered, checked, final_state
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.level_qp import (
    PRICED,
    VIOLATED,
    Rows,
    Split,
    frozen,
    least_norm,
    least_violation,
    split,
)
from taskopt.resolver.solver_accuracy import checked_accuracy, solve_to
from taskopt.solver.registry import solver


@dataclass(frozen=True)
class HierarchicalQP:
    """Strict priorities with any solver. A program that fails leaves its level, and those below, unserved.

    `accuracy`: wanted in x, relative to its largest entry; the tolerances of the solver follow from it.
    `rule` decides the ranks, which are its memory. Status INFEASIBLE, with x = NaN, where the hard
    limits leave nothing (see `unanswered`); ITERATION_LIMIT where a program failed though an x inside
    the limits was known: it keeps them and the levels before.
    """

    solver: str
    accuracy: float = ACCURACY
    rule: RankRule = RULE

    def __post_init__(self) -> None:
        checked_accuracy(self.accuracy)

    @property
    def name(self) -> str:
        return f"hqp/{self.solver}"

    @property
    def strict(self) -> bool:
        return True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        known = checked(memory, hierarchy.layout)
        before = known.ranks if known else ()
        descent = _Descent(hierarchy, self, before)
        for k in range(1, hierarchy.layout.level_count + 1):
            if not descent.level(k):
                break
        else:
            descent.finish()
        if not descent.feasible:
            return no_answer(hierarchy, descent.status, descent.iterations)
        x = descent.inverse @ descent.xi
        y = find_multipliers(hierarchy, x)
        state, levels = final_state(hierarchy, x, y), tuple(descent.accounts)
        done = descent.status, descent.iterations
        return refuse_broken_claim(answered(hierarchy, x, y, state, *done, self.accuracy, levels))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return task_priority(hierarchy)


class _Descent:
    """Down the levels: ξ, the free directions Z, and the rows that still bind."""

    def __init__(self, hierarchy: Hierarchy, asked: HierarchicalQP, before: tuple[int, ...]) -> None:
        self.hierarchy = hierarchy
        self.solve = solve_to(solver(asked.solver), asked.accuracy)
        self.rule, self.before = asked.rule, before
        self.accounts: list[LevelAccount] = []
        self.inverse = inverse_root(hierarchy.norm)
        self.xi, self.Z = np.zeros(hierarchy.n), np.eye(hierarchy.n)
        self.status, self.iterations = Status.SOLVED, 0
        self.feasible = False  # whether ξ is known to keep the limits
        self.least = False  # whether ξ has the least norm inside the levels so far
        limits = self._rows(0)
        equal = limits.lower == limits.upper
        self.rows = limits.kept(~equal)
        self._hold(limits.kept(equal))
        if self.status is Status.SOLVED:  # x = 0 keeps the limits of most robots
            self.feasible |= not equal.any() and self.rows.contain(self.xi, 0.0)

    def level(self, k: int) -> bool:
        """Resolve level k; False where no program could be solved."""
        if self.status is not Status.SOLVED:
            return False
        own = self._rows(k)
        equal = own.lower == own.upper
        target, wanted = own.kept(equal), own.kept(~equal)
        root = np.sqrt(self.hierarchy.level(k).weight)
        met = self._split(k, target, row_scale(own.G, root))
        wanted_here = wanted.seen_from(self.xi, self.Z, False)
        if not len(met.goal) and not len(wanted_here.lower):
            return True
        binding = self.rows.seen_from(self.xi, self.Z, self.feasible)
        exact = least_norm(self.solve, self.Z.T @ self.xi, met, binding.joined(wanted_here))
        self.iterations += exact.iterations
        if exact.status is Status.SOLVED:
            self._advance(exact.x, met.free)
            self.rows, self.least = self.rows.joined(wanted), True
            return True
        return self._compromise(met, wanted, wanted_here, binding)

    def finish(self) -> None:
        """The least norm of what is still free, where no level has settled it."""
        if self.least or not self.Z.shape[1] or self.status is not Status.SOLVED:
            return
        nothing = split(np.empty((0, self.Z.shape[1])), np.empty(0), len)
        binding = self.rows.seen_from(self.xi, self.Z, self.feasible)
        solution = least_norm(self.solve, self.Z.T @ self.xi, nothing, binding)
        self.iterations += solution.iterations
        if solution.status is Status.SOLVED:
            self._advance(solution.x, nothing.free)
        else:
            self._stop(solution.status)

    def _compromise(self, met: Split, wanted: Rows, wanted_here: Rows, binding: Rows) -> bool:
        """Least squares of a level that limits or its own rows forbid; freezes what must hold below."""
        found = least_violation(self.solve, met, wanted_here, binding)
        self.iterations += found.iterations
        if found.status is not Status.SOLVED:
            self._stop(found.status)
            return False
        xi = self.xi + self.Z @ found.z
        value = wanted.G @ xi
        gap = np.maximum(wanted.lower - value, value - wanted.upper)
        violated = gap > VIOLATED * np.maximum(1.0, np.abs(wanted.G * xi).max(axis=1, initial=0.0))
        price = np.abs(found.multipliers[: len(binding.lower)])
        priced = price > max(PRICED * float(price.max(initial=0.0)), VIOLATED)
        moving = violated & np.isin(wanted.index, wanted_here.index)  # a dead row has no direction to freeze
        free = frozen(met, wanted.kept(moving).G @ self.Z, binding.kept(priced).G)
        self._advance(found.z, free)
        self.rows, self.least = self.rows.joined(wanted.kept(~violated)), False
        return True

    def _advance(self, z: Array, free: Array) -> None:
        self.xi = self.xi + self.Z @ z
        self.Z = self.Z @ free
        self.feasible = True

    def _stop(self, status: Status) -> None:
        self.status = Status.ITERATION_LIMIT if self.feasible else status

    def _split(self, k: int, target: Rows, scale: float) -> Split:
        """The equality rows of level k seen from ξ; what is decided of their rank goes into the accounts."""
        M = target.G @ self.Z

        def rank(sigma: Array) -> int:
            self.accounts.append(self.rule.account(k, len(M), M.shape[1], sigma, scale, self.before))
            return self.accounts[-1].rank

        return split(M, target.upper - target.G @ self.xi, rank)

    def _hold(self, fixed: Rows) -> None:
        """Eliminate the hard equalities; they contradict each other if a residual is left."""
        if not len(fixed.lower):
            self.accounts.append(LevelAccount(0, 0, self.Z.shape[1], 0, np.inf, 0.0))
            return
        held = self._split(0, fixed, row_scale(fixed.G, np.ones(1)))
        self.xi, self.Z = held.decided @ held.goal, held.free
        left = fixed.G @ self.xi - fixed.upper
        inside = not self.Z.shape[1] and self.rows.contain(self.xi)
        if np.abs(left).max() > VIOLATED * max(1.0, float(np.abs(fixed.upper).max())):
            self.status = Status.INFEASIBLE
        elif not self.Z.shape[1]:
            self.feasible, self.least = inside, True
            self.status = Status.SOLVED if inside else Status.INFEASIBLE

    def _rows(self, k: int) -> Rows:
        """Rows of level k on ξ, scaled by √w; level 0 is the hard rows with the box before them."""
        hierarchy, level = self.hierarchy, self.hierarchy.level(k)
        index = hierarchy.n + int(hierarchy.layout.offsets[k]) + np.arange(len(level.lower))
        if k:
            root = np.sqrt(level.weight)
            return Rows(
                (root[:, None] * level.A) @ self.inverse, root * level.lower, root * level.upper, index
            )
        box = Rows(self.inverse, hierarchy.box_lower, hierarchy.box_upper, np.arange(hierarchy.n))
        rows = box.joined(Rows(level.A @ self.inverse, level.lower, level.upper, index))
        return rows.kept((rows.lower > -np.inf) | (rows.upper < np.inf))
