"""The solution that a working set defines, enclosed, and what it proves about the rows.

A working set holds some rows at a bound each. Its solution minimises the levels in order with these rows as
equalities and without the others. `docs/certificate.md` has the equations.
"""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.hierarchy.proof.basis import Basis, choose_basis, fixed_unknowns, inverse_of
from taskopt.hierarchy.proof.coupling import coupled
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.proof.linear import solve
from taskopt.hierarchy.proof.scaled import Scaled
from taskopt.hierarchy.tolerances import SEARCH_AGREE

Pair = tuple[int, int]  # a row (box first) and a side of it, −1 or 1


@dataclass(frozen=True, eq=False)
class Held:
    """The rows that a working set holds.

    Attributes:
        rows: True for rows that are held, (n + M,).
        side: −1 or 1 for the bound at which an inequality is held, 0 for equalities, (n + M,).
        bound: The bound at which a row is held, (n + M,).
    """

    rows: Mask
    side: IntArray
    bound: Array

    @staticmethod
    def of(problem: Scaled, state: StateArray) -> "Held":
        """Hold all equalities, and inequalities at the bounds that a state names.

        Args:
            problem: The problem.
            state: −1, 0 or 1 for each bound of the box and for each row, (n + M,).

        Returns:
            The rows.
        """
        side = np.where(problem.equality, 0, state).astype(np.int64)
        bound = np.where(side < 0, problem.lower, problem.upper)
        rows = (problem.equality | (side != 0)) & np.isfinite(bound) & ~problem.zero
        return Held(rows, np.where(rows, side, 0), bound)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What is known about the solution of one working set.

    Attributes:
        x: The solution, (n, 1); None if there is none, or if rounding hides it.
        wrong: Pairs that contradict the optimum: violated and not held, or held and pulling the wrong way.
        undecided: Pairs about which rounding hides this.
        tangled: Hard inequalities that take part in a contradiction; empty if there is none.
        unclear: Rows whose rank rounding hides.
        assumed: Rows that were taken as dependent although they are independent, by rounding only.
        doubtful: Rows that are independent by rounding only.
    """

    x: Enclosure | None = None
    wrong: frozenset[Pair] = frozenset()
    undecided: frozenset[Pair] = frozenset()
    tangled: frozenset[Pair] = frozenset()
    unclear: tuple[int, ...] = ()
    assumed: tuple[int, ...] = ()
    doubtful: tuple[int, ...] = ()


def outcome_of(problem: Scaled, state: StateArray, *, assume: bool = False) -> Outcome:
    """Enclose the solution of a working set, and judge all rows by it.

    Args:
        problem: The problem.
        state: −1, 0 or 1 for each bound of the box and for each row, (n + M,).
        assume: True to take rows as dependent that are independent by rounding only.

    Returns:
        The outcome.
    """
    held = Held.of(problem, state)
    basis = choose_basis(problem, held.rows, held.bound, assume=assume)
    doubtful = tuple(basis.doubtful)
    if basis.contradictory:
        tangled = frozenset((i, int(held.side[i])) for i in basis.tangled if held.side[i])
        wrong = frozenset((i, int(held.side[i])) for i in basis.contradictory)
        return Outcome(wrong=wrong, tangled=tangled, doubtful=doubtful)
    V = inverse_of(problem, basis)
    if V is None:
        return Outcome(unclear=doubtful or tuple(basis.rows[-1:]), doubtful=doubtful)
    solution = _Solution(problem, held, basis, V)
    hidden = solution.find()
    if hidden:
        return Outcome(unclear=hidden, doubtful=doubtful)
    wrong, undecided = _Signs(solution).judged()
    x = solution.z.scaled(problem.column[:, None])
    assumed = doubtful if assume else ()
    return Outcome(x, frozenset(wrong), frozenset(undecided), frozenset(), (), assumed, doubtful)


@dataclass(eq=False)
class _Solution:
    """The solution of a working set and its multipliers, level by level.

    Attributes:
        t: Values of the independent rows, (r, 1).
        z: The unknowns, (n, 1).
        residual: A z − bound of the rows of levels that keep a residual.
        multipliers: Multipliers of the independent rows before a level, for levels that pull, the norm last.
    """

    problem: Scaled
    held: Held
    basis: Basis
    V: Enclosure
    t: Enclosure = field(init=False)
    z: Enclosure = field(init=False)
    residual: dict[int, Enclosure] = field(default_factory=dict)
    multipliers: list[Enclosure] = field(default_factory=list)

    def find(self) -> tuple[int, ...]:
        """Compute everything; return the rows whose weights or ranks rounding hides."""
        self.t = Enclosure.exact(self.held.bound[self.basis.rows])
        for k in range(self.problem.levels + 1):
            hidden = self._level(k) if self.basis.dependent[k] else ()
            if hidden:
                return hidden
        return self._norm()

    def _level(self, k: int) -> tuple[int, ...]:
        """Solve a level some of whose rows depend on others."""
        basis, problem, bound = self.basis, self.problem, self.held.bound
        start, end = (basis.ends[k - 1] if k else 0), basis.ends[k]
        rows, own = basis.dependent[k], basis.rows[start:end]
        C = problem.A[rows] @ self.V.columns(slice(0, end))
        C = Enclosure(C.parts * self._coupled(rows)[:, :end])
        target = bound[rows][:, None]
        if k > 0 and own:
            bound_part = C.columns(slice(0, start)) @ self.t.rows(slice(0, start)) - target
            values = self._least_squares(C.columns(slice(start, end)), bound_part, own, rows)
            if values is None:
                return tuple(rows)
            self.t.parts[:, start:end] = values.parts
        rest = C @ self.t.rows(slice(0, end)) - target
        if k == 0:
            # What exact elimination found to depend agrees exactly; what is assumed to depend agrees nearly.
            return tuple(i for i, off in zip(rows, rest.size[:, 0], strict=True) if off > SEARCH_AGREE)
        own_rest = self.t.rows(slice(start, end)) - bound[own][:, None]
        for i, one in zip([*rows, *own], [*_single_rows(rest), *_single_rows(own_rest)], strict=True):
            self.residual[i] = one
        pull = rest * problem.weight[rows][:, None]
        self.multipliers.append(-(C.columns(slice(0, start)).T @ pull))
        return ()

    def _coupled(self, rows: list[int]) -> Mask:
        """Return where coefficients of dependent rows may differ from zero; others are exactly zero."""
        basis, A = self.basis, self.problem.A
        possible = coupled(A[basis.rows], A[rows])
        for d, i in enumerate(rows):
            if i in basis.made_of:
                possible[d] = np.isin(basis.rows, basis.made_of[i])
        return possible

    def _least_squares(
        self, F: Enclosure, rest: Enclosure, own: list[int], rows: list[int]
    ) -> Enclosure | None:
        """Return the t that minimises ½ Σ w (t − b)² of own rows + ½ Σ w (F t + rest)² of dependent rows."""
        weight, other = self.problem.weight[own][:, None], self.problem.weight[rows][:, None]
        bound = self.held.bound[own][:, None]
        unit = np.exp2(-np.round(0.5 * np.log2(weight)))
        G = F * unit.T
        normal = G.T @ (G * other) + np.diag((weight * unit * unit)[:, 0])

        def slope(t: Enclosure) -> Enclosure:
            """Return the gradient by t in its unit."""
            return (t.scaled(unit) - bound) * (weight * unit) + G.T @ ((G @ t + rest) * other)

        found = solve(normal, slope, bound / unit)
        if found is None:
            return None
        values = found.scaled(unit)
        alone = ~(F.parts != 0.0).any(axis=(0, 1))  # nothing but its own bound decides such a row
        values.parts[:, alone] = Enclosure.exact(bound[alone]).parts
        return values

    def _norm(self) -> tuple[int, ...]:
        """Find the z of least norm with the values t, and the multipliers of the norm."""
        r, W = len(self.basis.rows), self.problem.W
        V, Z = self.V.columns(slice(0, r)), self.V.columns(slice(r, self.problem.n))
        z = V @ self.t

        def slope(s: Enclosure) -> Enclosure:
            """Return the gradient of ½ zᵀ W z in the free directions."""
            return Z.T @ (W @ (z + Z @ s))

        if r < self.problem.n:
            free = solve(Z.T @ (W @ Z), slope, np.zeros((self.problem.n - r, 1)))
            if free is None:
                return tuple(self.basis.rows[-1:])
            z = z + Z @ free
        B = self.problem.A[self.basis.rows]
        for j, a in fixed_unknowns(B):
            z.parts[:, j] = self.t.parts[:, a] / np.array([1.0, 1.0, np.sign(B[a, j])])[:, None] / B[a, j]
        self.z = z
        self.multipliers.append(-(V.T @ (W @ z)))
        return ()


class _Signs:
    """The judgement of all rows by a solution: those not held by their values, held ones by their signs."""

    def __init__(self, solution: _Solution) -> None:
        self.solution, self.held, self.problem = solution, solution.held, solution.problem
        self.wrong: list[Pair] = []
        self.undecided: list[Pair] = []

    def judged(self) -> tuple[list[Pair], list[Pair]]:
        """Return the wrong pairs, and the undecided ones."""
        for side in (-1, 1):
            self._values(side)
        place = {i: a for a, i in enumerate(self.solution.basis.rows)}
        for i in np.flatnonzero(self.held.side).tolist():
            self._signs(i, place.get(i))
        return self.wrong, self.undecided

    def _values(self, side: int) -> None:
        """Judge the bounds of one side that are not held: the value must certainly be within them."""
        problem, held = self.problem, self.held
        bound = problem.upper if side > 0 else problem.lower
        loose = np.isfinite(bound) & ~problem.equality & ~problem.zero & ~(held.rows & (held.side == side))
        rows = np.flatnonzero(loose)
        value = problem.A[rows] @ self.solution.z
        for a, j in problem.unit_rows(rows):
            value.parts[:, a] = self.solution.z.parts[:, j]
        over = value - bound[rows][:, None]
        outside = over.positive if side > 0 else over.negative
        inside = (over.negative if side > 0 else over.positive) | ~over.parts.any(axis=0)
        self.wrong += [(i, side) for i in rows[outside[:, 0]].tolist()]
        self.undecided += [(i, side) for i in rows[~outside[:, 0] & ~inside[:, 0]].tolist()]

    def _signs(self, i: int, place: int | None) -> None:
        """Judge a held inequality: the first of its residual and multipliers that is not zero decides."""
        solution, side = self.solution, int(self.held.side[i])
        entries = [solution.residual[i].parts[:, 0, 0]] if i in solution.residual else []
        if place is not None:
            entries += [y.parts[:, place, 0] for y in solution.multipliers if place < y.shape[0]]
        elif self.problem.level[i] == 0:
            return  # it depends on other hard rows, agrees with them, and needs no multiplier
        for entry in entries:
            if not entry.any():
                continue
            sure = abs(entry[0]) > 2.0 * entry[2] + abs(entry[1])
            if not sure:
                self.undecided.append((i, side))
            elif side * entry[0] < 0.0:
                self.wrong.append((i, side))
            return


def _single_rows(column: Enclosure) -> list[Enclosure]:
    """Return the numbers of a column one by one."""
    return [column.rows([a]) for a in range(column.shape[0])]
