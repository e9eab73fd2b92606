"""Distances to obstacles and between links: lines between nearest points, and plots over time."""

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.tolerances import SHOWN_VIOLATION
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.palette import (
    ACTIVE_LABEL,
    LIMIT_LINE,
    NEAR,
    UPPER,
    VIOLATED,
    Colours,
    colours,
    line_colours,
    resolver_colour,
)
from taskopt.recording.viewer.paths import least_distance_path, margin_path, pair_path, world_path
from taskopt.recording.viewer.plots import draw_lines
from taskopt.recording.viewer.writer import RecordingWriter

_PLOT_PERIOD = 0.01  # [s] between two points of a plot
_DETAIL_PERIOD = 0.04  # [s] between two drawings of the nearest points
_SHOWN = 3  # largest number of pairs of each limit that are drawn at a time
_LEAST_WIDTH = 3.0  # of the line of the least distance [points]


class Clearance:
    """Draw the nearest points at 25 Hz, and a plot at 100 Hz for each distance limit.

    A pair of bodies gets a line in the plot once it is one of the nearest pairs and within the influence of
    its limit, because only a few of all pairs ever come that near.
    """

    def __init__(self, info: RunInfo) -> None:
        """Find the distance limits.

        Args:
            info: The facts about the run.
        """
        self._resolvers, self._dt = info.resolvers, info.scenario.dt
        self._limits = info.plan.distance_limits
        self._opened: dict[str, set[int]] = {}  # pairs with a line, by the path of the least distance

    def draw(self, writer: RecordingWriter) -> None:
        """Send names and colours of the plots, and the width of the lines in the scene.

        Args:
            writer: The recording.
        """
        points = rr.Radius.ui_points
        for limit in self._limits:
            draw_lines(writer, margin_path(limit), ["margin"], colours(LIMIT_LINE))
            for index, name in enumerate(self._resolvers):
                paint = colours(resolver_colour(index))
                draw_lines(writer, least_distance_path(name, limit), [f"{name}: least"], paint, _LEAST_WIDTH)
                path = world_path(name, "distance", limit)
                writer.log_static(path, rr.LineStrips3D.from_fields(radii=points(2.5)))
                writer.log_static(f"{path}/witness", rr.Points3D.from_fields(radii=points(4.0)))
                label = rr.Points3D.from_fields(radii=points(0.1), show_labels=True)
                writer.log_static(f"{path}/least", label)

    def send(self, writer: RecordingWriter, batch: Batch) -> None:
        """Send distances and nearest points.

        Args:
            writer: The recording.
            batch: The steps that follow those of the last call for the same resolver.
        """
        plotted = batch.ticks_every(_PLOT_PERIOD, self._dt)
        drawn = batch.ticks_every(_DETAIL_PERIOD, self._dt)
        for limit in self._limits:
            if len(plotted):
                self._send_least(writer, batch, limit, plotted)
                self._send_pairs(writer, batch, limit, plotted)
            if len(drawn):
                self._send_nearest_points(writer, batch, limit, drawn)

    def _send_least(self, writer: RecordingWriter, batch: Batch, limit: str, ticks: IntArray) -> None:
        """Send the least distance of a limit, and its margin."""
        index, time = batch.index[ticks], batch.time[ticks]
        least = rr.Scalars.columns(scalars=batch.distance(limit)[ticks].min(axis=1))
        writer.send_columns(least_distance_path(batch.resolver, limit), index, time, least)
        ends = np.unique([0, len(ticks) - 1])
        margin = rr.Scalars.columns(scalars=np.full(len(ends), self._limits[limit].margin))
        writer.send_columns(margin_path(limit), index[ends], time[ends], margin)

    def _send_pairs(self, writer: RecordingWriter, batch: Batch, limit: str, ticks: IntArray) -> None:
        """Send the distances of the pairs that have a line, and open lines for pairs that come near."""
        bound, index, time = self._limits[limit], batch.index[ticks], batch.time[ticks]
        distance = batch.distance(limit)[ticks]
        near = nearest_pairs(distance, bound.influence)
        opened = self._opened.setdefault(least_distance_path(batch.resolver, limit), set())
        begins = dict.fromkeys(opened, 0) | {
            int(pair): int(near[:, pair].argmax())
            for pair in np.flatnonzero(near.any(axis=0))
            if pair not in opened
        }
        for pair, begin in sorted(begins.items(), key=lambda known: known[::-1]):
            path = pair_path(batch.resolver, limit, bound.pair_names[pair])
            if pair not in opened:
                draw_lines(writer, path, [bound.pair_names[pair]], line_colours(len(opened) + 1)[-1:])
                opened.add(pair)
            values = rr.Scalars.columns(scalars=distance[begin:, pair])
            writer.send_columns(path, index[begin:], time[begin:], values)

    def _send_nearest_points(
        self, writer: RecordingWriter, batch: Batch, limit: str, ticks: IntArray
    ) -> None:
        """Send lines between the nearest points of the nearest pairs, and the least distance as a number."""
        index, time = batch.index[ticks], batch.time[ticks]
        path, points = world_path(batch.resolver, "distance", limit), batch.witness(limit)[ticks]
        distance, paint = batch.distance(limit)[ticks], self._paint(batch, limit, ticks)
        shown = nearest_pairs(distance, self._limits[limit].influence)
        count = shown.sum(axis=1)
        lines = rr.LineStrips3D.columns(strips=points[shown].astype(np.float32), colors=paint[shown])
        writer.send_columns(path, index, time, lines.partition(count))
        ends = points[shown].reshape(-1, 3)
        dots = rr.Points3D.columns(positions=ends, colors=np.repeat(paint[shown], 2))
        writer.send_columns(f"{path}/witness", index, time, dots.partition(2 * count))
        some = np.flatnonzero(count)
        least = distance[some].argmin(axis=1)
        near = paint[some, least]
        label = rr.Points3D.columns(
            positions=points[some, least].mean(axis=1),
            colors=np.where(near == UPPER, ACTIVE_LABEL, near).astype(np.uint32),
            labels=[f"{1e3 * value:.0f} mm" for value in distance[some, least]],
        )
        writer.send_columns(f"{path}/least", index, time, label.partition(np.minimum(count, 1)))

    def _paint(self, batch: Batch, limit: str, ticks: IntArray) -> Colours:
        """Return the colours of the pairs, (k, P): violated, kept apart by an active row, or only near."""
        active = batch.held_off(limit)[ticks]
        below = batch.distance(limit)[ticks] < self._limits[limit].margins - SHOWN_VIOLATION
        return np.where(below, VIOLATED, np.where(active, UPPER, NEAR)).astype(np.uint32)


def nearest_pairs(distance: Array, influence: float) -> Mask:
    """Choose the pairs that are drawn: at each tick the three nearest of those within the influence.

    Args:
        distance: The distances, (k, P) [m].
        influence: The distance below which the limit acts [m].

    Returns:
        True for each such pair, (k, P).
    """
    out = np.zeros(distance.shape, dtype=bool)
    first = np.argsort(distance, axis=1, kind="stable")[:, :_SHOWN]
    np.put_along_axis(out, first, True, axis=1)
    return out & (distance < influence)
