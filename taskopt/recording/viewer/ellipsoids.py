"""The manipulability ellipsoids of a frame: that of velocity as a solid, that of force as a wire frame.

Both are those of the linear rows of the Jacobian, drawn at 25 Hz. If one is selected in the viewer, its
semi-axes, their directions and the manipulability at the tick are shown.
"""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.analysis.ellipsoid import Ellipsoid, force_ellipsoid, velocity_ellipsoid
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import log3
from taskopt.kinematics.robot import Robot
from taskopt.recording.viewer.motion import Motion
from taskopt.recording.viewer.palette import ELLIPSOID, FORCE_ELLIPSOID, colours
from taskopt.recording.viewer.writer import RecordingWriter

_LARGEST = 0.09  # largest semi-axis at the start, as a share of the size of the scene
_THINNEST = 0.004  # smallest semi-axis that is drawn, as a share of the size of the scene
_LONGEST = 0.3  # longest semi-axis that is drawn: at a singularity that of force is endless


class Ellipsoids:
    """Draw both ellipsoids of a frame, each scaled to the size of the scene."""

    def __init__(self, robot: Robot, start: Array, frame: str, size: float) -> None:
        """Choose the scales from the ellipsoids at the start posture.

        Args:
            robot: The robot.
            start: The start posture, (nq,).
            frame: The name of the frame.
            size: The size of the scene [m].
        """
        self._frame, self._size = frame, size
        self._configuration = Configuration(robot, start)
        J = self._jacobian(start)
        self._velocity_scale = self._scale(velocity_ellipsoid(J))
        self._force_scale = self._scale(force_ellipsoid(J))

    def draw(self, writer: RecordingWriter, path: str) -> None:
        """Send the colours.

        Args:
            writer: The recording.
            path: The entity path of their parent.
        """
        velocity = rr.Ellipsoids3D.from_fields(colors=colours(ELLIPSOID), fill_mode="solid")
        writer.log_static(f"{path}/velocity", velocity)
        force = rr.Ellipsoids3D.from_fields(colors=colours(FORCE_ELLIPSOID), fill_mode="majorwireframe")
        writer.log_static(f"{path}/force", force)

    def send(self, writer: RecordingWriter, path: str, batch: Motion, ticks: IntArray) -> None:
        """Send the ellipsoids at some ticks.

        Args:
            writer: The recording.
            path: The entity path of their parent.
            batch: Consecutive ticks of one arm.
            ticks: The positions of the ticks in the batch.
        """
        jacobians, centres = [], []
        for q in batch.q[ticks]:
            jacobians.append(self._jacobian(q))
            centres.append(self._configuration.pose(self._frame)[:3, 3])
        for name, scale, shapes in (
            ("velocity", self._velocity_scale, [velocity_ellipsoid(J) for J in jacobians]),
            ("force", self._force_scale, [force_ellipsoid(J) for J in jacobians]),
        ):
            columns = [*self._drawn(shapes, centres, scale), *_values(name, shapes)]
            writer.send_columns(f"{path}/{name}", batch.index[ticks], batch.time[ticks], columns)

    def _jacobian(self, q: Array) -> Array:
        """Return the linear rows (3, nv) of the frame's Jacobian at q (nq,)."""
        self._configuration.update(q)
        return self._configuration.jacobian(self._frame)[:3]

    def _scale(self, at_start: Ellipsoid) -> float:
        """Return the factor that makes the largest finite semi-axis at the start fit the scene."""
        finite = at_start.semi_axes[np.isfinite(at_start.semi_axes)]
        largest = float(finite.max(initial=0.0))
        return _LARGEST * self._size / largest if largest > 0.0 else 0.0  # 0: the frame never moves

    def _drawn(
        self, shapes: Sequence[Ellipsoid], centres: Sequence[Array], scale: float
    ) -> rr.ComponentColumnList:
        """Return the columns of the shapes, their semi-axes kept within what can be seen."""
        least, most = _THINNEST * self._size, _LONGEST * self._size
        return rr.Ellipsoids3D.columns(
            centers=centres,
            half_sizes=[np.clip(scale * shape.semi_axes, least, most) for shape in shapes],
            quaternions=[quaternion(shape.axes) for shape in shapes],
        )


def _values(name: str, shapes: Sequence[Ellipsoid]) -> list[rr.ComponentColumn]:
    """Return semi-axes, directions column by column, and for velocities w (3.56), as columns."""
    unit = "m/s per rad/s" if name == "velocity" else "N per N m"
    numbers = {
        f"semi_axes [{unit}]": [shape.semi_axes for shape in shapes],
        "axes": [shape.axes.T.ravel() for shape in shapes],
    }
    if name == "velocity":
        numbers["manipulability"] = [shape.semi_axes.prod(keepdims=True) for shape in shapes]
    columns: list[rr.ComponentColumn] = []
    for key, rows in numbers.items():
        flat = rr.DynamicArchetype.columns(
            archetype="taskopt.Ellipsoid", components={key: np.concatenate(rows)}
        )
        columns += flat.partition([len(row) for row in rows])
    return columns


def quaternion(axes: Array) -> Array:
    """Convert the axes of an ellipsoid to a quaternion.

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
