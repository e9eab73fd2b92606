"""What the measurements of `taskopt bench proof` must show, each with what was found."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from rich import box
from rich.table import Table

from taskopt.bench.lies import Lies
from taskopt.bench.proof import Tally
from taskopt.bench.scaled_problems import DEPENDENT, ORDINARY
from taskopt.hierarchy.tolerances import WIDEST_BOUND

UNPROVEN_ORDINARY = (
    0.01  # share of right answers that are not proven, where rows and weights lie within 10^±3
)
UNPROVEN_BEYOND = 0.05  # the same for the other families but that of dependent rows
LOOSEST_BOUND = 1e3  # error bound over true error, median of the answers that were moved


class Asked(NamedTuple):
    """One requirement.

    Attributes:
        what: What is asked for.
        most: The largest figure that meets it.
        found: The figure, the worst one of all families; NaN if nothing was measured.
        where: The family with that figure; "" for a sum over all families.
    """

    what: str
    most: float
    found: float
    where: str = ""

    @property
    def met(self) -> bool:
        """True if the figure is small enough, or there is none."""
        return not self.found > self.most


def asked(tallies: Sequence[Tally], told: Sequence[Lies]) -> tuple[Asked, ...]:
    """Compare measurements with what is asked for.

    Args:
        tallies: Tallies of all families and resolvers.
        told: The lies of all families.

    Returns:
        All requirements.
    """
    beyond = [t for t in tallies if t.family not in (*ORDINARY, DEPENDENT)]
    ordinary = [t for t in tallies if t.family in ORDINARY]
    unproven = "right but not proven, share of a family"
    widths = {f"{t.family}, {t.resolver}": float(np.median(t.bounds)) for t in ordinary if t.bounds}
    loose = {lies.family: float(np.median(lies.ratios)) for lies in told if lies.ratios}
    return (
        Asked("wrong and proven", 0.0, sum(t.proven for t in tallies)),
        Asked("error bound below the true error", 0.0, sum(t.broken for t in (*tallies, *told))),
        Asked(f"{unproven}, within 10^±3", UNPROVEN_ORDINARY, *_worst(dict(_shares(ordinary)))),
        Asked(f"{unproven}, beyond", UNPROVEN_BEYOND, *_worst(dict(_shares(beyond)))),
        Asked("error bound / max|x|, median, within 10^±3", WIDEST_BOUND, *_worst(widths)),
        Asked("error bound / true error, median of moved answers", LOOSEST_BOUND, *_worst(loose)),
        Asked("lies proven", 0.0, sum(lies.proven for lies in told)),
        Asked("pairs of answers further apart than their bounds", 0.0, sum(lies.apart for lies in told)),
    )


def _shares(tallies: Sequence[Tally]) -> Iterator[tuple[str, float]]:
    """Yield the families with the share of their right answers that is not proven, over all resolvers."""
    for family in dict.fromkeys(tally.family for tally in tallies):
        own = [tally for tally in tallies if tally.family == family]
        yield family, sum(t.unproven for t in own) / max(1, sum(t.right for t in own))


def _worst(figures: dict[str, float]) -> tuple[float, str]:
    """Return the largest figure and where it was found; NaN if there is none."""
    where = max(figures, key=figures.__getitem__, default="")
    return figures.get(where, np.nan), where


def table(requirements: Sequence[Asked]) -> Table:
    """Make the table of requirements.

    Args:
        requirements: As `asked` returns them.

    Returns:
        One row for each.
    """
    out = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    out.add_column("asked for")
    for title in ("at most", "found"):
        out.add_column(title, justify="right")
    for title in ("", "in"):
        out.add_column(title)
    for one in requirements:
        found = "–" if np.isnan(one.found) else f"{one.found:.2g}"
        out.add_row(one.what, f"{one.most:g}", found, "" if one.met else "missed", one.where)
    return out
