"""The fields, the columns and the metadata of a log, from the stack whose ticks it has."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Protocol

from taskopt.arrays import Array
from taskopt.hierarchy import tolerances
from taskopt.hierarchy.io import names_of
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.view import answer_size
from taskopt.log.provenance import Json, commit_of, machine, now, plain, versions
from taskopt.log.slots import NUMBERS, TEXT_BYTES, Column, Field

SCHEMA = 1
"""The version of the schema. A reader opens files of its own version and of all before."""

PROBLEM = ("A", "bounds", "weight", "label", "box", "owner")
"""Columns of the declared hierarchy, in the order of its buffer."""

STATUSES = tuple(status.name for status in Status)
_POSE = tuple(f"row {i + 1}, column {j + 1}" for i in range(4) for j in range(4))


class Named(Protocol):
    """A resolver, or something else that answers."""

    @property
    def name(self) -> str:
        """Its name in the log."""
        ...


@dataclass(frozen=True)
class Description:
    """What the ticks of a log have in common.

    Attributes:
        layout: Layout of the declared hierarchies.
        norm: W of all of them, (n,) or (n, n).
        resolvers: The resolvers, in the order of their numbers.
        damped: Layout of hierarchies with rows of damping at rest; None if there are none.
        coordinates: Name of each entry of q; empty if q is not logged.
        coordinate_units: Unit of each of them.
        errors: Names and units of the rows of each task that has an error, by name of the task.
        poses: Names of the tasks that have a desired and an actual pose.
        moving: Names of the obstacles that move.
        facts: More facts for the metadata, as plain data for JSON.
    """

    layout: Layout
    norm: Array
    resolvers: tuple[Named, ...]
    damped: Layout | None = None
    coordinates: tuple[str, ...] = ()
    coordinate_units: tuple[str, ...] = ()
    errors: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = field(default_factory=dict)
    poses: tuple[str, ...] = ()
    moving: tuple[str, ...] = ()
    facts: Mapping[str, Json] = field(default_factory=dict)

    @property
    def fields(self) -> list[Field]:
        """The fields of a slot."""
        layout, damped = self.layout, self.damped
        n, levels = layout.n, layout.level_count + 1
        found = [
            Field("numbers", "<i8", len(NUMBERS)),
            Field("times", "<f8", 4),
            Field("q", "<f8", len(self.coordinates)),
            Field("v_before", "<f8", n),
            Field("x", "<f8", n),
            Field("answer", "<f8", layout.answer_size),
            Field("state", "<i1", layout.width),
            Field("memory", "<i1", 3 * layout.width),
            Field("ranks", "<i8", levels),
            Field("base", "<f8", 4 * n),
            Field("errors", "<f8", sum(len(names) for names, _ in self.errors.values())),
            Field("desired", "<f8", 16 * len(self.poses)),
            Field("actual", "<f8", 3 * len(self.poses)),
            Field("moving", "<f8", 16 * len(self.moving)),
            Field("changed", "<f8", layout.size),
            Field("text", "<u1", TEXT_BYTES),
        ]
        if damped is not None:
            found += [
                Field("damped", "<f8", damped.answer_size),
                Field("damped_state", "<i1", damped.width),
                Field("damped_memory", "<i1", 3 * damped.width),
            ]
        return found

    @property
    def columns(self) -> list[Column]:
        """The columns of the file."""
        columns = [*_counts([resolver.name for resolver in self.resolvers]), *self._motion()]
        columns += [*_problem(self.layout), *_answer(self.layout), *_memory(self.layout)]
        columns += self._tasks()
        columns += [_part("changed", "changed", self.layout.size, "changed", "relaxed problem, if answered")]
        return columns if self.damped is None else [*columns, *_damped(self.damped)]

    @property
    def metadata(self) -> dict[str, str]:
        """Text by key for the schema of the file."""
        facts: dict[str, Json] = {
            "schema": SCHEMA,
            "started": now(),
            "resolvers": [{"name": r.name, "settings": repr(r)} for r in self.resolvers],
            "norm": self.norm.tolist(),
            "tolerances": {
                name: plain(value) for name, value in sorted(vars(tolerances).items()) if name.isupper()
            },
            "tasks": list(self.errors),
            "poses": list(self.poses),
            "moving": list(self.moving),
            "python": platform.python_version(),
            "versions": versions(),
            "git_commit": commit_of(None),
            "machine": machine(),
            **self.facts,
        }
        texts = {"taskopt": json.dumps(facts), "taskopt.layout": names_of(self.layout)}
        return texts if self.damped is None else texts | {"taskopt.damped": names_of(self.damped)}

    def _motion(self) -> list[Column]:
        """Return the columns of postures and velocities."""
        layout, size = self.layout, len(self.coordinates)
        names, unit = layout.unknowns, _common(layout.unknown_units)
        before = "velocity from which limits on acceleration start, if it is not the x of the tick before"
        rate = _part("v_before", "v_before", layout.n, "given", before)
        sent = _list("x", "x", layout.n, "unknowns that were sent, as a rule velocities")
        found = [
            rate._replace(names=names, unit=unit.replace("/s²", "/s")),
            sent._replace(names=names, unit=unit),
            _list(
                "base_box", "base", 4 * layout.n, "bounds that do not depend on q: both sides, their owners"
            ),
        ]
        if not size:
            return found
        q = _list("q", "q", size, "posture, at which the rows were filled")
        return [q._replace(names=self.coordinates, unit=_common(self.coordinate_units)), *found]

    def _tasks(self) -> list[Column]:
        """Return the columns of errors and poses."""
        found = []
        sizes = [len(names) for names, _ in self.errors.values()]
        for (task, (names, units)), start in zip(
            self.errors.items(), accumulate(sizes, initial=0), strict=False
        ):
            column = Column(f"error/{task}", "errors", start, start + len(names), listed=True)
            found.append(column._replace(names=names, unit=_common(units), about="e = x_d − x, unweighted"))
        for i, task in enumerate(self.poses):
            found.append(_pose("desired", task, i, "pose that the frame should have"))
            where = _list(f"actual/{task}", "actual", 3, "where the frame is", 3 * i)
            found.append(where._replace(names=("x", "y", "z"), unit="m"))
        return found + [
            _pose("moving", name, i, "pose of the obstacle") for i, name in enumerate(self.moving)
        ]


def _common(units: Sequence[str]) -> str:
    """Return the unit that all have in common, else all of them."""
    found = list(dict.fromkeys(units))
    return found[0] if len(found) == 1 else ", ".join(units)


def _number(name: str, about: str, place: str = "", unit: str = "") -> Column:
    """Return a column of one of the integers of a slot."""
    index = NUMBERS.index(place or name)
    return Column(name, "numbers", index, index + 1, unit=unit, about=about)


def _list(name: str, source: str, size: int, about: str, start: int = 0) -> Column:
    """Return a column of lists."""
    return Column(name, source, start, start + size, listed=True, about=about)


def _part(name: str, source: str, size: int, when: str, about: str, start: int = 0) -> Column:
    """Return a column of lists that only some rows have."""
    return _list(name, source, size, about, start)._replace(when=when)


def _pose(kind: str, name: str, index: int, about: str) -> Column:
    """Return the column of a pose."""
    column = _list(f"{kind}/{name}", kind, 16, f"{about} in the world, (4, 4) row by row", 16 * index)
    return column._replace(names=_POSE, unit="m")


def _counts(resolvers: Sequence[str]) -> list[Column]:
    """Return the columns of times, claims and sentences."""
    times = [
        ("t", "s", "", "time of the tick"),
        ("dt", "s", "", "time until the next tick"),
        ("seconds", "s", "timed", "time in the resolver, where it was measured"),
        ("build_seconds", "s", "timed", "time for kinematics and rows, where it was measured"),
    ]
    timed = [
        Column(name, "times", i, i + 1, when=when, unit=unit, about=about)
        for i, (name, unit, when, about) in enumerate(times)
    ]
    return [
        _number("tick", "number of the tick, from 0"),
        *timed,
        _number("clock", "wall-clock time since the log was opened", unit="ns"),
        _number("resolver", "name of the resolver")._replace(words=tuple(resolvers)),
        _number("status", "claim of the resolver, see taskopt.Status")._replace(words=STATUSES),
        _number("iterations", "iterations or factorisations"),
        _number("failed", "true if the tick raised an error, so that nothing was sent", unit="flag"),
        Column("error", "text", 0, 1, about="the error that the tick raised"),
        Column("notes", "text", 0, 1, listed=True, about="sentences on the answer, as on a conflict"),
        Column("changes", "text", 0, 1, listed=True, about="changes of parameters, each as JSON"),
        Column("fallback", "text", 0, 1, about="method that answered because the resolver failed"),
    ]


def _problem(layout: Layout) -> list[Column]:
    """Return the columns of the declared hierarchy, in the order of its buffer."""
    n, rows = layout.n, layout.row_count
    start = layout.answer_size - layout.size
    units = tuple(unit for block in layout.blocks for unit in block.row_units)

    def both(names: tuple[str, ...]) -> tuple[str, ...]:
        """Return names for lower bounds, then for upper bounds."""
        return (*(f"{name} lower" for name in names), *(f"{name} upper" for name in names))

    parts = [
        (rows * n, "rows, (M, n) row by row", (), ()),
        (2 * rows, "lower bounds of the rows, then upper bounds", both(layout.row_names), units * 2),
        (rows, "weights of the rows", layout.row_names, ()),
        (rows, "number of the name of each row among the choices of its block; 0 for its own", (), ()),
        (2 * n, "bounds of the unknowns", both(layout.unknowns), layout.unknown_units * 2),
        (2 * n, "number of the limit behind each of these bounds", both(layout.unknowns), ()),
    ]
    found = []
    for name, (size, about, names, unit) in zip(PROBLEM, parts, strict=True):
        column = _list(name, "answer", size, about, start)
        found.append(column._replace(names=tuple(names), unit=_common(unit)))
        start += size
    return found


def _answer(layout: Layout) -> list[Column]:
    """Return the columns of the answer to the declared hierarchy."""
    n, levels = layout.n, layout.level_count + 1
    names = (*layout.unknowns, *layout.row_names)
    price = "multipliers by level, the norm last, (L + 1, n + M) row by row"
    return [
        _list("multipliers", "answer", levels * layout.width, price, n),
        _number("foreign", "true if the answer is to a problem of another layout", unit="flag"),
        _list("state", "state", layout.width, "active set: −1 lower, 0 free, 1 upper")._replace(names=names),
        _part("undamped_x", "answer", n, "damped", "the answer without damping"),
        _number("undamped_status", "claim of the resolver for the answer without damping")._replace(
            words=STATUSES
        ),
        _number("undamped_iterations", "its iterations"),
    ]


def _memory(layout: Layout) -> list[Column]:
    """Return the columns of the memory with which the resolver began."""
    width, levels = layout.width, layout.level_count + 1
    return [
        _part("memory_state", "memory", width, "remembers", "active set that the tick began with"),
        _part("memory_previous", "memory", width, "has_previous", "active set of the tick before", width),
        _number("memory_alternates", "true if the two alternate", "alternates", "flag"),
        _part("memory_ranks", "ranks", levels, "has_ranks", "ranks of the levels, the hard rows first"),
        _number("memory_rank_count", "number of ranks that count", "has_ranks"),
    ]


def _damped(layout: Layout) -> list[Column]:
    """Return the columns of ticks that were damped, so that the robot comes to rest."""
    n, rows, levels, width = layout.n, layout.row_count, layout.level_count, layout.width
    size = answer_size(n, rows, levels)
    return [
        _part("damped", "damped", size, "damped", "answer to the problem with damping, and that problem"),
        _part("damped_state", "damped_state", width, "damped", "its active set"),
        _part("damped_memory_state", "damped_memory", width, "damped_remembers", "memory of its last solve"),
        _part("damped_memory_previous", "damped_memory", width, "damped_has_previous", "the same", width),
        _number("damped_memory_alternates", "the same", "damped_alternates", "flag"),
    ]
