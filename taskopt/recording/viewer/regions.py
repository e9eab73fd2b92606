"""The regions of inequality tasks in the scene: boxes that stand still, and cones that move with a frame."""

from collections.abc import Mapping

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import Cone
from taskopt.recording.viewer.arrangement import Arrangement
from taskopt.recording.viewer.motion import Motion
from taskopt.recording.viewer.palette import TARGET, colours
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.writer import RecordingWriter

_LENGTH = 0.35  # of a cone, as a share of the size of the scene
_RAYS = 24  # corners of the rim of a cone


class Regions:
    """Draw the boxes and cones of the tasks of a run."""

    def __init__(
        self, robot: Robot, boxes: Mapping[str, Array], cones: Mapping[str, Cone], arrangement: Arrangement
    ) -> None:
        """Prepare to draw.

        Args:
            robot: The robot that carries the cones.
            boxes: Lower and upper corner of the box of a task, (2, 3) [m], by the name of the task.
            cones: Frame, unit axis in it and half angle [rad] of the cone of a task, by the name of the task.
            arrangement: The arrangement of the scene, at whose edge open sides of boxes end.
        """
        self._arrangement = arrangement
        self._configuration = Configuration(robot, robot.neutral)
        self._boxes, self._cones = boxes, cones

    def draw(self, writer: RecordingWriter, resolver: str) -> None:
        """Send the boxes and the shapes of the cones.

        Args:
            writer: The recording.
            resolver: The name of the resolver whose robot they belong to.
        """
        thin = rr.Radius.ui_points(1.2)
        for name, (lower, upper) in self._boxes.items():
            start = np.where(np.isfinite(lower), lower, np.minimum(self._arrangement.lower, upper))
            stop = np.where(np.isfinite(upper), upper, np.maximum(self._arrangement.upper, lower))
            box = rr.Boxes3D(mins=[start], sizes=[stop - start], colors=colours(TARGET), radii=thin)
            writer.log_static(world_path(resolver, "task", name, "region"), box)
        for name, (_, axis, half_angle) in self._cones.items():
            strips = cone_lines(axis, half_angle, _LENGTH * self._arrangement.size)
            cone = rr.LineStrips3D(strips, colors=colours(TARGET), radii=thin)
            writer.log_static(world_path(resolver, "task", name, "region"), cone)

    def send(self, writer: RecordingWriter, resolver: str, batch: Motion, ticks: IntArray) -> None:
        """Move the cones with their frames.

        Args:
            writer: The recording.
            resolver: The name of the resolver.
            batch: Consecutive ticks of its robot.
            ticks: The positions of the ticks in the batch that are drawn.
        """
        for name, (frame, _, _) in self._cones.items():
            poses = np.empty((len(ticks), 4, 4))
            for pose, q in zip(poses, batch.q[ticks], strict=True):
                self._configuration.update(q)
                pose[:] = self._configuration.pose(frame)
            motion = rr.Transform3D.columns(
                translation=poses[:, :3, 3], mat3x3=poses[:, :3, :3].reshape(-1, 9)
            )
            path = world_path(resolver, "task", name, "region")
            writer.send_columns(path, batch.index[ticks], batch.time[ticks], motion)


def cone_lines(axis: Array, half_angle: float, length: float) -> list[Array]:
    """Make the lines of a cone: its rim, and four lines from its tip at the origin.

    Args:
        axis: The unit axis, (3,).
        half_angle: The angle between the axis and the surface [rad].
        length: The distance from the tip to the rim [m].

    Returns:
        Five line strips, (k, 3) each [m].
    """
    aside = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, aside) / np.linalg.norm(np.cross(axis, aside))
    second = np.cross(axis, first)
    turn = np.linspace(0.0, 2.0 * np.pi, _RAYS + 1)[:, None]
    rim = np.cos(half_angle) * axis + np.sin(half_angle) * (np.cos(turn) * first + np.sin(turn) * second)
    sides = [np.array([np.zeros(3), ray]) for ray in rim[: -1 : _RAYS // 4]]
    return [length * strip for strip in (rim, *sides)]
