"""The velocity ellipsoid of a frame in the scene."""

from typing import NamedTuple

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import log3
from taskopt.record.batch import Batch
from taskopt.record.run_info import RunInfo
from taskopt.record.viewer.palette import ELLIPSOID, colours
from taskopt.record.viewer.writer import RecordingWriter

_LARGEST = 0.09  # largest half-axis at the start, as a share of the size of the scene
_THINNEST = 0.004  # smallest half-axis that is drawn, as a share of the size of the scene


class Ellipsoid(NamedTuple):
    """The velocities ṗ that a frame can reach with ‖v‖ ≤ 1: ṗᵀ(J Jᵀ)⁻¹ṗ ≤ 1.

    Attributes:
        centre: The origin of the frame, (3,), in the robot's world [m].
        half_axes: The singular values of J, largest first, (3,) [m/s per rad/s].
        rotation: The directions of the half-axes, in its columns, (3, 3).
    """

    centre: Array
    half_axes: Array
    rotation: Array


class VelocityEllipsoid:
    """Draw the velocity ellipsoid of a frame, scaled to the size of the scene."""

    def __init__(self, info: RunInfo, frame: str, size: float) -> None:
        """Choose the scale from the ellipsoid at the start posture.

        Args:
            info: The facts about the run.
            frame: The name of the frame.
            size: The size of the scene [m].
        """
        self._frame, self._size = frame, size
        self._configuration = Configuration(info.scenario.robot, info.scenario.start)
        largest = float(self.at(info.scenario.start).half_axes.max())
        self._scale = _LARGEST * size / largest if largest > 0.0 else 0.0  # 0: the frame never moves

    def at(self, q: Array) -> Ellipsoid:
        """Compute the ellipsoid at a configuration.

        Args:
            q: The configuration, (nq,) [rad, m].

        Returns:
            The ellipsoid, not yet scaled.
        """
        self._configuration.update(q)
        J = self._configuration.jacobian(self._frame)[:3]
        rotation, squares, _ = np.linalg.svd(J @ J.T)
        return Ellipsoid(self._configuration.pose(self._frame)[:3, 3], np.sqrt(squares), rotation)

    def draw(self, writer: RecordingWriter, path: str) -> None:
        """Send the colour.

        Args:
            writer: The recording.
            path: The entity path.
        """
        writer.log_static(path, rr.Ellipsoids3D.from_fields(colors=colours(ELLIPSOID), fill_mode="solid"))

    def send(self, writer: RecordingWriter, path: str, batch: Batch, ticks: IntArray) -> None:
        """Send the ellipsoid at some ticks.

        Args:
            writer: The recording.
            path: The entity path.
            batch: Consecutive steps of one resolver.
            ticks: The positions of the ticks in the batch.
        """
        ellipsoids = [self.at(q) for q in batch.q[ticks]]
        least = _THINNEST * self._size
        shapes = rr.Ellipsoids3D.columns(
            centers=[ellipsoid.centre for ellipsoid in ellipsoids],
            half_sizes=[np.maximum(self._scale * ellipsoid.half_axes, least) for ellipsoid in ellipsoids],
            quaternions=[quaternion(ellipsoid.rotation) for ellipsoid in ellipsoids],
        )
        writer.send_columns(path, batch.index[ticks], batch.time[ticks], shapes)


def quaternion(axes: Array) -> Array:
    """Turn the axes of an ellipsoid into a quaternion.

    Args:
        axes: Orthonormal columns, (3, 3), right-handed or left-handed; a mirrored axis is made right-handed,
            which leaves the ellipsoid as it is.

    Returns:
        The unit quaternion (x, y, z, w), (4,).
    """
    right = axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))])
    turn = log3(right)
    half = 0.5 * float(np.linalg.norm(turn))
    return np.array([*(0.5 * np.sinc(half / np.pi) * turn), np.cos(half)])
