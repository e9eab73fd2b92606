"""The plots of a review: each vector over time is one entity, with the names and colours of its lines."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import Block, short_names
from taskopt.recording.derived.levels import Look, look, prices, singular_values
from taskopt.recording.viewer.palette import LIMIT_LINE, Colours, colours, line_colours
from taskopt.recording.viewer.paths import RANGE, data_path
from taskopt.recording.viewer.plots import draw_lines, log10
from taskopt.recording.viewer.review.arms import Arm
from taskopt.recording.viewer.writer import RecordingWriter

_SINGULAR_PERIOD = 0.01  # [s] between two points of a plot of singular values


class Plotted(NamedTuple):
    """A plot that can be laid out.

    Attributes:
        title: What it shows, with its unit.
        path: Its entity.
        lines: The number of its lines.
    """

    title: str
    path: str
    lines: int


class Series:
    """Sends the plots of one arm.

    Args:
        writer: The recording.
        arm: The arm.
        colour: Its colour, for lines that stand for all of it.
    """

    def __init__(self, writer: RecordingWriter, arm: Arm, colour: int) -> None:
        self._writer, self._arm, self._colour = writer, arm, colour
        self._joints = np.array(short_names(arm.robot.velocity_names))
        self._paint = line_colours(len(self._joints))

    def errors(self) -> list[Plotted]:
        """Send the norm of the error of each task, one entity for each unit and task.

        Returns:
            The plots, the first task first.
        """
        found = []
        for block in self._arm.answers.tasks:
            error = self._arm.answers.error(block)
            units = [unit.removesuffix("/s") for unit in block.row_units]
            for unit in dict.fromkeys(units):
                size = np.linalg.norm(error[:, [own == unit for own in units]], axis=1)
                title = f"Error of {block.name} at level {block.level} [{unit or '1'}]"
                name = f"{self._arm.name}: {block.name}"
                key = ("error", block.name, unit.replace("/", " per ") or "1")
                found.append(self._send(title, key, [name], colours(self._colour), size))
        return found

    def shares(self) -> list[Plotted]:
        """Send positions and velocities as shares of their ranges; a joint has one colour in all plots.

        Returns:
            The plot of positions and that of velocities, as far as there are limits.
        """
        found = []
        for title, key, values in (
            ("Position in its range", "position_share", self._arm.answers.position_share),
            ("Velocity in its limits", "velocity_share", self._arm.answers.velocity_share),
        ):
            known = np.isfinite(values).any(axis=0)
            if known.any():
                names, paint = self._joints[known].tolist(), self._paint[known]
                found.append(self._send(title, (key,), names, paint, values[:, known]))
        return found

    def velocities(self) -> Plotted:
        """Send the velocities in their units.

        Returns:
            The plot.
        """
        unit = ", ".join(dict.fromkeys(f"{unit}/s" for unit in self._arm.robot.coordinate_units))
        names, x = self._joints.tolist(), self._arm.answers.x
        return self._send(f"Joint velocity [{unit}]", ("v",), names, self._paint, x)

    def prices(self) -> list[Plotted]:
        """Send the prices of limits, one entity for each level.

        Returns:
            The plots, the first level first, each with its unit.
        """
        found = []
        last = self._arm.answers.log.layout.level_count
        paint = dict(zip(self._arm.robot.velocity_names, self._paint.tolist(), strict=True))
        short = dict(zip(self._arm.robot.velocity_names, self._joints.tolist(), strict=True))
        for level in prices(self._arm.answers):
            where = f"at level {level.level}" if level.level <= last else "for the norm"
            title = f"Price of limits {where} [½ {level.unit}]" if level.unit else f"Price of limits {where}"
            own = colours(*(paint.get(name, LIMIT_LINE) for name in level.names))
            names = [short.get(name, name) for name in level.names]
            found.append(self._send(title, ("price", str(level.level)), names, own, level.values))
        return found

    def singular_values(self) -> list[Plotted]:
        """Send the singular values of the rows of each task with a pose.

        Returns:
            The plots.
        """
        ticks = self._arm.answers.ticks_every(_SINGULAR_PERIOD)
        return [
            self._singular(block, ticks)
            for block in self._arm.answers.tasks
            if block.name in self._arm.frames
        ]

    def looked_at(self) -> tuple[list[Plotted], list[Plotted]]:
        """Send ranks, damping, residuals and differences from the closed form, at some ticks.

        Returns:
            The plots of ranks, and of k² if anything is damped; those of residuals and of differences.
        """
        arm, found = self._arm, look(self._arm.answers, self._arm.looks)
        levels = [f"level {level}" if level else "hard rows" for level in range(found.ranks.shape[1])]
        paint = line_colours(len(levels))
        plots = []
        if np.isfinite(found.ranks).any():
            plots.append(
                self._send("Rank of each level", ("rank",), levels, paint, found.ranks, found.places)
            )
        if np.nan_to_num(found.damping).any():
            title = "Damping k² of each level, log10"
            values = log10(found.damping)
            plots.append(self._send(title, ("damping",), levels, paint, values, found.places))
        return plots, self._proofs(arm, found)

    def solver(self) -> list[Plotted]:
        """Send solve times, where they were measured, and iterations.

        Returns:
            The plots.
        """
        answers, name, paint = self._arm.answers, [self._arm.name], colours(self._colour)
        found = []
        if np.isfinite(answers.microseconds).any():
            found.append(self._send("Solve time [µs]", ("timing",), name, paint, answers.microseconds))
        iterations = answers.column("iterations")
        return [*found, self._send("Iterations", ("iterations",), name, paint, iterations)]

    def _proofs(self, arm: Arm, found: Look) -> list[Plotted]:
        """Send the KKT residuals and the differences from the closed form."""
        name, paint = [arm.name], colours(self._colour)
        plots = [
            ("KKT residual, log10", ("residual",), found.residual),
            ("Difference from the closed form, log10 [rad/s]", ("apart",), found.apart),
        ]
        return [
            self._send(title, key, name, paint, log10(values), found.places)
            for title, key, values in plots
            if np.isfinite(values).any()
        ]

    def _singular(self, block: Block, ticks: IntArray) -> Plotted:
        """Send the singular values of one task."""
        values = singular_values(self._arm.answers, block, ticks)
        names = [f"σ{number + 1}" for number in range(values.shape[1])]
        title = f"Singular values of {block.name} at level {block.level}"
        return self._send(title, ("singular", block.name), names, line_colours(len(names)), values, ticks)

    def _send(
        self,
        title: str,
        key: tuple[str, ...],
        names: Sequence[str],
        paint: Colours,
        values: Array,
        ticks: IntArray | None = None,
    ) -> Plotted:
        """Send one entity with a line for each name; None for all ticks."""
        path = data_path(self._arm.name, *key)
        index, time = self._arm.index, self._arm.time
        if ticks is not None:
            index, time = index[ticks], time[ticks]
        draw_lines(self._writer, path, names, paint)
        self._writer.send_columns(path, index, time, rr.Scalars.columns(scalars=values))
        return Plotted(title, path, len(names))


def send_range(writer: RecordingWriter, arm: Arm) -> None:
    """Send the lines at ±1 between which shares of ranges lie.

    Args:
        writer: The recording.
        arm: The arm from whose begin to whose end they reach.
    """
    draw_lines(writer, RANGE, ["lower limit", "upper limit"], colours(LIMIT_LINE, LIMIT_LINE))
    ends = np.array([0, len(arm.index) - 1])
    lines = rr.Scalars.columns(scalars=np.tile([-1.0, 1.0], (2, 1)))
    writer.send_columns(RANGE, arm.index[ends], arm.time[ends], lines)
