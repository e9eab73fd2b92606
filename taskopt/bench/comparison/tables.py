"""The tables of a comparison, as plain text that every kind of report shows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.bench.comparison.findings import is_reliable
from taskopt.bench.comparison.problem_set import SHOWN
from taskopt.bench.comparison.results import Figures, Results, all_figures, figures, growth
from taskopt.bench.comparison.words import digits, micro, share


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: What it shows.
        note: Explanation of its columns; "" for none.
        heading: Headings of the columns.
        rows: Texts, as many in each row as there are headings.
    """

    title: str
    note: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def short_tables(rows: Results) -> Iterator[Table]:
    """Make the tables that a reader looks at first: one line for each resolver, one for each set.

    Args:
        rows: All rows.

    Yields:
        The tables in the order of the report.
    """
    yield _summary(rows.well_scaled)
    yield _by_set(rows)
    yield _given_up(rows.well_scaled)
    if len(snakes := rows.where(set="snakes")):
        yield _growth(snakes)
    yield _sets(rows)
    yield _solvers(rows)


def long_tables(rows: Results) -> Iterator[Table]:
    """Make the tables of all figures of every resolver, over all sets and for each of them.

    Args:
        rows: All rows.

    Yields:
        The tables in the order of the report.
    """
    yield _shares("All sets but the badly scaled ones: claims and accuracy", rows.well_scaled)
    yield _times("All sets but the badly scaled ones: times", rows.well_scaled)
    for name in rows.names("set"):
        yield _shares(f"Set {name}: claims and accuracy", rows.where(set=name))
        yield _times(f"Set {name}: times", rows.where(set=name))


def _summary(rows: Results) -> Table:
    """Make the table of all resolvers: first those that are right and claim it, the quickest first."""
    note = (
        "Over all sets but the badly scaled ones. First those that claim, and are right in, 99 % of the "
        "problems, the quickest first; then the others, those that are right most often first. right: "
        "within 1e-8 of the exact strict optimum; refuted, undecided: of its claims, by our judge, as shares "
        "of the problems; largest: distance from the exact optimum; cpu mean: shifted geometric mean of the "
        "processor time."
    )
    heading = "resolver", "setting", "right", "claimed", "refuted", "undecided", "largest", "cpu mean [µs]"
    found = all_figures(rows)
    order = [
        *sorted((one for one in found if is_reliable(one)), key=lambda one: one.mean),
        *sorted((one for one in found if not is_reliable(one)), key=lambda one: (-one.right, one.refuted)),
    ]
    lines = (
        (
            one.resolver, one.setting, share(one.right), share(one.claimed),
            share(one.refuted + one.refuted_if), share(one.undecided), digits(one.distance[2]),
            micro(one.mean),
        )
        for one in order
    )  # fmt: skip
    return Table("Every resolver in one line", note, heading, tuple(lines))


def _given_up(rows: Results) -> Table:
    """Make the table of limits that answers break, levels that they make worse, and rows that they change."""
    note = (
        "Over the same problems, where there is an answer. outside: largest violation of a bound or a hard "
        "row; level 1, lower: share of the problems in which that is the first level that is worse than at "
        "the exact strict optimum by more than 1e-8; regret: by how much at most; changes: bounds and rows "
        "whose activity differs from that of the answer before, in the mean."
    )
    heading = "resolver", "setting", "outside", "level 1", "lower", "regret", "changes"
    lines = []
    for one in all_figures(rows):
        of = rows.where(resolver=one.resolver, setting=one.setting).columns
        there = np.isfinite(of["outside"])
        if there.any():
            level, changes = of["level"][there], of["changes"][there]
            followed = changes[changes >= 0]
            mean = f"{followed.mean():.2g}" if len(followed) else "–"
            lines.append(
                (
                    one.resolver, one.setting, digits(of["outside"][there].max()),
                    share(float(np.mean(level == 1))), share(float(np.mean(level > 1))),
                    digits(of["regret"][there].max()), mean,
                )
            )  # fmt: skip
    return Table("Limits, priorities and active sets", note, heading, tuple(lines))


def _growth(snakes: Results) -> Table:
    """Make the table of the exponents with which the time grows with the number of joints."""
    note = (
        "Planar arms whose tip follows a circle. exponent: slope of the logarithm of the mean processor time "
        "over that of the number of joints, by least squares; from, to: the smallest and the largest arm."
    )
    lines = []
    for one in all_figures(snakes):
        points = [(size, mean) for size, mean in growth(snakes, one) if np.isfinite(mean)]
        if len(points) > 1:
            joints, times = np.log(np.array(points)).T
            slope = np.polyfit(joints, times, 1)[0]
            ends = [f"{size}: {micro(mean)}" for size, mean in (points[0], points[-1])]
            lines.append((one.resolver, one.setting, f"{slope:.2f}", *ends))
    heading = "resolver", "setting", "exponent", "from [µs]", "to [µs]"
    return Table("Growth with the number of joints", note, heading, tuple(lines))


