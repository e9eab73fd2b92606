"""How near the robot is to what it must not touch: lines between witness points, and distances over time."""

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.record.batch import Batch, Mask
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.arrangement import Place
from taskopt.record.viewer.drawable_text import drawable
from taskopt.record.viewer.obstacles import declared_obstacles, draw_obstacles
from taskopt.record.viewer.palette import (
    BROKEN,
    HELD_LABEL,
    LIMIT_LINE,
    NEAR,
    UPPER,
    colours,
    joint_colours,
    part,
    resolver_colour,
    slug,
)
from taskopt.record.viewer.plots import of
from taskopt.record.viewer.writer import Stage

PLOT = 0.01  # [s] between two points of a plot
DETAIL = 0.04  # [s] between two drawings of the witness points
_BELOW = 1e-9  # [m] below a margin that counts
_SHOWN = 3  # pairs of each limit that are drawn at a time, the nearest ones


class Clearance:
    """Obstacles, witness points at 25 Hz, and a plot for each limit that keeps distances.

    A pair has a line in the plot from when it is first one of the nearest, within the influence of its
    limit: of fifty pairs five may ever matter.
    """

    def __init__(self, info: RunInfo, place: Place) -> None:
        self._info, self._place, self._dt = info, place, info.scenario.dt
        self._limits = info.plan.distance_limits
        self._rows = {block.name: block.rows for block in info.plan.layout.blocks if block.level == 0}
        self._opened: dict[str, set[int]] = {}

    def draw(self, stage: Stage) -> None:
        import rerun as rr

        obstacles = declared_obstacles(self._info)
        for index, name in enumerate(self._info.resolvers):
            draw_obstacles(stage, f"/world/{slug(name)}/obstacle", obstacles, self._place)
            for limit in self._limits:
                _line(stage, least_line(name, limit), f"{name}: least", resolver_colour(index), 3.0)
                look = rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(2.5))
                stage.static(_segments(name, limit), look)
                dots = rr.Points3D.from_fields(radii=rr.Radius.ui_points(4.0))
                stage.static(f"{_segments(name, limit)}/witness", dots)
                label = rr.Points3D.from_fields(radii=rr.Radius.ui_points(0.1), show_labels=True)
                stage.static(f"{_segments(name, limit)}/least", label)
        for limit in self._limits:
            _line(stage, margin_line(limit), "margin", LIMIT_LINE)

    def send(self, stage: Stage, batch: Batch) -> None:
        plotted, drawn = batch.every(PLOT, self._dt), batch.every(DETAIL, self._dt)
        for limit in self._limits:
            distance = batch.distance(limit)
            if len(plotted):
                self._plots(stage, batch, limit, distance[plotted], plotted)
            if len(drawn):
                self._witness(stage, batch, limit, distance[drawn], drawn)

    def _plots(self, stage: Stage, batch: Batch, limit: str, distance: Array, pick: IntArray) -> None:
        import rerun as rr

        bound, index, time = self._limits[limit], batch.index[pick], batch.time[pick]
        least = rr.Scalars.columns(scalars=distance.min(axis=1))
        stage.columns(least_line(batch.resolver, limit), index, time, least)
        ends = np.unique([0, len(pick) - 1])
        level = rr.Scalars.columns(scalars=np.full(len(ends), bound.margin))
        stage.columns(margin_line(limit), index[ends], time[ends], level)
        near = nearest(distance, bound.influence)
        opened = self._opened.setdefault(least_line(batch.resolver, limit), set())
        begins = dict.fromkeys(opened, 0) | {
            int(pair): int(near[:, pair].argmax())
            for pair in np.flatnonzero(near.any(axis=0))
            if pair not in opened
        }
        for pair, begin in sorted(begins.items(), key=lambda known: known[::-1]):
            path = pair_line(batch.resolver, limit, bound.row_names[pair])
            if pair not in opened:
                _line(stage, path, bound.row_names[pair], int(joint_colours(len(opened) + 1)[-1]))
                opened.add(pair)
            values = rr.Scalars.columns(scalars=distance[begin:, pair])
            stage.columns(path, index[begin:], time[begin:], values)

    def _witness(self, stage: Stage, batch: Batch, limit: str, distance: Array, pick: IntArray) -> None:
        """Lines between the witness points of the nearest pairs, and the least distance as a number."""
        import rerun as rr

        bound, path = self._limits[limit], _segments(batch.resolver, limit)
        index, time, points = batch.index[pick], batch.time[pick], batch.witness(limit)[pick]
        held = batch.state[:, batch.layout.n :][pick, self._rows[limit]] != 0
        paint = np.where(distance < bound.margin - _BELOW, BROKEN, np.where(held, UPPER, NEAR))
        paint = paint.astype(np.uint32)
        shown = nearest(distance, bound.influence)
        count = shown.sum(axis=1)
        lines = rr.LineStrips3D.columns(strips=points[shown].astype(np.float32), colors=paint[shown])
        stage.columns(path, index, time, lines.partition(count))
        dots = rr.Points3D.columns(positions=points[shown].reshape(-1, 3), colors=np.repeat(paint[shown], 2))
        stage.columns(f"{path}/witness", index, time, dots.partition(2 * count))
        some = np.flatnonzero(count)
        least = distance[some].argmin(axis=1)
        label = rr.Points3D.columns(
            positions=points[some, least].mean(axis=1),
            colors=np.where(paint[some, least] == UPPER, HELD_LABEL, paint[some, least]).astype(np.uint32),
            labels=[f"{1e3 * value:.0f} mm" for value in distance[some, least]],
        )
        stage.columns(f"{path}/least", index, time, label.partition(np.minimum(count, 1)))


def margin_line(limit: str) -> str:
    """Entity path of the margin of a distance limit."""
    return f"/scale/margin/{part(limit)}"


def least_line(resolver: str, limit: str) -> str:
    """Entity path of the least distance of all pairs of a limit."""
    return of(resolver, "least_distance", limit)


def pair_line(resolver: str, limit: str, pair: str = "") -> str:
    """Entity path of the distance of a pair; of all of them without one."""
    return of(resolver, "distance", limit, *([pair] if pair else []))


def _segments(resolver: str, limit: str) -> str:
    return f"/world/{slug(resolver)}/distance/{part(limit)}"


def _line(stage: Stage, path: str, name: str, colour: int, width: float = 1.5) -> None:
    import rerun as rr

    stage.static(path, rr.SeriesLines(names=[drawable(name)], colors=colours(colour), widths=[width]))


def nearest(distance: Array, influence: float) -> Mask:
    """(k, P) which pairs to draw at each tick: the nearest few of those within the influence."""
    out = np.zeros(distance.shape, dtype=bool)
    first = np.argsort(distance, axis=1, kind="stable")[:, :_SHOWN]
    np.put_along_axis(out, first, True, axis=1)
    return out & (distance < influence)
