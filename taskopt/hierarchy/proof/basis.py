"""Choice of independent rows among those that are held, and the inverse of the matrix that they form."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, Mask
from taskopt.hierarchy.proof.coupling import coupled
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.proof.exact_span import ExactSpan
from taskopt.hierarchy.proof.linear import inverse
from taskopt.hierarchy.proof.scaled import Scaled
from taskopt.hierarchy.tolerances import DEPENDENCE_TESTED, REGAINED
from taskopt.jit import kernel


@dataclass(eq=False)
class Basis:
    """Held rows: independent ones in the order of their levels, and those that depend on them.

    Attributes:
        rows: Independent rows.
        ends: Number of independent rows of the hard level, of levels 0 and 1, 0 to 2, …, (levels + 1,).
        dependent: For each level its rows that depend on the independent rows up to that level.
        made_of: For those tested in integers, the independent rows whose coefficients are not zero.
        doubtful: Rows that are independent, but only by rounding.
        contradictory: Hard rows that depend on others with another right-hand side.
        tangled: Hard rows that take part in any dependence.
        directions: Orthonormal directions of the independent rows in the metric of the norm, (n + 1, n), of
            which the first r are in use.
    """

    directions: Array
    rows: list[int] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    dependent: list[list[int]] = field(default_factory=list)
    made_of: dict[int, list[int]] = field(default_factory=dict)
    doubtful: list[int] = field(default_factory=list)
    contradictory: list[int] = field(default_factory=list)
    tangled: set[int] = field(default_factory=set)


def choose_basis(problem: Scaled, held: Mask, bound: Array, *, assume: bool) -> Basis:
    """Choose independent rows level by level, those first that pull most.

    Only the choice is made in rounded numbers. A row that nearly depends on the others is tested in integers.

    Args:
        problem: The problem.
        held: True for rows that are held at a bound, (n + M,).
        bound: The bound of each, (n + M,).
        assume: True to take rows as dependent that are independent by rounding only.

    Returns:
        The basis.
    """
    return _Choice(problem, bound, assume).of(held)


class _Choice:
    """The state of one choice of independent rows."""

    def __init__(self, problem: Scaled, bound: Array, assume: bool) -> None:
        self.problem, self.bound, self.assume = problem, bound, assume
        self.basis, self.rest = Basis(np.zeros((problem.n + 1, problem.n))), problem.directions.copy()
        self.length = np.linalg.norm(self.rest, axis=1)
        self.first = (problem.level == 0) & problem.equality
        self._span: ExactSpan | None = None

    def of(self, held: Mask) -> Basis:
        """Go through the levels in order."""
        problem = self.problem
        for k in range(problem.levels + 1):
            waiting = held & (problem.level == k) & ~problem.zero
            self.basis.dependent.append([])
            for _ in range(int(waiting.sum())):
                i = next_row(self.length, problem.pull, self.first, waiting)
                waiting[i] = False
                self._place(i, k)
            self.basis.ends.append(len(self.basis.rows))
        return self.basis

    def _place(self, i: int, k: int) -> None:
        """Put a row among the independent or among the dependent ones."""
        basis, rest = self.basis, float(self.length[i])
        full = len(basis.rows) == self.problem.n
        if rest > DEPENDENCE_TESTED and not full:
            self._take(i)
        elif full and k > 0:
            basis.dependent[k].append(i)
        else:
            self._test(i, k, rest)

    def _test(self, i: int, k: int, rest: float) -> None:
        """Decide the dependence of a row in integers."""
        basis, problem = self.basis, self.problem
        depends, agrees, others = self.span.dependence(i, problem.A[i], self.bound[i])
        if not depends:
            if rest <= REGAINED:
                basis.doubtful.append(i)
                if self.assume:
                    basis.dependent[k].append(i)
                    return
            self._take(i)
            return
        basis.dependent[k].append(i)
        basis.made_of[i] = others
        if k == 0:
            basis.tangled |= {i, *others}
            if not agrees:
                basis.contradictory.append(i)

    @property
    def span(self) -> ExactSpan:
        """The exact span of the independent rows, made when it is first needed."""
        if self._span is None:
            self._span = ExactSpan()
            for i in self.basis.rows:
                self._span.add(i, self.problem.A[i], self.bound[i])
        return self._span

    def _take(self, i: int) -> None:
        """Make a row independent."""
        if self._span is not None:
            self._span.add(i, self.problem.A[i], self.bound[i])
        take_direction(self.rest, self.length, self.basis.directions, len(self.basis.rows), i)
        self.basis.rows.append(i)


@kernel
def next_row(length: Array, pull: Array, first: Mask, waiting: Mask) -> int:
    """Choose the row that adds most: an equality of the hard rows first, nearly dependent rows last.

    Args:
        length: What each row has outside the span of the independent ones, relative to its length, (N,).
        pull: Weight of each row times the square of its length, (N,).
        first: True for equalities of the hard rows, (N,).
        waiting: True for the rows to choose from, of which there is one, (N,).

    Returns:
        The index of the row.
    """
    best, most = -1, (False, False, 0.0)
    for i in range(length.size):
        if waiting[i]:
            score = length[i] > DEPENDENCE_TESTED, first[i], length[i] * length[i] * pull[i]
            if best < 0 or score >= most:
                best, most = i, score
    return best


@kernel
def take_direction(rest: Array, length: Array, directions: Array, count: int, i: int) -> None:
    """Add the direction of a row to the orthonormal ones, and subtract it from all rows.

    It is made orthogonal to the others twice, against rounding.

    Args:
        rest: The parts of the rows outside the span of the directions, (N, n).
        length: Their lengths, (N,).
        directions: Orthonormal directions in its first `count` rows; receives one more.
        count: Number of directions so far.
        i: The row.
    """
    direction = directions[count]
    direction[:] = rest[i]
    for _ in range(2):
        for other in range(count):
            direction -= (directions[other] @ direction) * directions[other]
        size = np.sqrt(direction @ direction)
        if size > 0.0:  # rounding may leave nothing of a doubtful row
            direction /= size
    for a in range(length.size):
        rest[a] -= (rest[a] @ direction) * direction
        length[a] = np.sqrt(rest[a] @ rest[a])


def inverse_of(problem: Scaled, basis: Basis) -> Enclosure | None:
    """Enclose the inverse of the independent rows, completed by directions that the norm keeps apart.

    Args:
        problem: The problem.
        basis: The independent rows.

    Returns:
        V (n, n) with B V = (I, 0) for the independent rows B; None where rounding hides whether they are
        independent.
    """
    r, n = len(basis.rows), problem.n
    completion = np.zeros((0, n))
    if r < n:
        taken = basis.directions[:r].T
        completion = np.linalg.qr(taken, mode="complete")[0][:, r:].T @ problem.root.T
    B = problem.A[basis.rows]
    V = inverse(np.vstack([B, completion]))
    if V is None:
        return None
    if r == n:
        V.parts[:] *= coupled(B, np.eye(n))  # its rows are the unit vectors, made of rows of B
    for j, a in fixed_unknowns(B):
        V.parts[:, j] = 0.0
        V.parts[0, j, a] = 1.0 / B[a, j]
    return V


def fixed_unknowns(B: Array) -> list[tuple[int, int]]:
    """Return unknowns that a row fixes exactly, since it has one entry, which is a power of two.

    Args:
        B: Independent rows, (r, n).

    Returns:
        Pairs of an unknown and the row that fixes it.
    """
    single = np.flatnonzero((B != 0.0).sum(axis=1) == 1)
    pairs = [(int(np.argmax(np.abs(B[a]))), int(a)) for a in single]
    return [(j, a) for j, a in pairs if abs(np.frexp(B[a, j])[0]) == 0.5]
