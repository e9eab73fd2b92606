"""Judge answers by exact references: wrong and proven must never happen.

An answer is wrong if an entry x_i is further than 1e-8 · max(1, |x_i|) from the exact optimum of the declared
numbers (`taskopt.bench.exact`). It is proven if `taskopt.hierarchy.proof.judge` bounds every error below
that. Problems come from `taskopt.bench.scaled_problems` in pairs that differ by a percent; resolvers start
cold at both, and at the second with the memory of the first. `wqp/` is asked ordinary problems only, and is
judged by the optimum of its own weighted problem.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from rich import box
from rich.table import Table

from taskopt.arrays import Array
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.scaled_problems import FAMILIES, ORDINARY, scaled_problem
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import UNDECIDED, Judge, Judgement, Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.registry import resolver
from taskopt.resolver.weighted import weighted_problem

SOLVERS = ("daqp", "clarabel", "proxqp", "quadprog", "piqp")
WEIGHTED = "wqp/"  # resolvers that state another problem, whatever they start from
RESOLVERS = ("active-set", *(f"hqp/{name}" for name in SOLVERS), *(f"{WEIGHTED}{name}" for name in SOLVERS))


@dataclass
class Tally:
    """Counts of the answers of one resolver to one family, cold and warm.

    Attributes:
        family: Name of the family.
        resolver: Name of the resolver.
        right: Right answers.
        unproven: Right answers that are not proven.
        wrong: Wrong answers, those without numbers included.
        claimed: Wrong answers that are claimed to be the optimum.
        proven: Wrong answers that are proven. There must be none.
        undecided: Answers of which double precision cannot tell.
        mended: Wrong answers that are right after polishing.
        broken: Answers whose error bound is below their true error. There must be none.
        iterations: Largest number of iterations of a solve.
        bounds: Largest error bound over largest |x_i| of each right answer that has a bound, and is not 0.
    """

    family: str
    resolver: str
    right: int = 0
    unproven: int = 0
    wrong: int = 0
    claimed: int = 0
    proven: int = 0
    undecided: int = 0
    mended: int = 0
    broken: int = 0
    iterations: int = 0
    bounds: list[float] = field(default_factory=list)

    @property
    def clean(self) -> bool:
        """True if nothing wrong is proven, and no bound is below its error."""
        return self.proven == self.broken == 0

    def count(self, found: Resolution, judgement: Judgement, exact: list[Fraction]) -> None:
        """Count one answer.

        Args:
            found: The answer.
            judgement: Its judgement.
            exact: The exact optimum, n fractions.
        """
        wrong = is_wrong(found.x, exact)
        proven = judgement.proven
        self.right += not wrong
        self.unproven += not wrong and not proven
        self.wrong += wrong
        self.claimed += wrong and found.claimed
        self.proven += wrong and proven
        self.undecided += judgement.verdict in UNDECIDED
        self.mended += wrong and bool(np.isfinite(found.x).all()) and not is_wrong(polish(found).x, exact)
        self.broken += is_broken(judgement, found.x, exact)
        self.iterations = max(self.iterations, found.iterations)
        size, bound = float(np.abs(found.x).max()), float(judgement.error_bound.max())
        if not wrong and size > 0.0 and np.isfinite(bound):
            self.bounds.append(bound / size)


def is_wrong(x: Array, exact: list[Fraction]) -> bool:
    """Return True if an entry is further than 1e-8 · max(1, |x_i|) from the exact one, or no number.

    Args:
        x: The answer, (n,).
        exact: The exact optimum.

    Returns:
        True for a wrong answer.
    """
    if not np.isfinite(x).all():
        return True
    error, size = exact_errors(x, exact), np.maximum(1.0, np.abs(as_floats(exact)))
    return any(err > Fraction(ACCURACY) * Fraction(float(one)) for err, one in zip(error, size, strict=True))


def is_broken(judgement: Judgement, x: Array, exact: list[Fraction]) -> bool:
    """Return True if an error bound is below the true error of x, compared without rounding.

    A bound on a condition is not compared, since the condition need not hold.

    Args:
        judgement: The judgement, with the bound.
        x: The answer, (n,).
        exact: The exact optimum.

    Returns:
        True for a false bound.
    """
    if not np.isfinite(x).all() or judgement.verdict is Verdict.PROVEN_IF:
        return False
    pairs = zip(exact_errors(x, exact), judgement.error_bound, strict=True)
    return any(np.isfinite(most) and error > Fraction(float(most)) for error, most in pairs)


def exact_errors(x: Array, exact: list[Fraction]) -> list[Fraction]:
    """Return |x − exact| without rounding.

    Args:
        x: The answer, (n,), finite.
        exact: The exact optimum.

    Returns:
        The errors, n fractions.
    """
    return [abs(Fraction(float(value)) - one) for value, one in zip(x, exact, strict=True)]


class Court:
    """The exact optimum of a problem, and the judge of all answers to it.

    Args:
        problem: The problem.

    Attributes:
        exact: The exact optimum, n fractions.
        judge: The judge.
    """

    def __init__(self, problem: Hierarchy) -> None:
        self.exact, self.judge, self._n = exact_optimum(problem), Judge(problem), problem.n

    def judgement(self, found: Resolution) -> Judgement:
        """Judge an answer; one without numbers is refuted.

        Args:
            found: The answer.

        Returns:
            The judgement.
        """
        if not np.isfinite(found.x).all():
            return Judgement(np.full(self._n, np.inf), Verdict.REFUTED, (), "There is no answer.")
        return self.judge(found.x, found.state)

    def hear(self, tally: Tally, found: Resolution) -> None:
        """Judge an answer and count it.

        Args:
            tally: Counts of its resolver.
            found: The answer.
        """
        tally.count(found, self.judgement(found), self.exact)


def measure(
    problems: int, names: Sequence[str] = RESOLVERS, seed: int = 0, families: Sequence[str] = tuple(FAMILIES)
) -> Iterator[tuple[Tally, ...]]:
    """Judge the answers of all resolvers, family by family.

    Args:
        problems: Number of problems of each family; an odd number is rounded up.
        names: Names of the resolvers.
        seed: Another seed draws other problems.
        families: Names of the families.

    Yields:
        The tallies of a family so far, after each pair of problems: one for each resolver.
    """
    pairs = (problems + 1) // 2
    for family in families:
        asked = [name for name in names if family in ORDINARY or not name.startswith(WEIGHTED)]
        tallies = tuple(Tally(family, name) for name in asked)
        for index in range(pairs):
            pair = scaled_problem(family, seed * pairs + index)
            courts = [Court(hierarchy) for hierarchy in pair]
            weighted = any(name.startswith(WEIGHTED) for name in asked)
            others = [Court(weighted_problem(hierarchy)) for hierarchy in pair] if weighted else []
            for tally in tallies:
                _ask(tally, pair, others if tally.resolver.startswith(WEIGHTED) else courts)
            yield tallies


def _ask(tally: Tally, pair: tuple[Hierarchy, Hierarchy], courts: Sequence[Court]) -> None:
    """Ask a resolver both problems cold, and the second one with the memory of the first."""
    answer, (first, second) = resolver(tally.resolver), courts
    found, memory = answer(pair[0])
    first.hear(tally, found)
    for start in (None,) if tally.resolver.startswith(WEIGHTED) else (None, memory):
        second.hear(tally, answer(pair[1], start)[0])


def table(tallies: Sequence[Tally]) -> Table:
    """Make the table of a measurement.

    Args:
        tallies: Tallies of all families.

    Returns:
        One row for each family and resolver.
    """
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("family", no_wrap=True)
    out.add_column("resolver", no_wrap=True)
    titles = ("\nright", "right, not\nproven", "un-\ndecided", "\nwrong", "and\nclaimed", "and\nproven")
    for title in (*titles, "\nmended", "bound\nbroken", "bound/\nmax|x|", "itera-\ntions"):
        out.add_column(title, justify="right", no_wrap=True)
    last = ""
    for tally in tallies:
        counts = tally.undecided, tally.wrong, tally.claimed, tally.proven, tally.mended, tally.broken
        bound = f"{np.median(tally.bounds):.0e}" if tally.bounds else "–"
        share = f"{tally.unproven} {100.0 * tally.unproven / max(1, tally.right):.2g} %"
        head = tally.family if tally.family != last else ""
        figures = str(tally.right), share, *map(str, counts), bound, str(tally.iterations)
        out.add_row(head, tally.resolver, *figures)
        last = tally.family
    return out


def verdict(tallies: Sequence[Tally]) -> str:
    """Return the sums over all tallies in a sentence, and the meaning of each column of `table`.

    Args:
        tallies: Tallies of all families.

    Returns:
        The text.
    """
    answers = sum(tally.right + tally.wrong for tally in tallies)
    wrong, claimed = sum(tally.wrong for tally in tallies), sum(tally.claimed for tally in tallies)
    proven, broken = sum(tally.proven for tally in tallies), sum(tally.broken for tally in tallies)
    right, unproven = sum(tally.right for tally in tallies), sum(tally.unproven for tally in tallies)
    return (
        f"{answers} answers: {right} right, of which {unproven} are not proven; {wrong} wrong, of which "
        f"{claimed} are claimed and {proven} are proven; "
        f"{broken} error bounds below the true error.\n"
        "wrong: an entry is further than 1e-8 · max(1, |x_i|) from the exact optimum, or it is not there; "
        "claimed: the resolver says that it is the optimum; proven: the error bound of every entry is below "
        "that; mended: of the wrong ones, those that are right when the active set of the answer is solved "
        "again; bound/max|x|: median of the right answers."
    )
