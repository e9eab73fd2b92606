"""Two logs beside each other: the first tick at which they are apart, why, and how far apart they get."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from taskopt.arrays import AnyArray, Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.log.description import PROBLEM
from taskopt.log.reading import Log

# What decides an answer, in the order in which one thing follows from another.
_CAUSES = {
    "t": "time",
    "q": "posture",
    "v_before": "velocity before the tick",
    "dt": "length of the tick",
    **{name: f"{name} of the hierarchy" for name in PROBLEM},
    "memory_state": "memory of the resolver",
    "memory_previous": "memory of the resolver",
    "changed": "relaxed limits",
    "fallback": "fallback",
    "damped": "damping at rest",
    "status": "claim of the resolver",
    "state": "active set",
    "x": "answer",
}


class Difference(NamedTuple):
    """How two logs differ.

    Attributes:
        ticks: Number of ticks that both have.
        first: Number of the first tick at which they are apart; None if there is none.
        t: Its time [s]; 0 if there is none.
        causes: What differs there, in the order in which one thing follows from another: the first one is the
            cause, as far as a log knows it. Each is a sentence.
        dq: Largest difference of each entry of q, (nq,); empty if q is not logged.
        dv: Largest difference of each unknown, (n,).
        q_at: Time of each entry of `dq` [s].
        v_at: Time of each entry of `dv` [s].
        q_names: Names of the entries of q, with units.
        v_names: Names of the unknowns, with units.
        lengths: Number of ticks of both logs.
    """

    ticks: int
    first: int | None
    t: float
    causes: tuple[str, ...]
    dq: Array
    dv: Array
    q_at: Array
    v_at: Array
    q_names: tuple[str, ...]
    v_names: tuple[str, ...]
    lengths: tuple[int, int]

    @property
    def same(self) -> bool:
        """True if both have the same ticks."""
        return self.first is None and self.lengths[0] == self.lengths[1]

    def __str__(self) -> str:
        one, other = self.lengths
        lines = [] if one == other else [f"one has {one} ticks, the other {other}"]
        if self.first is None:
            return "\n".join([*lines, f"all {self.ticks} ticks that both have are the same"])
        lines.append(f"apart from tick {self.first}, t = {self.t:.6g} s")
        lines.append(f"cause: {self.causes[0]}")
        lines += [f"then: {cause}" for cause in self.causes[1:]]
        for symbol, sizes, times, names in (
            ("Δq", self.dq, self.q_at, self.q_names),
            ("Δq̈" if "/s²" in "".join(self.v_names) else "Δv", self.dv, self.v_at, self.v_names),
        ):
            for i in np.argsort(-sizes, kind="stable"):
                if sizes[i] != 0.0:
                    name, _, unit = names[i].partition(" ")
                    lines.append(
                        f"{symbol} of {name} up to {sizes[i]:.4g} {unit}".rstrip() + f" at {times[i]:.6g} s"
                    )
        return "\n".join(lines)


def difference(
    one: Log, other: Log, resolvers: tuple[str, str] | None = None, tolerance: float = 0.0
) -> Difference:
    """Compare two logs tick by tick, or two resolvers of logs.

    Args:
        one: A log.
        other: Another log, of the same robot, with the same number of unknowns.
        resolvers: Name of a resolver of each; None for the first ones.
        tolerance: Difference of q [rad, m] and v [rad/s, m/s] up to which ticks count as the same.

    Returns:
        The difference.

    Raises:
        InvalidValue: The logs have other unknowns.
        UnknownName: There is no such resolver.
    """
    if one.layout.unknowns != other.layout.unknowns:
        raise InvalidValue(
            f"the logs have other unknowns: {', '.join(one.layout.unknowns)}, and "
            f"{', '.join(other.layout.unknowns)}; compare logs of one robot"
        )
    names = resolvers or (one.resolvers[0], other.resolvers[0])
    rows = one.rows(names[0]), other.rows(names[1])
    logs, kept = (one, other), _shared((one, other), rows)
    count, numbers = len(kept[0]), one.array("tick")[kept[0]]
    with_q = all("q" in log.columns for log in logs)
    dv = _apart(logs, kept, "x")
    dq = _apart(logs, kept, "q") if with_q else np.zeros((count, 0))
    times = one.t[kept[0]]
    later = np.abs(times - other.t[kept[1]]) > tolerance
    apart = np.flatnonzero((np.hstack([dq, dv]) > tolerance).any(axis=1) | later)
    first = int(apart[0]) if len(apart) else None
    causes = (
        () if first is None else tuple(_causes(logs, (int(kept[0][first]), int(kept[1][first])), tolerance))
    )
    return Difference(
        count, None if first is None else int(numbers[first]), 0.0 if first is None else float(times[first]),
        causes,
        dq.max(axis=0, initial=0.0), dv.max(axis=0, initial=0.0), _when(times, dq), _when(times, dv),
        _named(one, "q") if with_q else (), _named(one, "x"), (len(rows[0]), len(rows[1])),
    )  # fmt: skip


def _shared(logs: tuple[Log, Log], rows: tuple[IntArray, IntArray]) -> tuple[IntArray, IntArray]:
    """Return the rows of the ticks that both logs have."""
    a, b = (log.array("tick")[own] for log, own in zip(logs, rows, strict=True))
    return rows[0][np.isin(a, b)], rows[1][np.isin(b, a)]


def _apart(logs: tuple[Log, Log], rows: tuple[IntArray, IntArray], column: str) -> Array:
    """Return how far a column is apart, (k, m); inf where one has NaN and the other has not."""
    a, b = (log.array(column)[own].astype(np.float64) for log, own in zip(logs, rows, strict=True))
    size = np.abs(a - b)
    return np.where(np.isnan(a) & np.isnan(b), 0.0, np.where(np.isnan(size), np.inf, size))


def _when(times: Array, apart: Array) -> Array:
    """Return the time at which each column is farthest apart."""
    return times[apart.argmax(axis=0)] if len(times) else np.zeros(apart.shape[1])


def _named(log: Log, column: str) -> tuple[str, ...]:
    """Return the names of the entries of a column, each with its unit."""
    names, units = log.names(column), log.unit(column).split(", ")
    if len(units) != len(names):
        units = [units[0] if len(units) == 1 else ""] * len(names)
    return tuple(f"{name} {unit}".rstrip() for name, unit in zip(names, units, strict=True))


def _causes(logs: tuple[Log, Log], rows: tuple[int, int], tolerance: float) -> Iterator[str]:
    """Yield what differs at a tick, in sentences."""
    one, other = (log.tick(row).values for log, row in zip(logs, rows, strict=True))
    for column, what in _CAUSES.items():
        a, b = one.get(column), other.get(column)
        if not _same(a, b, tolerance if column in ("q", "x", "t") else 0.0):
            yield f"{what} ({column}){_where(logs[0], column, a, b)}"


def _same(a: object, b: object, tolerance: float) -> bool:
    """Return True if two values of a row are the same."""
    if a is None or b is None or isinstance(a, str):
        return a == b
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return x.shape == y.shape and bool(np.allclose(x, y, rtol=0.0, atol=tolerance, equal_nan=True))


def _where(log: Log, column: str, a: AnyArray | object, b: AnyArray | object) -> str:
    """Return where two values differ most, in words; "" for values without numbers."""
    if a is None or b is None:
        return f": {'the first' if b is None else 'the second'} only"
    if isinstance(a, str):
        return f": {a}, and {b}"
    x, y = np.atleast_1d(np.asarray(a, dtype=np.float64)), np.atleast_1d(np.asarray(b, dtype=np.float64))
    if x.shape != y.shape:
        return f": {x.size} numbers, and {y.size}"
    size = np.where(x == y, 0.0, np.abs(x - y))
    i = int(np.nanargmax(size)) if np.isfinite(size).any() or np.isinf(size).any() else 0
    names = log.names(column)
    place = f" at {names[i]}" if i < len(names) else ""
    return f"{place}: {x[i]:.6g}, and {y[i]:.6g}"
