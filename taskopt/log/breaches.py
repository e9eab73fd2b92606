"""Which limits answers broke in a log, when first, how long, and by how much, as a closed form does."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.tolerances import CLAIM_KEEPS_LIMITS, SHOWN_VIOLATION
from taskopt.log.reading import Log
from taskopt.log.spans import bound_name, codes


class Breach(NamedTuple):
    """A limit that was broken.

    Attributes:
        name: Name of the limit and of the unknown or row, such as "joint_velocity/joint4".
        side: "lower" or "upper".
        begin: Time of the first tick [s].
        duration: Sum of the lengths of its ticks [s].
        size: The largest excess over the limit.
        at: Time of that excess [s].
        unit: Unit of the excess.
    """

    name: str
    side: str
    begin: float
    duration: float
    size: float
    at: float
    unit: str

    def __str__(self) -> str:
        size = f"{self.size:.4g} {self.unit}".rstrip()
        return (
            f"{self.name} {self.side}: first at {self.begin:.6g} s, {self.duration:.4g} s in all, by up to "
            f"{size} at {self.at:.6g} s"
        )


def breaches(log: Log, resolver: str) -> tuple[Breach, ...]:
    """Find the hard limits that the answers of a resolver broke, and the position limits that q left.

    An answer breaks a limit of its tick by more than `taskopt` lets a resolver claim. The same motion may
    leave the range of a joint, which is told as "position" with the distance in its own unit.

    Args:
        log: The log.
        resolver: Name of the resolver.

    Returns:
        What was broken, in the order of time.
    """
    rows = log.rows(resolver)
    if not len(rows):
        return ()
    found = [*_of_answers(log, rows), *_of_positions(log, rows)]
    return tuple(sorted(found, key=lambda breach: (breach.begin, breach.name)))


def _of_answers(log: Log, rows: IntArray) -> Iterator[Breach]:
    """Yield the bounds and the hard rows that x broke."""
    layout = log.layout
    value, lower, upper = values_and_limits(log, rows)
    over = excess(value, lower, upper)
    over[log.array("failed")[rows].astype(bool)] = 0.0
    broken = over > CLAIM_KEEPS_LIMITS * np.maximum(1.0, np.abs(value))
    state = np.zeros((len(rows), layout.width), dtype=np.int64)
    state[:, : value.shape[1]] = broken * np.where(value > upper, 1, -1)
    code = codes(log, rows, state)
    for i in np.flatnonzero(broken.any(axis=0)).tolist():
        for one in np.unique(code[broken[:, i], i]).tolist():
            own = code[:, i] == one
            name, side = bound_name(log, i, one), "upper" if one > 0 else "lower"
            yield _breach(log, rows, own, over[:, i], (name, side, layout.unit(i)))


def values_and_limits(log: Log, rows: IntArray) -> tuple[Array, Array, Array]:
    """Return x and the values of the hard rows, with their bounds.

    Args:
        log: The log.
        rows: Numbers of rows, (k,).

    Returns:
        Values, lower bounds and upper bounds, (k, n + hard rows) each, in the units of the rows.
    """
    layout = log.layout
    n, count, hard = layout.n, layout.row_count, int(layout.offsets[1])
    x, box, bounds = (log.array(name)[rows].astype(np.float64) for name in ("x", "box", "bounds"))
    A = log.array("A")[rows].astype(np.float64).reshape(len(rows), count, n)[:, :hard]
    value = np.hstack([x, np.einsum("kij,kj->ki", A, x)])
    lower = np.hstack([box[:, :n], bounds[:, :hard]])
    return value, lower, np.hstack([box[:, n:], bounds[:, count : count + hard]])


def _of_positions(log: Log, rows: IntArray) -> Iterator[Breach]:
    """Yield the position limits that postures left."""
    robot = log.facts.get("robot")
    if robot is None or "q" not in log.columns:
        return
    q = log.array("q")[rows].astype(np.float64)
    for k, place in enumerate(robot["position_index"]):
        if place < 0:
            continue
        for side, sign in (("lower", -1.0), ("upper", 1.0)):
            limit = robot[f"position_{side}"][k]
            if limit is not None:
                over = sign * (q[:, place] - limit)
                named = f"position/{robot['velocities'][k]}", side, robot["units"][k]
                if (over > SHOWN_VIOLATION).any():
                    yield _breach(log, rows, over > SHOWN_VIOLATION, over, named)


def _breach(log: Log, rows: IntArray, own: Mask, over: Array, named: tuple[str, str, str]) -> Breach:
    """Return a limit that was broken at some ticks."""
    steps, t = log.array("dt")[rows].astype(np.float64), log.t[rows]
    worst = int(np.argmax(np.where(own, over, -np.inf)))
    name, side, unit = named
    return Breach(
        name, side, float(t[own][0]), float(steps[own].sum()), float(over[worst]), float(t[worst]), unit
    )
