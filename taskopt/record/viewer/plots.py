"""The plots of a run: vectors over time, one column of the recording each."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.drawable_text import drawable
from taskopt.record.viewer.palette import (
    LIMIT_LINE,
    colours,
    joint_colours,
    part,
    resolver_colour,
    short,
    slug,
)
from taskopt.record.viewer.writer import Stage
from taskopt.record.violation import LimitGauge

OBJECTIVE = 0.01  # [s] between two values of an objective
UNITS = ("m", "rad")
PROOF = -8.0  # log10 of the largest residual that is a proof
_FLOOR = 1e-17  # where a logarithm starts


def of(resolver: str, *parts: str) -> str:
    """Entity path of a resolver's data."""
    return "/".join((f"/resolver/{slug(resolver)}", *(part(p) for p in parts)))


def compared(resolver: str) -> str:
    """Entity path of the difference between a resolver's answer and its closed form."""
    return f"/compare/{slug(resolver)}-closed_form/v"


@dataclass(frozen=True, eq=False)
class ObjectiveTerm:
    """One named term of what a gradient task climbs."""

    task: str
    name: str
    objective: Any


class Series:
    """All plots of a run; `draw` names and colours the lines, `send` appends a batch."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        self._info, self._gauge = info, gauge
        robot = info.scenario.robot
        names = np.array(short(robot.velocity_names))
        self._joints = {"q_normalised": names[gauge.moving], "v_normalised": names[gauge.fast]}
        self._at = Configuration(robot, info.scenario.start)
        self.terms = objective_terms(info)

    def draw(self, stage: Stage) -> None:
        robot = self._info.scenario.robot
        for index, name in enumerate(self._info.resolvers):
            colour = resolver_colour(index)
            for key, joints in self._joints.items():
                _lines(stage, of(name, key), list(joints), self._paint(joints))
            _lines(stage, of(name, "v"), list(robot.velocity_names), joint_colours(robot.nv))
            limited = [line for line, _ in priced_lines(self._info)]
            _lines(stage, of(name, "multiplier"), limited, joint_colours(len(limited)))
            for task in self._info.plan.tasks:
                _lines(stage, of(name, "task", task.name, "error"), list(task.row_names), None)
                for unit in UNITS:
                    _lines(
                        stage, of(name, "task", task.name, unit), [f"{name}: {task.name}"], colours(colour)
                    )
            for term in self.terms:
                _lines(
                    stage,
                    of(name, "objective", term.task, term.name),
                    [f"{name}: {term.name}"],
                    colours(colour),
                )
            for path in (of(name, "certificate"), of(name, "timing"), of(name, "beyond"), compared(name)):
                _lines(stage, path, [name], colours(colour))
        _lines(stage, "/scale/range", ["lower limit", "upper limit"], colours(LIMIT_LINE, LIMIT_LINE))
        _lines(stage, "/scale/proof", ["a proof is below"], colours(LIMIT_LINE))

    def send(self, stage: Stage, batch: Batch) -> None:
        import rerun as rr

        at, time, name = batch.index, batch.time, batch.resolver

        def plot(path: str, rows: Array) -> None:
            if rows.size:
                stage.columns(path, at, time, rr.Scalars.columns(scalars=rows))

        plot(of(name, "q"), batch.q)
        plot(of(name, "v"), batch.v)
        plot(of(name, "q_normalised"), self._gauge.position_share(batch.q))
        plot(of(name, "v_normalised"), self._gauge.velocity_share(batch.v))
        lines = [_extreme(batch.price[:, rows]) for _, rows in priced_lines(self._info)]
        plot(of(name, "multiplier"), np.column_stack(lines))
        for task in self._info.plan.tasks:
            error = np.where(batch.in_force(task.name)[:, None], batch.error(task.name), np.nan)
            plot(of(name, "task", task.name, "error"), error)
            for unit in UNITS:
                rows = rows_in(task, unit)
                if rows.any():
                    plot(of(name, "task", task.name, unit), np.linalg.norm(error[:, rows], axis=1))
        plot(of(name, "certificate"), _log10(batch.worst))
        plot(of(name, "timing"), 1e6 * batch.seconds)
        plot(of(name, "beyond"), self._gauge.position_violation(batch))
        plot(compared(name), _log10(batch.twin_distance))
        self._objectives(stage, batch)
        ends = [0, -1] if len(at) > 1 else [0]
        for path, level in (("/scale/range", [-1.0, 1.0]), ("/scale/proof", [PROOF])):
            lines = rr.Scalars.columns(scalars=np.tile(level, (len(ends), 1)))
            stage.columns(path, at[ends], time[ends], lines)

    def _objectives(self, stage: Stage, batch: Batch) -> None:
        import rerun as rr

        pick = batch.every(OBJECTIVE, self._info.scenario.dt)
        if not self.terms or not len(pick):
            return
        values = np.empty((len(self.terms), len(pick)))
        for k, q in enumerate(batch.q[pick]):
            self._at.update(q)
            values[:, k] = [term.objective.value(self._at) for term in self.terms]
        for term, row in zip(self.terms, values, strict=True):
            path = of(batch.resolver, "objective", term.task, term.name)
            stage.columns(path, batch.index[pick], batch.time[pick], rr.Scalars.columns(scalars=row))

    def _paint(self, joints: Any) -> Any:
        """Colours by joint, the same in every plot."""
        every = short(self._info.scenario.robot.velocity_names)
        return joint_colours(len(every))[[every.index(joint) for joint in joints]]


def rows_in(task: Any, unit: str) -> Any:
    """Which rows of a task's error are in a unit; the rows themselves are rates."""
    return np.array([row.removesuffix("/s") == unit for row in task.row_units], dtype=bool)


