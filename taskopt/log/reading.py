"""Reading of logs: arrays with names and units, rows, and ticks made again; nothing in a log is executed.

A log is an Arrow IPC file. A complete one is read batch by batch, and only the columns that are asked for.
One that was cut off has no footer; it is read from its beginning as far as it goes.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from taskopt.arrays import AnyArray, Array, IntArray
from taskopt.errors import BadLog, InvalidValue, MissingFile, UnknownName
from taskopt.hierarchy.io import layout_of
from taskopt.hierarchy.layout import Layout
from taskopt.log.batches import Batches
from taskopt.log.description import SCHEMA
from taskopt.log.provenance import Json
from taskopt.log.slots import PERIOD
from taskopt.log.ticks import LoggedTick


@dataclass(frozen=True, eq=False)
class LogEnd:
    """How a log ended.

    Attributes:
        end: "finished", "interrupted", or "cut off" if the loop's process ended without closing it.
        why: The error or the signal that interrupted it; "" for none.
        waits: Ticks at which the loop had to wait for the writer.
        waited: Time that it waited [s].
    """

    end: str
    why: str = ""
    waits: int = 0
    waited: float = 0.0


class Change(NamedTuple):
    """A change of a parameter that was set while a loop ran.

    Attributes:
        row: Row of the tick that applied it.
        t: Time of that tick [s].
        name: Address of the parameter.
        before: Its value before, as plain data.
        after: The value to which it was set, as plain data; a target that moves as its text.
        over: Time over which it is blended [s]; 0 for at once.
    """

    row: int
    t: float
    name: str
    before: Json
    after: Json
    over: float

    @staticmethod
    def read(row: int, t: float, line: str) -> "Change":
        """Read a line of JSON that `words` wrote."""
        told = json.loads(line)
        if "left_out" in told:
            return Change(row, t, f"{told['left_out']} more, for which a slot has no room", None, None, 0.0)
        return Change(row, t, told["name"], told["before"], told["after"], told["over_s"])

    def __str__(self) -> str:
        values = "" if self.after is None else f": {_short(self.before)} → {_short(self.after)}"
        return f"{self.name}{values}{f', over {self.over:g} s' if self.over else ''}"


class Log:
    """A log that was opened for reading, see `open_log`.

    Args:
        path: The file.

    Attributes:
        path: The file.
        end: How the log ended.
        facts: The metadata as plain data: robot, scenario, tasks, tolerances, versions, machine.
        layout: Names and sizes of the declared hierarchies.
        damped: Layout of the problems with damping at rest; None if there are none.

    Raises:
        MissingFile: There is no such file.
        BadLog: The file is no log, or one of a newer version.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise MissingFile(f"no log at {self.path}; Controller(..., log=PATH) writes one")
        self._batches = Batches(self.path)
        schema = self._batches.schema
        metadata = schema.metadata or {}
        if b"taskopt" not in metadata:
            raise BadLog(f"{self.path} is an Arrow file, but no log of taskopt")
        self.facts: Mapping[str, Any] = json.loads(metadata[b"taskopt"])
        if self.facts["schema"] > SCHEMA:
            raise BadLog(
                f"{self.path} has schema {self.facts['schema']}, and this version reads schemas up to "
                f"{SCHEMA}; update taskopt"
            )
        self._schema: pa.Schema = schema
        self.layout: Layout = layout_of(metadata[b"taskopt.layout"].decode())
        damped = metadata.get(b"taskopt.damped")
        self.damped: Layout | None = None if damped is None else layout_of(damped.decode())
        self.end = self._ended()
        self._starts = np.cumsum([0, *self._batches.sizes])

    def __len__(self) -> int:
        return int(self._starts[-1])

    def __repr__(self) -> str:
        what = f"{len(self)} ticks of {', '.join(self.resolvers)}"
        return f"<Log {self.path}: {what}{'; ' if self.missing else ''}{self.missing}>"

    @property
    def missing(self) -> str:
        """A sentence on what is missing, as after a kill; "" if the log is complete."""
        if self._batches.end is None:
            cut = self._batches.cut
            torn = f", of which the last {cut} bytes are no whole batch" if cut else ""
            return (
                f"the writing of the file was cut off{torn}; {len(self)} ticks are here, and those of the "
                f"last {PERIOD:g} s before that may be missing"
            )
        if self.end.end == "cut off":
            return "its program ended without closing the log; all ticks that it had recorded are here"
        return ""

    @property
    def resolvers(self) -> tuple[str, ...]:
        """Names of the resolvers."""
        return tuple(resolver["name"] for resolver in self.facts["resolvers"])

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns."""
        return tuple(self._schema.names)

    def names(self, column: str) -> tuple[str, ...]:
        """Return the names of the entries of a column that has lists.

        Args:
            column: Name of the column.

        Returns:
            The names; empty where there are none.

        Raises:
            UnknownName: There is no such column.
        """
        return tuple(json.loads(self._about(column).get(b"names", b"[]")))

    def unit(self, column: str) -> str:
        """Return the unit of a column.

        Args:
            column: Name of the column.

        Returns:
            The unit; one for each entry, separated by commas, where they differ; "" for plain numbers.

        Raises:
            UnknownName: There is no such column.
        """
        return self._about(column).get(b"unit", b"").decode()

    def array(self, column: str, resolver: str | None = None) -> AnyArray:
        """Return a column as an array.

        Args:
            column: Name of the column, such as "q".
            resolver: Only the ticks of this resolver; None for all rows.

        Returns:
            (k,), or (k, m) for a column of lists; objects where rows may have no value.

        Raises:
            UnknownName: There is no such column, or no such resolver.
        """
        self._about(column)
        values = self._batches.column(column)
        return values if resolver is None else values[self.rows(resolver)]

    def rows(self, resolver: str) -> IntArray:
        """Return the rows of one resolver.

        Args:
            resolver: Its name.

        Returns:
            Their numbers, (k,).

        Raises:
            UnknownName: There is no such resolver.
        """
        if resolver not in self.resolvers:
            raise UnknownName("resolver in this log", resolver, self.resolvers)
        return np.flatnonzero(self.array("resolver") == resolver)

    def changes(self, resolver: str | None = None) -> list[Change]:
        """Return the changes of parameters that were set while the loop ran, in their order.

        Args:
            resolver: Only the ticks of this resolver; None for all rows.

        Returns:
            The changes; none for a log that was written before logs had them.

        Raises:
            UnknownName: There is no such resolver.
        """
        if "changes" not in self.columns:
            return []
        told = self.array("changes")
        rows = np.arange(len(self)) if resolver is None else self.rows(resolver)
        return [
            Change.read(row, float(self.t[row]), line) for row in rows.tolist() for line in told[row] or ()
        ]

    @cached_property
    def t(self) -> Array:
        """Times of the rows, (k,) [s]."""
        return self.array("t").astype(np.float64)

    def at(self, t: float, resolver: str | None = None) -> int:
        """Find the last row at or before a time.

        Args:
            t: Time [s].
            resolver: Name of the resolver; None for the first one.

        Returns:
            The number of the row.

        Raises:
            InvalidValue: The time is not within the log.
        """
        rows = self.rows(resolver or self.resolvers[0])
        times = self.t[rows]
        step = float(self.array("dt")[rows[-1]]) if len(rows) else 0.0
        if not len(rows) or not times[0] - 0.5 * step <= t <= times[-1] + step:
            there = f"from {times[0]:g} to {times[-1]:g} s" if len(rows) else "no tick"
            raise InvalidValue(f"{t:g} s is not in {self.path}, which has {there}")
        return int(rows[max(0, int(np.searchsorted(times, t + 1e-3 * step, side="right")) - 1)])

    def tick(self, row: int) -> LoggedTick:
        """Make a tick again: its hierarchy, the memory of the resolver, and its answer, to the last bit.

        Args:
            row: Number of the row; negative numbers count from the end.

        Returns:
            The tick.

        Raises:
            InvalidValue: There is no such row.
        """
        if not -len(self) <= row < len(self):
            raise InvalidValue(f"no row {row} in {self.path}, which has {len(self)}")
        row %= len(self)
        batch = int(np.searchsorted(self._starts, row, side="right")) - 1
        values = self._batches.batch(batch).slice(row - int(self._starts[batch]), 1).to_pydict()
        norm = np.array(self.facts["norm"], dtype=np.float64)
        chosen = {name: value[0] for name, value in values.items()}
        return LoggedTick(row, chosen, self.layout, self.damped, norm)

    def table(self) -> pa.Table:
        """Return all rows as a table of Arrow, which pandas, polars and DuckDB read."""
        return self._batches.table()

    def _about(self, column: str) -> Mapping[bytes, bytes]:
        """Return unit, names and description of a column."""
        if column not in self._schema.names:
            raise UnknownName("column", column, self._schema.names)
        return self._schema.field(column).metadata or {}

    def _ended(self) -> LogEnd:
        """Read how the log ended from its last batch, which is empty."""
        if self._batches.end is None:
            return LogEnd("cut off")
        told = json.loads(self._batches.end)
        return LogEnd(told["end"].replace("_", " "), told["message"], told["waits"], told["waited_s"])


def open_log(path: str | Path) -> Log:
    """Open a log for reading; nothing in it is executed.

    Args:
        path: The file; or a folder, of which the newest log is taken, at any depth.

    Returns:
        The log. If it was cut off, it has all whole batches, and `missing` says what is not there.

    Raises:
        MissingFile: There is no log at the path.
        BadLog: The file is no log, or one of a newer version.
    """
    place = Path(path)
    if place.is_dir():
        logs = sorted(place.rglob("*.arrow"), key=lambda file: file.stat().st_mtime_ns)
        if not logs:
            raise MissingFile(f"no log in {place}; a log is a file that ends in .arrow")
        place = logs[-1]
    return Log(place)


def _short(value: Json) -> str:
    """Return a value in few words; the numbers of an array of rows by row."""
    if isinstance(value, bool) or not isinstance(value, float | list):
        return str(value)
    return f"{value:.6g}" if isinstance(value, float) else f"[{', '.join(map(_short, value))}]"
