"""Where inequality tasks want a frame to be: boxes that stand still, cones of view that move with it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.arrangement import Place
from taskopt.record.viewer.palette import TARGET, colours, part
from taskopt.record.viewer.writer import Stage

_LENGTH = 0.35  # of a cone, as a share of the scene
_RAYS = 24  # of its rim


class Regions:
    """The boxes and cones of a run's tasks."""

    def __init__(self, info: RunInfo, place: Place) -> None:
        self._place, self._at = place, Configuration(info.scenario.robot, info.scenario.start)
        self._boxes = dict(_those("box", info))
        self._cones = dict(_those("cone", info))

    def draw(self, stage: Stage, path: str) -> None:
        """Log the boxes, an open side as far as the scene goes, and the shape of the cones."""
        import rerun as rr

        thin = rr.Radius.ui_points(1.2)
        for name, (lower, upper) in self._boxes.items():
            low = np.where(np.isfinite(lower), lower, np.minimum(self._place.lower, upper))
            high = np.where(np.isfinite(upper), upper, np.maximum(self._place.upper, lower))
            box = rr.Boxes3D(mins=[low], sizes=[high - low], colors=colours(TARGET), radii=thin)
            stage.static(f"{path}/task/{part(name)}/region", box)
        for name, (_, axis, half_angle) in self._cones.items():
            strips = cone_lines(axis, half_angle, _LENGTH * self._place.size)
            cone = rr.LineStrips3D(strips, colors=colours(TARGET), radii=thin)
            stage.static(f"{path}/task/{part(name)}/region", cone)

    def send(self, stage: Stage, path: str, batch: Batch, pick: Any) -> None:
        """Move the cones with their frames."""
        import rerun as rr

        for name, (frame, _, _) in self._cones.items():
            poses = np.empty((len(pick), 4, 4))
            for pose, q in zip(poses, batch.q[pick], strict=True):
                self._at.update(q)
                pose[:] = self._at.pose(frame)
            moved = rr.Transform3D.columns(
                translation=poses[:, :3, 3], mat3x3=poses[:, :3, :3].reshape(-1, 9)
            )
            stage.columns(f"{path}/task/{part(name)}/region", batch.index[pick], batch.time[pick], moved)


def _those(region: str, info: RunInfo) -> Iterator[tuple[str, Any]]:
    """Tasks by name that have a region of a kind."""
    for task in info.plan.tasks:
        if getattr(task, region, None) is not None:
            yield task.name, getattr(task, region)


def cone_lines(axis: Array, half_angle: float, length: float) -> list[Array]:
    """The rim of a cone about a unit axis with its tip at 0, and four lines to the tip, (k, 3) each."""
    aside = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, aside) / np.linalg.norm(np.cross(axis, aside))
    second = np.cross(axis, first)
    turn = np.linspace(0.0, 2.0 * np.pi, _RAYS + 1)[:, None]
    rim = np.cos(half_angle) * axis + np.sin(half_angle) * (np.cos(turn) * first + np.sin(turn) * second)
    sides = [np.array([np.zeros(3), ray]) for ray in rim[: -1 : _RAYS // 4]]
    return [length * strip for strip in (rim, *sides)]
