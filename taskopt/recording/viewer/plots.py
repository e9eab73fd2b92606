"""The plots of a run: vectors over time, each of which is one entity of the recording."""

from collections.abc import Iterable, Sequence

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import short_names
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.kinematics.configuration import Configuration
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.palette import LIMIT_LINE, Colours, colours, line_colours, resolver_colour
from taskopt.recording.viewer.paths import PROOF, RANGE, closed_form_path, data_path
from taskopt.recording.viewer.rows import limit_rows, objective_terms, pair_rows, rows_in_unit
from taskopt.recording.viewer.writer import RecordingWriter
from taskopt.recording.violation import LimitGauge

UNITS = ("m", "rad")  # of task errors, one plot each
_OBJECTIVE_PERIOD = 0.01  # [s] between two points of the plot of an objective
_DECADES = (-17.0, 17.0)  # ends of a plot of log10, at which 0 and inf are drawn
_WIDTH = 1.5  # of a line [points]


class Plots:
    """Draw all vectors of a run except distances: `draw` names and colours the lines, `send` appends rows."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        """Find the lines of the plots.

        Args:
            info: The facts about the run.
            gauge: The limits of the run, which scale positions and velocities.
        """
        self._info, self._gauge = info, gauge
        robot = info.scenario.robot
        self._joints = {"q_normalised": gauge.ranged, "v_normalised": gauge.bounded}
        self._answers = ("v", "a") if info.accelerates else ("v",)
        if info.accelerates:
            self._joints["a_normalised"] = gauge.accelerations_bounded
        self._joint_names = np.array(short_names(robot.velocity_names))
        self._multipliers = multiplier_lines(info)
        self._configuration = Configuration(robot, info.scenario.start)
        self._terms = objective_terms(info)

    def draw(self, writer: RecordingWriter) -> None:
        """Send the names and colours of all lines.

        Args:
            writer: The recording.
        """
        for index, name in enumerate(self._info.resolvers):
            self._draw_joints(writer, name)
            self._draw_tasks(writer, name, resolver_colour(index))
            scalars = ("error_bound", "kkt_residual", "timing", "position_violation")
            for path in (*(data_path(name, key) for key in scalars), closed_form_path(name)):
                draw_lines(writer, path, [name], colours(resolver_colour(index)))
        draw_lines(writer, RANGE, ["lower limit", "upper limit"], colours(LIMIT_LINE, LIMIT_LINE))
        draw_lines(writer, PROOF, ["proven below"], colours(LIMIT_LINE))

    def send(self, writer: RecordingWriter, batch: Batch) -> None:
        """Append a batch to all plots of its resolver.

        Args:
            writer: The recording.
            batch: Consecutive steps of one resolver.
        """
        vectors = {
            "q": batch.q,
            "v": batch.v,
            "q_normalised": self._gauge.position_share(batch.q),
            "v_normalised": self._gauge.velocity_share(batch.v),
            "multiplier": self._multiplier_columns(batch),
            "kkt_residual": log10(batch.kkt_residual),
            "timing": 1e6 * batch.seconds,
            "position_violation": self._gauge.position_violation(batch),
        }
        if self._info.accelerates:
            vectors |= {"a": batch.x, "a_normalised": self._gauge.acceleration_share(batch.x)}
        for key, rows in vectors.items():
            _send_rows(writer, data_path(batch.resolver, key), batch, rows)
        _send_rows(writer, closed_form_path(batch.resolver), batch, log10(batch.closed_form_distance))
        _send_bounds(writer, batch)
        self._send_errors(writer, batch)
        self._send_objectives(writer, batch)
        ends = np.unique([0, len(batch.index) - 1])
        for path, level in ((RANGE, [-1.0, 1.0]), (PROOF, [np.log10(ACCURACY)])):
            lines = rr.Scalars.columns(scalars=np.tile(level, (len(ends), 1)))
            writer.send_columns(path, batch.index[ends], batch.time[ends], lines)

    def _draw_joints(self, writer: RecordingWriter, resolver: str) -> None:
        """Name the lines of one resolver; a joint has the same colour in every plot."""
        robot = self._info.scenario.robot
        paint = line_colours(robot.nv)
        for key, shown in self._joints.items():
            draw_lines(writer, data_path(resolver, key), self._joint_names[shown].tolist(), paint[shown])
        for key in self._answers:
            draw_lines(writer, data_path(resolver, key), robot.velocity_names, paint)
        names = list(self._multipliers)
        draw_lines(writer, data_path(resolver, "multiplier"), names, line_colours(len(names)))

    def _draw_tasks(self, writer: RecordingWriter, resolver: str, colour: int) -> None:
        """Name the lines of errors and objectives, in the colour of their resolver."""
        for task in self._info.plan.tasks:
            draw_lines(writer, data_path(resolver, "task", task.name, "error"), task.row_names, None)
            for unit in UNITS:
                path = data_path(resolver, "task", task.name, unit)
                draw_lines(writer, path, [f"{resolver}: {task.name}"], colours(colour))
        for term in self._terms:
            path = data_path(resolver, "objective", term.task, term.name)
            draw_lines(writer, path, [f"{resolver}: {term.name}"], colours(colour))

    def _multiplier_columns(self, batch: Batch) -> Array:
        """Return for each line the multiplier that is farthest from zero among its rows, (k, lines)."""
        columns = []
        for rows in self._multipliers.values():
            values = batch.multiplier[:, rows]
            largest = np.abs(values).argmax(axis=1, keepdims=True)
            columns.append(np.take_along_axis(values, largest, axis=1)[:, 0])
        return np.column_stack(columns)

    def _send_errors(self, writer: RecordingWriter, batch: Batch) -> None:
        """Append errors and their norms by unit, with gaps while a task is not in force."""
        for task in self._info.plan.tasks:
            error = np.where(batch.in_force(task.name)[:, None], batch.error(task.name), np.nan)
            _send_rows(writer, data_path(batch.resolver, "task", task.name, "error"), batch, error)
            for unit in UNITS:
                rows = rows_in_unit(task, unit)
                if rows.any():
                    path = data_path(batch.resolver, "task", task.name, unit)
                    _send_rows(writer, path, batch, np.linalg.norm(error[:, rows], axis=1))

    def _send_objectives(self, writer: RecordingWriter, batch: Batch) -> None:
        """Append the values of the objectives, only at 100 Hz because they need additional kinematics."""
        ticks = batch.ticks_every(_OBJECTIVE_PERIOD, self._info.scenario.dt)
        if not self._terms or not len(ticks):
            return
        values = np.empty((len(self._terms), len(ticks)))
        for k, q in enumerate(batch.q[ticks]):
            self._configuration.update(q)
            values[:, k] = [term.objective.value(self._configuration) for term in self._terms]
        for term, row in zip(self._terms, values, strict=True):
            path = data_path(batch.resolver, "objective", term.task, term.name)
            scalars = rr.Scalars.columns(scalars=row)
            writer.send_columns(path, batch.index[ticks], batch.time[ticks], scalars)


def multiplier_lines(info: RunInfo) -> dict[str, IntArray]:
    """Choose the lines of the plot of multipliers.

    Args:
        info: The facts about the run, whose hierarchy has n unknowns and M rows.

    Returns:
        For each line its name and the indices (among n + M) of its rows. All pairs of a distance limit share
        one line; these lines come first.
    """
    layout, pooled = info.plan.layout, pair_rows(info)
    names = [*short_names(layout.unknowns), *layout.row_names]
    lines: dict[str, list[int]] = {name: [] for name in pooled.values()}
    for row in np.flatnonzero(limit_rows(info)).tolist():
        lines.setdefault(pooled.get(row, names[row]), []).append(row)
    return {name: np.array(rows) for name, rows in lines.items()}


def draw_lines(
    writer: RecordingWriter, path: str, names: Sequence[str], paint: Colours | None, width: float = _WIDTH
) -> None:
    """Name and colour the lines of an entity; nothing is sent for no lines.

    Args:
        writer: The recording.
        path: The entity path, whose rows have one number for each line.
        names: The names of the lines, (m,).
        paint: The colours of the lines, (m,); None leaves them to the viewer.
        width: The width of the lines [points].
    """
    if len(names):
        words: Iterable[str] = map(drawable, names)
        writer.log_static(path, rr.SeriesLines(names=[*words], colors=paint, widths=[width] * len(names)))


def _send_rows(writer: RecordingWriter, path: str, batch: Batch, rows: Array) -> None:
    """Append one row of numbers for each tick of a batch; nothing is sent for rows of no numbers."""
    if rows.size:
        writer.send_columns(path, batch.index, batch.time, rr.Scalars.columns(scalars=rows))


def _send_bounds(writer: RecordingWriter, batch: Batch) -> None:
    """Append log10 of the largest error bound relative to max(1, |x|), at the ticks that are judged."""
    ticks = np.flatnonzero(batch.judged)
    if len(ticks):
        bound = (batch.error_bound[ticks] / np.maximum(1.0, np.abs(batch.x[ticks]))).max(axis=1)
        lines = rr.Scalars.columns(scalars=log10(bound))
        path = data_path(batch.resolver, "error_bound")
        writer.send_columns(path, batch.index[ticks], batch.time[ticks], lines)


def log10(values: Array) -> Array:
    """Return log10 of numbers, cut to the range that is drawn.

    Args:
        values: Numbers ≥ 0; NaN stays NaN.

    Returns:
        The logarithms.
    """
    return np.log10(np.clip(values, 10.0 ** _DECADES[0], 10.0 ** _DECADES[1]))