def limit_rows(info: RunInfo) -> Any:
    """(n + M,) the rows that can have a price: bounds, hard rows, inequalities."""
    layout = info.plan.layout
    rows = np.zeros(layout.n + layout.row_count, dtype=bool)
    rows[: layout.n + int(layout.offsets[1])] = True
    h = info.plan.hierarchy
    rows[layout.n :] |= h.lower < h.upper
    return rows


def priced_lines(info: RunInfo) -> list[tuple[str, IntArray]]:
    """Names of the lines in the plot of multipliers, and the rows (of n + M) that each stands for.

    All pairs of a limit that keeps distances share one line, and come first.
    """
    layout, lines = info.plan.layout, dict[str, list[int]]()
    pooled = pair_rows(info)
    names = [*short(layout.unknowns), *layout.row_names]
    lines |= {name: [] for name in pooled.values()}
    for row in np.flatnonzero(limit_rows(info)).tolist():
        lines.setdefault(pooled.get(row, names[row]), []).append(row)
    return [(name, np.array(rows)) for name, rows in lines.items()]


def pair_rows(info: RunInfo) -> dict[int, str]:
    """The rows (of n + M) that hold a pair apart, with the name of their limit."""
    layout = info.plan.layout
    return {
        layout.n + row: block.name
        for block in layout.blocks
        if block.level == 0 and block.name in info.plan.distance_limits
        for row in range(block.start, block.stop)
    }


def _extreme(prices: Array) -> Array:
    """(k,) of (k, m): the entry that is farthest from zero."""
    return np.take_along_axis(prices, np.abs(prices).argmax(axis=1, keepdims=True), axis=1)[:, 0]


def objective_terms(info: RunInfo) -> tuple[ObjectiveTerm, ...]:
    """What the stack's gradient tasks climb, term by term."""
    declared = [task for level in info.scenario.stack.levels for task in level]
    terms = []
    for task, bound in zip(declared, info.plan.tasks, strict=True):
        objective = getattr(task, "objective", None)
        if objective is None:
            continue
        parts = getattr(objective, "terms", ((1.0, objective),))
        names = [_term_name(term) for _, term in parts]
        for i, (_, term) in enumerate(parts):
            name = names[i] if names.count(names[i]) == 1 else f"{names[i]} {i + 1}"
            terms.append(ObjectiveTerm(bound.name, name, term))
    return tuple(terms)


def _term_name(objective: Any) -> str:
    frame = getattr(objective, "frame", None)
    return type(objective).__name__ + (f" {frame}" if frame else "")


def _lines(stage: Stage, path: str, names: list[str], paint: Any) -> None:
    import rerun as rr

    if names:
        stage.static(
            path, rr.SeriesLines(names=[*map(drawable, names)], colors=paint, widths=[1.5] * len(names))
        )


def _log10(values: Array) -> Array:
    return np.log10(np.clip(values, _FLOOR, 1e17))