def _by_set(rows: Results) -> Table:
    """Make the table of all sets: where the closed form suffices, and who is quick there."""
    note = (
        "reliable: number of resolvers in their settings that claim, and are right in, 99 % of the problems "
        "of the set; quickest: the quickest of these, and its mean processor time; closed form: share of the "
        "problems of which pinv has the exact optimum; refuted, undecided: shares of all answers."
    )
    heading = (
        "set", "problems", "closed form", "reliable", "quickest cold", "quickest warm", "refuted",
        "undecided",
    )  # fmt: skip
    lines = []
    for name in rows.names("set"):
        here = rows.where(set=name)
        found = all_figures(here)
        reliable = [one for one in found if is_reliable(one)]
        formula = [one.right for one in found if (one.resolver, one.setting) == ("pinv", "cold")]
        whole = figures(here)
        lines.append(
            (
                name, str(max(one.answers for one in found)), share(formula[0] if formula else np.nan),
                f"{len(reliable)} of {len(found)}", _quickest(reliable, "cold"), _quickest(reliable, "warm"),
                share(whole.refuted + whole.refuted_if), share(whole.undecided),
            )
        )  # fmt: skip
    return Table("Every set in one line", note, heading, tuple(lines))


def _quickest(some: Sequence[Figures], setting: str) -> str:
    """Return the quickest in a setting with its time; a dash if there is none."""
    best = min((one for one in some if one.setting == setting), key=lambda one: one.mean, default=None)
    return f"{best.resolver}, {micro(best.mean)} µs" if best else "–"


def _shares(title: str, rows: Results) -> Table:
    """Make the table of claims and accuracy."""
    note = (
        "Shares of the problems. claimed: says that it has the optimum, or that there is none; proven, "
        "undecided, refuted: our judge on that claim; proven if, refuted if: on the condition that rows that "
        "depend on others up to rounding depend on them exactly; right: within 1e-8 of the exact strict "
        "optimum, among the problems where that is known, or is on that condition; distance: "
        "‖x − x*‖∞ / max(1, ‖x*‖∞), median, 95 % and largest; "
        "failed: crashed, missed the deadline, or was not tried after that."
    )
    heading = (
        "resolver", "setting", "problems", "claimed", "proven", "proven if", "undecided", "refuted if",
        "refuted", "right",
        "distance p50", "p95", "largest", "failed",
    )  # fmt: skip
    lines = (
        (
            one.resolver, one.setting, str(one.answers), share(one.claimed), share(one.proven),
            share(one.proven_if), share(one.undecided), share(one.refuted_if), share(one.refuted),
            share(one.right), *map(digits, one.distance), str(one.failed),
        )
        for one in all_figures(rows)
    )  # fmt: skip
    return Table(title, note, heading, tuple(lines))


def _times(title: str, rows: Results) -> Table:
    """Make the table of times."""
    note = (
        "In µs. mean: shifted geometric mean of the processor time, shift 10 µs; ratio: to the least mean; "
        "inside: wall clock inside the package of the solver, of which the rest is our code around it; "
        "misses: answers that take longer than 1 ms of wall clock."
    )
    heading = (
        "resolver", "setting", "cpu mean", "ratio", "cpu p50", "cpu p95", "cpu p99", "inside p50",
        "wall p50", "wall p99",
        "wall largest", "misses",
    )  # fmt: skip
    found = [one for one in all_figures(rows) if np.isfinite(one.mean)]
    least = min((one.mean for one in found), default=1.0)
    lines = (
        (
            one.resolver, one.setting, micro(one.mean), f"{one.mean / least:.3g}", *map(micro, one.cpu),
            _inside(one), *map(micro, one.wall), share(one.missed),
        )
        for one in sorted(found, key=lambda one: one.mean)
    )  # fmt: skip
    return Table(title, note, heading, tuple(lines))


def _sets(rows: Results) -> Table:
    """Make the table of the sets."""
    lines = []
    for key, about in rows.conditions["sets"].items():
        sizes = about["unknowns"].values()
        own = rows.where(set=key)
        known = sorted({str(kind) for kind in own.names("reference")}) if len(own) else []
        span = f"{min(sizes)}–{max(sizes)}" if min(sizes) < max(sizes) else str(min(sizes))
        version, checksum = str(about["version"]), about["checksum"][:SHOWN]
        count = f"{about['problems']} in {about['sequences']}"
        lines.append((about["name"], version, checksum, count, span, ", ".join(known), about["description"]))
    heading = ("set", "version", "checksum", "problems in sequences", "unknowns", "references", "description")
    return Table("Sets", "", heading, tuple(lines))


def _solvers(rows: Results) -> Table:
    """Make the table of versions, and of solvers that are not there."""
    late = "takes seconds for a problem: tried by --full, or if it is named"
    left_out = rows.conditions.get("left_out", [])  # which older rows do not have
    there = [
        (name, number, late if name in left_out else "")
        for name, number in rows.conditions["versions"].items()
    ]
    gone = [(name, "not installed", f"pip install {pip}") for name, pip in rows.conditions["missing"].items()]
    note = "Of the solvers that are not installed, some need a licence or a compiler."
    return Table(
        "Versions, and solvers that were not tried", note, ("package", "version", ""), (*there, *gone)
    )


def markdown(table: Table) -> str:
    """Write a table in Markdown.

    Args:
        table: The table.

    Returns:
        Its text, with the title as a heading.
    """
    lines = [_line(table.heading), _line(["---"] * len(table.heading)), *map(_line, table.rows)]
    return "\n".join([f"### {table.title}", "", *([table.note, ""] if table.note else []), *lines, ""])


def _line(cells: Sequence[str]) -> str:
    """Return a row of a table in Markdown."""
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _inside(one: Figures) -> str:
    """Return the time inside the package of a solver; a dash where there is none, or none was measured."""
    return micro(one.inside) if one.inside > 0.0 else "–"
