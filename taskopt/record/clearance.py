"""How near the robot is to what it must not touch: lines between witness points, and distances over time."""

from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.record.batch import Batch, Mask
from taskopt.record.obstacle3d import declared_obstacles, draw_obstacles
from taskopt.record.palette import BROKEN, LIMIT_LINE, NEAR, UPPER, colours, part, resolver_colour, slug
from taskopt.record.place import Place
from taskopt.record.recorder import RunInfo
from taskopt.record.series import of
from taskopt.record.stage import Stage

PLOT = 0.01  # [s] between two points of a plot
DETAIL = 0.04  # [s] between two drawings of the witness points
_SHOWN = 3  # pairs of each limit that are drawn at a time, the nearest ones


def margin_line(limit: str) -> str:
    """Entity path of the margin of a distance limit."""
    return f"/scale/margin/{part(limit)}"


class Clearance:
    """Obstacles, witness points at 25 Hz, and a plot for each limit that keeps distances.

    A pair has a line in the plot from when it is first one of the nearest, within the influence of its
    limit: of fifty pairs five may ever matter.
    """

    def __init__(self, info: RunInfo, place: Place) -> None:
        self._info, self._place = info, place
        self._obstacles = declared_obstacles(info)
        self._limits = info.plan.distance_limits
        self._rows = {block.name: block.rows for block in info.plan.layout.blocks}
        self._opened: set[str] = set()

    def draw(self, stage: Stage) -> None:
        import rerun as rr

        for index, name in enumerate(self._info.resolvers):
            draw_obstacles(stage, f"/world/{slug(name)}/obstacle", self._obstacles, self._place)
            colour = resolver_colour(index)
            for limit in self._limits:
                line = rr.SeriesLines(names=[f"{name}: least"], colors=colours(colour), widths=[3.0])
                stage.static(of(name, "least_distance", limit), line)
        for limit in self._limits:
            line = rr.SeriesLines(names=["margin"], colors=colours(LIMIT_LINE), widths=[1.5])
            stage.static(margin_line(limit), line)

    def send(self, stage: Stage, batch: Batch) -> None:
        for limit in self._limits:
            distance = batch.distance(limit)
            self._plots(stage, batch, limit, distance)
            pick = batch.every(DETAIL, self._info.scenario.dt)
            if len(pick):
                self._segments(stage, batch, limit, distance, pick)

    def _plots(self, stage: Stage, batch: Batch, limit: str, distance: Array) -> None:
        import rerun as rr

        pick = batch.every(PLOT, self._info.scenario.dt)
        if not len(pick):
            return
        index, time, distance = batch.index[pick], batch.time[pick], distance[pick]
        least = rr.Scalars.columns(scalars=distance.min(axis=1))
        stage.columns(of(batch.resolver, "least_distance", limit), index, time, least)
        margin = np.full(2, self._limits[limit].margin)
        ends = [0, -1] if len(pick) > 1 else [0]
        line = rr.Scalars.columns(scalars=margin[: len(ends)])
        stage.columns(margin_line(limit), index[ends], time[ends], line)
        near = nearest(distance, self._limits[limit].influence)
        for pair, name in enumerate(self._limits[limit].row_names):
            path = of(batch.resolver, "distance", limit, name)
            first = 0 if path in self._opened else _first(near[:, pair])
            if first is None:
                continue
            if path not in self._opened:
                self._opened.add(path)
                stage.static(path, rr.SeriesLines(names=[name], widths=[1.5]))
            values = rr.Scalars.columns(scalars=distance[first:, pair])
            stage.columns(path, index[first:], time[first:], values)

    def _segments(self, stage: Stage, batch: Batch, limit: str, distance: Array, pick: IntArray) -> None:
        import rerun as rr

        bound, n = self._limits[limit], batch.layout.n
        held = batch.state[:, n:][:, self._rows[limit]] != 0
        chosen = nearest(distance[pick], bound.influence)
        tick, pair = np.nonzero(chosen)
        lengths = chosen.sum(axis=1)
        points = batch.witness(limit)[pick][tick, pair]
        d = distance[pick][tick, pair]
        shades = np.where(held[pick][tick, pair], UPPER, NEAR)
        paint = np.where(d < bound.margin - 1e-9, BROKEN, shades).astype(np.uint32)
        path = _segments(batch.resolver, limit)
        first = np.diff(tick, prepend=-1) > 0
        lines = rr.LineStrips3D.columns(strips=points, colors=paint, labels=labels)
        index, time = batch.index[pick], batch.time[pick]
        stage.columns(path, index, time, lines.partition(lengths))
        ends = rr.Points3D.columns(positions=points.reshape(-1, 3), colors=np.repeat(paint, 2))
        stage.columns(f"{path}/witness", index, time, ends.partition(2 * lengths))


def nearest(distance: Array, influence: float) -> Mask:
    """(k, P) which pairs to draw at each tick: the nearest few of those within the influence."""
    out = np.zeros(distance.shape, dtype=bool)
    first = np.argsort(distance, axis=1, kind="stable")[:, :_SHOWN]
    np.put_along_axis(out, first, True, axis=1)
    return out & (distance < influence)


def _first(flags: Mask) -> int | None:
    """Where the first True is."""
    return int(np.argmax(flags)) if flags.any() else None
