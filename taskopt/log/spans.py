"""When limits were active in a log, how long, and what each cost."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.tolerances import COUNTED_MULTIPLIER
from taskopt.log.reading import Log


class Span(NamedTuple):
    """Consecutive ticks at which one bound was active.

    Attributes:
        name: Name of the limit or task, and of the unknown or row, such as "joint_position/joint4".
        side: "lower" or "upper".
        first: Number of the first row.
        last: Number of the last row.
        begin: Time of the first tick [s].
        duration: Time until the tick after the last one [s].
        price: The largest multiplier in size at the first level where it has one; 0 for none.
        level: That level, 1 for the first; the number of levels plus one is the norm.
        unit: Unit of the price: that of ½ Σ w d² of the level, per unit of the bound.
    """

    name: str
    side: str
    first: int
    last: int
    begin: float
    duration: float
    price: float
    level: int
    unit: str

    def __str__(self) -> str:
        text = f"{self.name} {self.side}: from {self.begin:.6g} s for {self.duration:.4g} s"
        return f"{text}, price up to {self.cost}" if self.price else f"{text}, at no price"

    @property
    def cost(self) -> str:
        """The price with its unit and its level."""
        return f"{abs(self.price):.3g} {self.unit}".rstrip() + f" at level {self.level}"


def spans(log: Log, resolver: str) -> tuple[Span, ...]:
    """Find when bounds and inequalities were active.

    Args:
        log: The log.
        resolver: Name of the resolver.

    Returns:
        The spans in the order of time. At ticks that were damped so that the robot comes to rest, the active
        set is that of the answer without damping.
    """
    rows = log.rows(resolver)
    if not len(rows):
        return ()
    code, t = _active(log, rows), log.t[rows]
    multipliers = log.array("multipliers")[rows].reshape(len(rows), log.layout.level_count + 1, -1)
    steps = log.array("dt")[rows]
    found = []
    for i in range(log.layout.width):
        for first, last in runs(code[:, i]):
            name, side = bound_name(log, i, int(code[first, i])), "upper" if code[first, i] > 0 else "lower"
            price, level = _price(multipliers[first : last + 1, :, i])
            unit = price_unit(log, i, level)
            length = float(t[last] + steps[last] - t[first])
            span = Span(
                name, side, int(rows[first]), int(rows[last]), float(t[first]), length, price, level, unit
            )
            found.append(span)
    return tuple(sorted(found, key=lambda span: (span.first, span.name)))


def dearest(own: Sequence[Span]) -> list[Span]:
    """Choose the spans with the highest price at each level; prices of two levels are never compared.

    Args:
        own: Spans.

    Returns:
        One span for each level at which one has a price, the first level first.
    """
    levels = sorted({span.level for span in own if span.price})
    return [
        max((span for span in own if span.price and span.level == level), key=lambda span: abs(span.price))
        for level in levels
    ]


def codes(log: Log, rows: IntArray, state: IntArray) -> IntArray:
    """Tell bounds apart by the limit or the label behind them, which may change from tick to tick.

    Args:
        log: The log.
        rows: Numbers of rows, (k,).
        state: Side of each bound that counts, (k, n + M): −1 lower, 1 upper, 0 for none.

    Returns:
        The side times the number of the name of the bound, (k, n + M), see `bound_name`; 0 for none.
    """
    n = log.layout.n
    owner, label = log.array("owner")[rows].astype(np.int64), log.array("label")[rows].astype(np.int64)
    own = np.where(state[:, :n] > 0, owner[:, n:], owner[:, :n])
    return state * (1 + np.hstack([own, label]))


def _active(log: Log, rows: IntArray) -> IntArray:
    """Return `codes` of the active bounds; equalities are never active."""
    n, count = log.layout.n, log.layout.row_count
    box, bounds = log.array("box")[rows], log.array("bounds")[rows]
    equal = np.hstack([box[:, :n] == box[:, n:], bounds[:, :count] == bounds[:, count:]])
    return np.where(equal, 0, codes(log, rows, log.array("state")[rows].astype(np.int64)))


def runs(code: IntArray) -> Iterator[tuple[int, int]]:
    """Find the runs of one number other than 0.

    Args:
        code: Numbers, (k,).

    Yields:
        First and last place of each run.
    """
    edges = (np.flatnonzero(np.diff(code)) + 1).tolist()
    for first, stop in zip([0, *edges], [*edges, len(code)], strict=True):
        if len(code) and code[first]:
            yield first, stop - 1


def bound_name(log: Log, i: int, code: int) -> str:
    """Return the name of a bound.

    Args:
        log: The log.
        i: Number of the unknown or row, unknowns first.
        code: What `codes` has for it.

    Returns:
        Name of the limit, and of the unknown or row.
    """
    layout = log.layout
    if i >= layout.n:
        return layout.row_name(i - layout.n, abs(code) - 1)
    return f"{layout.owners[abs(code) - 1]}/{layout.unknowns[i]}"


def _price(multipliers: Array) -> tuple[float, int]:
    """Return the largest multiplier (of k, levels + 1) at the first level that has one, and that level."""
    size = np.abs(np.nan_to_num(multipliers))
    counted = size > COUNTED_MULTIPLIER * np.maximum(1.0, size.max(axis=1, keepdims=True))
    if not counted.any():
        return 0.0, 0
    level = int(np.argmax(counted.any(axis=0)))
    return float(multipliers[np.argmax(size[:, level]), level]), level + 1


def price_unit(log: Log, i: int, level: int) -> str:
    """Return the unit of a price: the square of that of the rows of the level, per unit of the bound.

    Args:
        log: The log.
        i: Number of an unknown, or n plus that of a row.
        level: The level, 1 for the first.

    Returns:
        The unit; "" at the norm.
    """
    layout = log.layout
    if not 0 < level <= layout.level_count:
        return ""
    rows = layout.rows_of_level(level)
    units = dict.fromkeys(layout.unit(layout.n + row) for row in range(rows.start, rows.stop))
    cost = " + ".join(f"({unit})²" for unit in units)
    return f"{cost if len(units) == 1 else f'[{cost}]'} per {layout.unit(i) or 'unit'}"
