"""Attempts to make the judge prove a wrong answer, and its bounds on answers that are wrong on purpose.

Exact answers are moved by 1e-9 … 1e-1; active sets get one side toggled and are solved again; multipliers are
planted (`taskopt.bench.planted`). Answers to larger problems, whose exact optimum is too expensive, are
compared with each other; the second one is judged with its unknowns in reverse order, so that the two bounds
come from different numbers.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from rich import box
from rich.table import Table

from taskopt.arrays import Array, StateArray
from taskopt.bench.exact import as_floats
from taskopt.bench.planted import planted
from taskopt.bench.proof import Court, exact_errors, is_broken, is_wrong
from taskopt.bench.scaled_problems import scaled_problem
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Judge, Judgement, judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import KKT_MET
from taskopt.resolver.registry import resolve

SIZES = tuple(10.0**-k for k in range(9, 0, -1))
_OF_ONE_PROBLEM = 8  # lies of each kind


@dataclass
class Lies:
    """Results of all attempts at the problems of one family.

    Attributes:
        family: Name of the family.
        moved: Answers that were moved.
        toggled: Active sets with a side toggled.
        planted: Wrong answers with planted multipliers.
        hidden: Those of them whose KKT residuals are as small as those of an optimum.
        proven: Wrong answers among all of these that are proven. There must be none.
        broken: Error bounds below the true error. There must be none.
        ratios: Error bound over true error, largest entries, of the moved answers that have a bound.
        unbounded: Moved answers without a finite bound.
        pairs: Pairs of answers with finite bounds to larger problems.
        apart: Pairs that differ by more than the sum of their bounds. There must be none.
        unpaired: Pairs one of which has no bound.
    """

    family: str
    moved: int = 0
    toggled: int = 0
    planted: int = 0
    hidden: int = 0
    proven: int = 0
    broken: int = 0
    ratios: list[float] = field(default_factory=list)
    unbounded: int = 0
    pairs: int = 0
    apart: int = 0
    unpaired: int = 0

    @property
    def clean(self) -> bool:
        """True if no lie was proven, no bound broken, and no two answers contradict each other."""
        return self.proven == self.broken == self.apart == 0


def try_lies(family: str, count: int, seed: int = 0) -> Iterator[Lies]:
    """Move answers to small problems, toggle sides of their active sets, and plant multipliers.

    Args:
        family: Name of the family.
        count: Least number of toggled sides, and of planted multipliers.
        seed: Another seed draws other problems and lies.

    Yields:
        The results so far, after each problem.
    """
    lies, index = Lies(family), 0
    while min(lies.toggled, lies.planted) < count:
        rng = np.random.default_rng([seed, index, *family.encode()])
        _, hierarchy = scaled_problem(family, (1 + seed) * 10**6 + index)
        trial = _Trial(lies, hierarchy)
        trial.move(rng)
        trial.toggle(rng)
        trial.plant(rng)
        index += 1
        yield lies


class _Trial:
    """All attempts at one problem.

    Args:
        lies: Results so far, which are added to.
        hierarchy: The problem.
    """

    def __init__(self, lies: Lies, hierarchy: Hierarchy) -> None:
        self._lies, self._hierarchy, self._court = lies, hierarchy, Court(hierarchy)
        self._credulous = Judge(hierarchy, search=False)  # else the search would leave the lie behind
        self._right, self._state = as_floats(self._court.exact), resolve(hierarchy).state

    def move(self, rng: np.random.Generator) -> None:
        """Move one entry of the exact answer by each size, and compare the bound with the error."""
        for size in SIZES:
            x = self._right.copy()
            x[int(rng.integers(len(x)))] += size * float(rng.choice([-1.0, 1.0]))
            most = float(self._count(x, self._court.judge(x, self._state)).max())
            self._lies.moved += 1
            self._lies.unbounded += not np.isfinite(most)
            if np.isfinite(most):
                self._lies.ratios.append(most / float(max(exact_errors(x, self._court.exact))))

    def toggle(self, rng: np.random.Generator) -> None:
        """Hold a bound that is not active, or drop one that is, and take the optimum of that."""
        lower, upper = self._hierarchy.bounds()
        sides = [(i, side) for i in np.flatnonzero(lower < upper) for side in (-1, 0, 1)]
        bound = {-1: lower, 0: np.zeros(len(lower)), 1: upper}
        possible = [(i, s) for i, s in sides if s != self._state[i] and np.isfinite(bound[s][i])]
        for place in rng.permutation(len(possible))[:_OF_ONE_PROBLEM].tolist():
            i, side = possible[place]
            state = self._state.copy()
            state[i] = side
            self._lies.toggled += 1
            x = held_optimum(self._hierarchy, state)
            self._count(x, self._credulous(x, state))

    def plant(self, rng: np.random.Generator) -> None:
        """Plant multipliers that hide a wrong answer."""
        for _ in range(_OF_ONE_PROBLEM):
            lie = planted(self._hierarchy, self._right, self._state, rng)
            self._lies.planted += 1
            self._lies.hidden += lie.residual <= KKT_MET
            self._count(lie.x, self._credulous(lie.x, lie.state))

    def _count(self, x: Array, judgement: Judgement) -> Array:
        """Note if a lie was believed, and return the error bound."""
        self._lies.proven += judgement.proven and is_wrong(x, self._court.exact)
        self._lies.broken += is_broken(judgement, x, self._court.exact)
        return judgement.error_bound


def held_optimum(hierarchy: Hierarchy, state: StateArray) -> Array:
    """Return the optimum of the hierarchy in which active rows are equalities and others have no bounds.

    Args:
        hierarchy: The problem.
        state: The active set, (n + M,).

    Returns:
        x, (n,); zeros if there is none.
    """
    held, n = hierarchy.copy(), hierarchy.n
    lower, upper = hierarchy.bounds()
    fixed = lower == upper
    value = np.where(fixed | (state > 0), upper, lower)
    active = fixed | (state != 0)
    low, high = np.where(active, value, -np.inf), np.where(active, value, np.inf)
    held.box_lower[:], held.lower[:] = low[:n], low[n:]
    held.box_upper[:], held.upper[:] = high[:n], high[n:]
    x = resolve(held).x
    return x if np.isfinite(x).all() else np.zeros(n)


def compare(lies: Lies, problems: int, names: tuple[str, str], seed: int = 0) -> Iterator[int]:
    """Compare the answers of two resolvers to problems of up to 40 unknowns.

    Args:
        lies: Results of the family, which are added to.
        problems: Number of problems.
        names: Names of the resolvers.
        seed: Another seed draws other problems.

    Yields:
        The index of each problem, after it.
    """
    for index in range(problems):
        _, hierarchy = scaled_problem(lies.family, seed * problems + index, most=40)
        first, second = (resolve(hierarchy, name) for name in names)
        one, other = _bound(hierarchy, first), _bound_in_reverse(hierarchy, second)
        if np.isfinite(one + other).all():
            lies.pairs += 1
            lies.apart += bool((np.abs(first.x - second.x) > one + other).any())
        else:
            lies.unpaired += 1
        yield index


def _bound(hierarchy: Hierarchy, found: Resolution) -> Array:
    """Return the error bound of an answer, (n,); inf without an answer."""
    return _judged(hierarchy, found.x, found.state).error_bound


def _bound_in_reverse(hierarchy: Hierarchy, found: Resolution) -> Array:
    """Return the error bound of an answer, judged with the unknowns in reverse order, (n,)."""
    n, hard = hierarchy.n, hierarchy.limits
    levels = [Level(a.A[:, ::-1], lower=a.lower, upper=a.upper, weight=a.weight) for a in hierarchy.levels]
    limits = Level(hard.A[:, ::-1], lower=hard.lower, upper=hard.upper) if len(hard.A) else None
    box_of = hierarchy.box_lower[::-1], hierarchy.box_upper[::-1]
    turned = Hierarchy(levels, box_of, limits, hierarchy.norm_matrix()[::-1, ::-1])
    state = np.concatenate([found.state[:n][::-1], found.state[n:]])
    return _judged(turned, found.x[::-1].copy(), state).error_bound[::-1]


def _judged(hierarchy: Hierarchy, x: Array, state: StateArray) -> Judgement:
    """Judge an answer; one that is not finite is refuted without a bound."""
    return judge(hierarchy, np.where(np.isfinite(x), x, np.inf), state)


def table(told: Sequence[Lies]) -> Table:
    """Make the table of all lies.

    Args:
        told: One for each family.

    Returns:
        One row for each family.
    """
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("family", no_wrap=True)
    lying = ("\nmoved", "\ntoggled", "\nplanted", "KKT\nmet", "lies\nproven", "bound\nbroken")
    for title in (*lying, "bound/error\nleast", "\nmedian", "no\nbound", "\npairs", "\napart", "no\nbound"):
        out.add_column(title, justify="right", no_wrap=True)
    for lies in told:
        counts = lies.moved, lies.toggled, lies.planted, lies.hidden, lies.proven, lies.broken
        least, middle = (np.min(lies.ratios), np.median(lies.ratios)) if lies.ratios else (np.nan, np.nan)
        pairs = lies.unbounded, lies.pairs, lies.apart, lies.unpaired
        out.add_row(lies.family, *map(str, counts), f"{least:.5g}", f"{middle:.3g}", *map(str, pairs))
    return out


def verdict(told: Sequence[Lies]) -> str:
    """Return the sums over all families in a sentence, and the meaning of the columns of `table`.

    Args:
        told: One for each family.

    Returns:
        The text.
    """
    names = ("moved", "toggled", "planted", "hidden", "proven", "broken", "pairs", "apart")
    of = {name: sum(getattr(lies, name) for lies in told) for name in names}
    return (
        f"{of['moved']} answers moved by 1e-9 … 1e-1, {of['toggled']} active sets with a side toggled, and "
        f"{of['planted']} wrong answers with planted multipliers ({of['hidden']} of them meet their KKT "
        f"conditions): {of['proven']} wrong ones proven, {of['broken']} bounds below the true error.\n"
        f"{of['pairs']} pairs of answers to problems of up to 40 unknowns: {of['apart']} differ by more than "
        "their bounds.\n"
        "bound/error: largest error bound over largest true error of the answers that were moved; KKT met: "
        "of the planted ones, those whose KKT residuals are as small as those of an optimum; no bound: "
        "moved answers, and pairs, without a finite bound."
    )
