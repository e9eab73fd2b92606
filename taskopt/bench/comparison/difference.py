"""What changed from one comparison to another, as tables."""

from collections.abc import Iterator, Sequence

import numpy as np

from taskopt.bench.comparison.problem_set import SHOWN
from taskopt.bench.comparison.results import PLACE, Figures, Results, all_figures
from taskopt.bench.comparison.tables import Table
from taskopt.bench.comparison.words import digits, micro, share


def difference(first: Results, second: Results) -> Iterator[Table]:
    """Make the tables of what changed from one comparison to another.

    Args:
        first: The rows before.
        second: The rows after.

    Yields:
        Changed conditions; then claims, accuracy and times for each resolver and setting on the problems
        that both have.
    """
    changed = tuple(_changed(first, second))
    yield Table("Conditions that differ", "", ("condition", "first", "second"), changed)
    same = [
        name
        for name, about in first.conditions["sets"].items()
        if second.conditions["sets"].get(name, {}).get("checksum") == about["checksum"]
    ]
    both = _problems(first, same) & _problems(second, same)
    before, after = (rows.select(np.array([key in both for key in _keys(rows)])) for rows in (first, second))
    later = {(one.resolver, one.setting): one for one in all_figures(after)}
    lines = tuple(_change(one, later[one.resolver, one.setting]) for one in all_figures(before))
    note = (
        f"On the {len(both)} answers that both have to the same problems of: {', '.join(same) or 'no set'}."
    )
    heading = (
        "resolver", "setting", "proven", "refuted", "right", "largest distance", "cpu mean [µs]", "ratio",
    )  # fmt: skip
    yield Table("Resolvers", note, heading, lines)


def _keys(rows: Results) -> Iterator[tuple[str, ...]]:
    """Yield what tells one row from another."""
    columns = (rows.columns[name] for name in (*PLACE, "index"))
    yield from zip(*columns, strict=True)


def _problems(rows: Results, sets: Sequence[str]) -> set[tuple[str, ...]]:
    """Return the keys of the rows of some sets."""
    return {key for key in _keys(rows) if key[0] in sets}


def _changed(first: Results, second: Results) -> Iterator[tuple[str, str, str]]:
    """Yield the conditions that differ."""
    for part in ("machine", "versions", "missing"):
        then, now = first.conditions[part], second.conditions[part]
        for key in dict.fromkeys((*then, *now)):
            if then.get(key) != now.get(key):
                yield f"{part}: {key}", str(then.get(key, "–")), str(now.get(key, "–"))
    for name in dict.fromkeys((*first.conditions["sets"], *second.conditions["sets"])):
        sums = [
            rows.conditions["sets"].get(name, {}).get("checksum", "–")[:SHOWN] for rows in (first, second)
        ]
        if sums[0] != sums[1]:
            yield f"set {name}", *sums


def _change(one: Figures, other: Figures) -> tuple[str, ...]:
    """Return the line of a resolver in a difference."""

    def pair(text: str, then: str) -> str:
        """Return one text if nothing changed, else both."""
        return text if text == then else f"{text} → {then}"

    return (
        one.resolver,
        one.setting,
        pair(share(one.proven), share(other.proven)),
        pair(share(one.refuted), share(other.refuted)),
        pair(share(one.right), share(other.right)),
        pair(digits(one.distance[2]), digits(other.distance[2])),
        f"{micro(one.mean)} → {micro(other.mean)}",
        f"{other.mean / one.mean:.3f}" if np.isfinite(one.mean) and one.mean > 0.0 else "–",
    )
