"""Judge answers by exact references: wrong and proven must never happen.

An answer is wrong if an entry x_i is further than 1e-8 · max(1, |x_i|) from the exact optimum of the declared
numbers (`taskopt.bench.exact`). It is proven if `taskopt.hierarchy.proof.judge` bounds every error below
that. Problems come from `taskopt.bench.scaled_problems`; resolvers start cold, and with a memory.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from rich import box
from rich.table import Table

from taskopt.arrays import Array
from taskopt.bench.exact import as_floats, exact_optimum
from taskopt.bench.scaled_problems import FAMILIES, scaled_problem
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import UNDECIDED, Judgement, Verdict, judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.active_set.polish import polish
from taskopt.resolver.registry import resolver

RESOLVERS = ("active-set", *(f"hqp/{name}" for name in ("daqp", "clarabel", "proxqp", "quadprog", "piqp")))
STARTS = ("cold", "warm")


@dataclass
class Tally:
    """Counts of the answers of one resolver to one family.

    Attributes:
        family: Name of the family.
        resolver: Name of the resolver.
        start: "cold" or "warm".
        right: Right answers.
        unproven: Right answers that are not proven.
        wrong: Wrong answers, those without numbers included.
        claimed: Wrong answers that are claimed to be the optimum.
        proven: Wrong answers that are proven. There must be none.
        undecided: Answers of which double precision cannot tell.
        mended: Wrong answers that are right after polishing.
        broken: Answers whose error bound is below their true error. There must be none.
        iterations: Largest number of iterations of a solve.
    """

    family: str
    resolver: str
    start: str
    right: int = 0
    unproven: int = 0
    wrong: int = 0
    claimed: int = 0
    proven: int = 0
    undecided: int = 0
    mended: int = 0
    broken: int = 0
    iterations: int = 0

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
        self.broken += is_broken(judgement.error_bound, found.x, exact)
        self.iterations = max(self.iterations, found.iterations)


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
    error, size = _errors(x, exact), np.maximum(1.0, np.abs(as_floats(exact)))
    return any(err > Fraction(ACCURACY) * Fraction(float(one)) for err, one in zip(error, size, strict=True))


def is_broken(bound: Array, x: Array, exact: list[Fraction]) -> bool:
    """Return True if an error bound is below the true error of x, compared without rounding.

    Args:
        bound: The error bound, (n,).
        x: The answer, (n,).
        exact: The exact optimum.

    Returns:
        True for a false bound.
    """
    if not np.isfinite(x).all():
        return False
    pairs = zip(_errors(x, exact), bound, strict=True)
    return any(np.isfinite(most) and error > Fraction(float(most)) for error, most in pairs)


def _errors(x: Array, exact: list[Fraction]) -> list[Fraction]:
    """Return |x − exact|, without rounding."""
    return [abs(Fraction(float(value)) - one) for value, one in zip(x, exact, strict=True)]


def judged(hierarchy: Hierarchy, found: Resolution) -> Judgement:
    """Judge an answer; one without numbers is refuted.

    Args:
        hierarchy: The problem.
        found: Its answer.

    Returns:
        The judgement.
    """
    if not np.isfinite(found.x).all():
        return Judgement(np.full(hierarchy.n, np.inf), Verdict.REFUTED, (), "There is no answer.")
    return judge(hierarchy, found.x, found.state)


def measure(
    problems: int, names: Sequence[str] = RESOLVERS, seed: int = 0, families: Sequence[str] = tuple(FAMILIES)
) -> Iterator[tuple[Tally, ...]]:
    """Judge the answers of all resolvers, family by family.

    Args:
        problems: Number of problems of each family.
        names: Names of the resolvers.
        seed: Another seed draws other problems.
        families: Names of the families.

    Yields:
        The tallies of a family so far, after each problem: one for each resolver, cold and warm.
    """
    for family in families:
        tallies = tuple(Tally(family, name, start) for name in names for start in STARTS)
        for index in range(problems):
            before, hierarchy = scaled_problem(family, seed * problems + index)
            exact = exact_optimum(hierarchy)
            for cold, warm in zip(tallies[::2], tallies[1::2], strict=True):
                answer = resolver(cold.resolver)
                _, memory = answer(before)
                for tally, start in ((cold, None), (warm, memory)):
                    found, _ = answer(hierarchy, start)
                    tally.count(found, judged(hierarchy, found), exact)
            yield tallies


def table(tallies: Sequence[Tally]) -> Table:
    """Make the table of a measurement, cold and warm starts added up.

    Args:
        tallies: Tallies of all families.

    Returns:
        One row for each family and resolver.
    """
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("family", no_wrap=True)
    out.add_column("resolver", no_wrap=True)
    titles = ("right", "not\nproven", "un-\ndecided", "wrong", "claimed", "proven", "mended by\npolishing")
    for title in (*titles, "bound\nbroken", "iterations"):
        out.add_column(title, justify="right", no_wrap=True)
    last = ""
    for cold, warm in zip(tallies[::2], tallies[1::2], strict=True):
        fields = ("right", "unproven", "undecided", "wrong", "claimed", "proven", "mended", "broken")
        sums = [str(getattr(cold, name) + getattr(warm, name)) for name in fields]
        head = cold.family if cold.family != last else ""
        out.add_row(head, cold.resolver, *sums, str(max(cold.iterations, warm.iterations)))
        last = cold.family
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
        f"{claimed} claim to be solved and {proven} are proven; "
        f"{broken} error bounds below the true error.\n"
        "wrong: an entry is further than 1e-8 · max(1, |x_i|) from the exact optimum, or it is not there; "
        "claimed: of the wrong ones, those that count as solved; proven: of the wrong ones, those whose "
        "error bound is below that; mended by polishing: of the wrong ones, those that are right when the "
        "active set of the answer is solved again."
    )
