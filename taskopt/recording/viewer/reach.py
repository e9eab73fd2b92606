"""The recording of a map of reachable poses: points in the scene, and the robot in each of its postures."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from taskopt.errors import InvalidValue
from taskopt.loop.batch.reach import ReachMap
from taskopt.recording.viewer.arrangement import Camera, arrange
from taskopt.recording.viewer.blueprint import complete_layout, scene_view
from taskopt.recording.viewer.palette import FREE, TARGET, colours, ramp
from taskopt.recording.viewer.paths import data_path
from taskopt.recording.viewer.robot3d import RobotDrawing
from taskopt.recording.viewer.writer import RecordingWriter

_RATE = 10  # postures that are shown in a second
_POINT, _PLACE = 0.012, 0.03  # share of the size of the scene
_AT, _VALUE = "/world/at", data_path("map", "manipulability")


def record_reach_map(found: ReachMap, path: str | Path) -> Path:
    """Record a map of reachable poses for Rerun's viewer.

    A point stands at each pose: dark where it was not reached, else the brighter, the larger the
    manipulability. Over time the robot takes the posture of each reached pose, in the order of the poses.

    Args:
        found: The map.
        path: The file to write, which ends with `.rrd`, in an existing folder.

    Returns:
        The path.

    Raises:
        InvalidValue: No pose is reached, the name ends otherwise, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix != ".rrd":
        raise InvalidValue(f"a recording is a file *.rrd, got {path}")
    reached = np.flatnonzero(found.reached)
    if not reached.size:
        raise InvalidValue(f"there is nothing to record: {found!r}")
    points = found.poses[:, :3, 3]
    drawing = RobotDrawing(found.robot)
    scene = arrange([drawing.corners(found.q[reached[0]])], 1, paths=[points])
    writer = RecordingWriter(path, f"{found.robot.name} reaches", _layout(found, scene.camera(1)))
    writer.log_static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    value, size = found.manipulability[reached], _POINT * scene.size
    shades = ramp(value / max(float(value.max()), np.finfo(np.float64).tiny))
    writer.log_static("/world/reached", rr.Points3D(points[reached], colors=shades, radii=size))
    missed = np.delete(points, reached, axis=0)
    writer.log_static("/world/missed", rr.Points3D(missed, colors=colours(FREE), radii=0.4 * size))
    drawing.draw(writer, "/world/robot")
    tick = np.arange(reached.size)
    time = (tick * (1_000_000_000 // _RATE)).astype("timedelta64[ns]")
    drawing.move(writer, "/world/robot", tick, time, found.q[reached])
    look = rr.Points3D.from_fields(colors=colours(TARGET), radii=_PLACE * scene.size)
    writer.log_static(_AT, look)
    at = rr.Points3D.columns(positions=points[reached]).partition(np.ones(reached.size, dtype=np.int64))
    writer.send_columns(_AT, tick, time, at)
    writer.send_columns(_VALUE, tick, time, rr.Scalars.columns(scalars=value))
    writer.close()
    return path


def _layout(found: ReachMap, camera: Camera) -> rrb.Blueprint:
    """Lay out the scene above the plot of the manipulability."""
    reached = f"{found.reached.sum()} of {len(found.poses)} poses reached"
    view = scene_view(f"{found.frame} of {found.robot.name}: {reached}", camera)
    plot = rrb.TimeSeriesView(name="Manipulability of the posture", origin=_VALUE)
    return complete_layout(rrb.Vertical(view, plot, row_shares=[4.0, 1.0]))
