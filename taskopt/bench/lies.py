"""Attempts to make the judge prove a wrong answer, and its bounds on answers that are wrong on purpose.

Exact answers are moved by 1e-9 … 1e-1, active sets get one side toggled and are solved again, and answers to
larger problems, whose exact optimum is too expensive, are compared with each other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.proof import is_broken, is_wrong, judged
from taskopt.bench.scaled_problems import FAMILIES, scaled_problem
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import judge
from taskopt.resolver.registry import resolve

SIZES = tuple(10.0**-k for k in range(9, 0, -1))


@dataclass
class Lies:
    """Results of all attempts so far.

    Attributes:
        moved: Answers that were moved.
        toggled: Active sets with a side toggled.
        proven: Wrong answers among them that are proven. There must be none.
        broken: Error bounds below the true error. There must be none.
        ratios: Error bound over true error, largest entries, of the moved answers that have a bound.
        unbounded: Moved answers without a finite bound.
        pairs: Pairs of answers with finite bounds to larger problems.
        apart: Pairs that differ by more than the sum of their bounds. There must be none.
    """

    moved: int = 0
    toggled: int = 0
    proven: int = 0
    broken: int = 0
    ratios: list[float] = field(default_factory=list)
    unbounded: int = 0
    pairs: int = 0
    apart: int = 0

    @property
    def clean(self) -> bool:
        """True if no lie was proven, no bound broken, and no two answers contradict each other."""
        return self.proven == self.broken == self.apart == 0

    def __str__(self) -> str:
        ratio = f"{np.median(self.ratios):.3g}" if self.ratios else "–"
        return (
            f"{self.moved} answers moved by 1e-9 … 1e-1 (bound over true error: median {ratio}; without a "
            f"bound: {self.unbounded}) and {self.toggled} active sets with a side toggled: {self.proven} "
            f"wrong ones proven, {self.broken} bounds below the true error.\n"
            f"{self.pairs} pairs of answers to problems of up to 40 unknowns: {self.apart} differ by more "
            "than their bounds."
        )


def try_lies(
    lies: Lies, problems: int, seed: int = 0, families: Sequence[str] = tuple(FAMILIES)
) -> Iterator[int]:
    """Move answers to small problems, and toggle sides of their active sets.

    Args:
        lies: Results so far, which are added to.
        problems: Number of problems of each family.
        seed: Another seed draws other problems and lies.
        families: Names of the families.

    Yields:
        The index of each problem, after it.
    """
    for family in families:
        for index in range(problems):
            rng = np.random.default_rng([seed, index, *family.encode()])
            _, hierarchy = scaled_problem(family, seed * problems + index)
            exact = exact_optimum(hierarchy)
            state = resolve(hierarchy).state
            _move(lies, hierarchy, exact, state, rng)
            for lie in _toggled(hierarchy, state, rng):
                lies.toggled += 1
                _count(lies, hierarchy, _held(hierarchy, lie), lie, exact)
            yield index


def _move(
    lies: Lies, hierarchy: Hierarchy, exact: list[Fraction], state: StateArray, rng: np.random.Generator
) -> None:
    """Move one entry of the exact answer by each size, and compare the bound with the error."""
    for size in SIZES:
        x = as_floats(exact)
        x[int(rng.integers(len(x)))] += size * float(rng.choice([-1.0, 1.0]))
        most = float(_count(lies, hierarchy, x, state, exact).max())
        lies.moved += 1
        lies.unbounded += not np.isfinite(most)
        if np.isfinite(most):
            lies.ratios.append(most / float(np.abs(x - as_floats(exact)).max()))


def _count(lies: Lies, hierarchy: Hierarchy, x: Array, state: StateArray, exact: list[Fraction]) -> Array:
    """Judge one lie, note if it was believed, and return the error bound."""
    judgement = judge(hierarchy, x, state)
    lies.proven += judgement.proven and is_wrong(x, exact)
    lies.broken += is_broken(judgement.error_bound, x, exact)
    return judgement.error_bound


def compare(lies: Lies, problems: int, names: tuple[str, str], seed: int = 0) -> Iterator[int]:
    """Compare the answers of two resolvers to problems of up to 40 unknowns.

    Args:
        lies: Results so far, which are added to.
        problems: Number of problems of each family.
        names: Names of the resolvers.
        seed: Another seed draws other problems.

    Yields:
        The index of each problem, after it.
    """
    for family in FAMILIES:
        for index in range(problems):
            _, hierarchy = scaled_problem(family, seed * problems + index, most=40)
            first, second = (resolve(hierarchy, name) for name in names)
            one, other = (judged(hierarchy, found).error_bound for found in (first, second))
            if np.isfinite(one + other).all():
                lies.pairs += 1
                lies.apart += bool((np.abs(first.x - second.x) > one + other).any())
            yield index


def _toggled(hierarchy: Hierarchy, state: StateArray, rng: np.random.Generator) -> list[StateArray]:
    """Return active sets that differ in one side, up to four."""
    lower, upper = hierarchy.bounds()
    lies = []
    for i in rng.permutation(np.flatnonzero(lower < upper))[:4]:
        sides = [side for side, bound in ((-1, lower[i]), (0, 0.0), (1, upper[i])) if np.isfinite(bound)]
        lie = state.copy()
        lie[i] = rng.choice([side for side in sides if side != state[i]] or [0])
        lies.append(lie)
    return lies


def _held(hierarchy: Hierarchy, state: StateArray) -> Array:
    """Return the optimum of the hierarchy in which active rows are equalities and others have no bounds."""
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
