"""A logged tick solved again from its data alone, with the same or another resolver, as it was or changed."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.log.ticks import LoggedTick
from taskopt.resolver.base import Resolver
from taskopt.resolver.registry import as_resolver


class Again(NamedTuple):
    """A tick that was solved again.

    Attributes:
        tick: The logged tick.
        resolution: The new answer.
        notes: Sentences on what the log does not know about the changed problem.
    """

    tick: LoggedTick
    resolution: Resolution
    notes: tuple[str, ...] = ()

    @property
    def distance(self) -> float:
        """Largest difference from what was sent, ‖x − x of the log‖∞; 0 if neither has an answer."""
        if self.tick.error and not self.resolution.claimed:
            return 0.0
        return float(np.abs(self.resolution.x - self.tick.x).max(initial=0.0))


def solve_again(
    tick: LoggedTick,
    resolver: str | Resolver | None = None,
    changes: Mapping[str, object] | None = None,
    without: Sequence[str] = (),
) -> Again:
    """Solve a logged tick again, from its hierarchy and the memory of the resolver.

    With the same version, resolver and machine, an unchanged tick gives the same answer to the last bit. A
    tick that was damped so that the robot comes to rest is solved with the same rows of damping, unless the
    problem is changed: then damping is left out, and a note says so. A relaxed tick is solved as relaxed. How
    a tick brakes whose limits exclude each other follows from no problem: if they do so again, its answer is
    that of the log.

    Args:
        tick: The tick.
        resolver: Another resolver, or its name; None for the one that answered.
        changes: New weights such as {"hand.weight": 0.1}, or {"hand.enabled": False}.
        without: Names of tasks and limits that are taken out.

    Returns:
        The new answer.

    Raises:
        UnknownName: There is no task, limit or resolver of a given name.
        InvalidValue: Only weights and `enabled` can be changed afterwards; or a weight is negative.
    """
    chosen = as_resolver(tick.resolver if resolver is None else resolver)
    memory = tick.memory if resolver is None else None
    if not changes and not without:
        damped = tick.problem_with_damping
        if damped is not None and chosen.strict:
            again = chosen(damped, tick.memory_of_damping if resolver is None else None)[0]
            return Again(tick, again.damped_from(chosen(tick.hierarchy, memory)[0]))
        if tick.values["changed"] is not None:
            relaxed = Hierarchy.view(tick.layout, tick.array("changed"), tick.norm)
            return Again(tick, chosen(relaxed)[0], ("the hard limits are those that were relaxed",))
        again = chosen(tick.hierarchy, memory)[0]
        if tick.resolution.status is Status.BRAKED and not again.claimed:
            return Again(
                tick, tick.resolution, ("its limits exclude each other again; it brakes as in the log",)
            )
        return Again(tick, again)
    hierarchy, notes = _changed(tick, changes or {}, without)
    if tick.problem_with_damping is not None:
        notes += ("the tick was damped so that the robot comes to rest; the changed one is not",)
    return Again(tick, chosen(hierarchy, memory)[0], notes)


def _changed(
    tick: LoggedTick, changes: Mapping[str, object], without: Sequence[str]
) -> tuple[Hierarchy, tuple[str, ...]]:
    """Return a changed copy of the hierarchy of a tick, and notes on what is not known."""
    hierarchy = tick.hierarchy.copy()
    for address, value in changes.items():
        name, _, attribute = address.rpartition(".")
        if attribute == "weight":
            _weigh(hierarchy, name, value)
        elif attribute == "enabled" and isinstance(value, bool):
            if not value:
                _take_out(hierarchy, name, tasks_only=True)
        else:
            raise InvalidValue(
                f"'{address}' cannot be changed in a logged tick, which has numbers of rows: only weights "
                "and `enabled` can be; for other parameters run the scenario again with --set"
            )
    notes: list[str] = []
    for name in without:
        if name in hierarchy.layout.owners[1:]:
            notes += _without_bounds(hierarchy, name, tick.array("base_box").reshape(4, -1))
        else:
            _take_out(hierarchy, name)
    return hierarchy, tuple(notes)


def _weigh(hierarchy: Hierarchy, name: str, value: object) -> None:
    """Set the weight of a task; 0 takes rows out."""
    rows = _rows(hierarchy.layout, name, tasks_only=True)
    try:
        weights = np.broadcast_to(np.asarray(value, dtype=np.float64), rows.stop - rows.start)
    except (TypeError, ValueError) as error:
        count = rows.stop - rows.start
        raise InvalidValue(f"{name}.weight must be one number or {count}, got {value!r}") from error
    if not (np.isfinite(weights) & (weights >= 0.0)).all():
        raise InvalidValue(f"{name}.weight must be finite and not negative, got {value!r}")
    out = weights == 0.0
    hierarchy.weight[rows] = np.where(out, hierarchy.weight[rows], weights)
    hierarchy.lower[rows] = np.where(out, -np.inf, hierarchy.lower[rows])
    hierarchy.upper[rows] = np.where(out, np.inf, hierarchy.upper[rows])


def _take_out(hierarchy: Hierarchy, name: str, *, tasks_only: bool = False) -> None:
    """Take the bounds of the rows of a task or limit away."""
    rows = _rows(hierarchy.layout, name, tasks_only=tasks_only)
    hierarchy.lower[rows], hierarchy.upper[rows] = -np.inf, np.inf


def _rows(layout: Layout, name: str, *, tasks_only: bool) -> slice:
    """Return the rows of a task or limit."""
    known = {block.name: block.rows for block in layout.blocks if block.level or not tasks_only}
    if name not in known:
        limits = () if tasks_only else layout.owners[1:]
        raise UnknownName(
            "task in this log" if tasks_only else "task or limit in this log", name, (*known, *limits)
        )
    return known[name]


def _without_bounds(hierarchy: Hierarchy, name: str, base: Array) -> list[str]:
    """Replace the bounds on unknowns that come from a limit by those that never depend on the posture."""
    number, notes = hierarchy.layout.owners.index(name), []
    bounds = (hierarchy.box_lower, hierarchy.box_upper)
    for side, (values, none) in enumerate(zip(bounds, (-np.inf, np.inf), strict=True)):
        own = hierarchy.owner[side] == number
        of_base = own & (base[2 + side] != number)
        values[own] = none
        values[of_base], hierarchy.owner[side][of_base] = base[side][of_base], base[2 + side][of_base]
        if own.any():
            names = [hierarchy.layout.unknowns[i] for i in np.flatnonzero(own)]
            notes.append(
                f"{'upper' if side else 'lower'} bounds of {', '.join(names)} came from {name}; of the other "
                "limits, only bounds that do not depend on the posture are known there"
            )
    return notes
