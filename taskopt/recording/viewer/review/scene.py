"""The scene of a review: robots, paths, obstacles, ellipsoids, and joints near or at their limits."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray, Mask
from taskopt.recording.viewer.arrangement import arrange
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.ellipsoids import Ellipsoids
from taskopt.recording.viewer.obstacles import Obstacles, obstacle_corners
from taskopt.recording.viewer.palette import ERROR, TARGET, UPPER, VIOLATED, colours, resolver_colour
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.regions import Regions
from taskopt.recording.viewer.review.arms import Arm
from taskopt.recording.viewer.robot3d import RobotDrawing
from taskopt.recording.viewer.writer import RecordingWriter

_MOTION_PERIOD, _DETAIL_PERIOD = 0.01, 0.04  # [s] between two postures, and between two of all else
_MOST = 2000  # postures of one arm: a longer run is drawn at a longer period
_SAMPLES = 600  # points of a desired path at most
_NEAR = 0.9  # share of its range at which a joint is near its limit
_MARK = 1.3  # radius of a mark, as a multiple of half the thickness of a link
_LABEL = 0.002  # radius of the point that a label stands at, as a share of the scene
_AXES = 0.08  # length of the axes of a target, as a share of the scene


class ReviewScene:
    """Draws the arms of a review.

    Args:
        arms: The arms.

    Attributes:
        arrangement: The places of the robots and of the camera.
        trails: Paths of entities that are shown from the start up to the cursor.
    """

    def __init__(self, arms: Sequence[Arm]) -> None:
        self._arms = arms
        self._drawings = {id(arm.robot): RobotDrawing(arm.robot) for arm in arms}
        robots = [self._drawings[id(arm.robot)].corners(q) for arm in arms for q in arm.q[[0, -1]]]
        paths = [path for arm in arms for path in map(_path, [arm.desired(b.name) for b in arm.placed])]
        fixed = [obstacle_corners(shape) for arm in arms for shape in arm.obstacles.values()]
        moved = [poses[:, :3, 3] for arm in arms for poses in arm.motion.moving.values()]
        self.arrangement = arrange(robots, len(arms), [*fixed, *moved], [path for path in paths if len(path)])
        self.trails = [
            world_path(arm.name, "task", block.name, "actual") for arm in arms for block in arm.placed
        ]

    def send(self, writer: RecordingWriter) -> None:
        """Send everything.

        Args:
            writer: The recording.
        """
        writer.log_static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for number, arm in enumerate(self._arms):
            colour = resolver_colour(number)
            offset = rr.Transform3D(translation=self.arrangement.offset(number))
            writer.log_static(world_path(arm.name), offset)
            motion, detail = (
                arm.answers.ticks_every(max(period, arm.answers.end / _MOST))
                for period in (_MOTION_PERIOD, _DETAIL_PERIOD)
            )
            drawing, path = self._drawings[id(arm.robot)], world_path(arm.name, "robot")
            drawing.draw(writer, path, colour if len(self._arms) > 1 else None)
            drawing.move(writer, path, arm.index[motion], arm.time[motion], arm.q[motion])
            self._surround(writer, arm, motion, detail)
            for block in arm.placed:
                self._send_path(writer, arm, block.name, colour, detail)
            self._send_marks(writer, arm, drawing, detail)
            if len(self._arms) > 1:
                self._label(writer, arm, colour)

    def _surround(self, writer: RecordingWriter, arm: Arm, motion: IntArray, detail: IntArray) -> None:
        """Send obstacles, regions and ellipsoids."""
        obstacles = Obstacles(arm.obstacles, arm.motion.moving, self.arrangement)
        obstacles.draw(writer, arm.name)
        obstacles.send(writer, arm.name, arm.motion, motion)
        regions = Regions(arm.robot, arm.boxes, arm.cones, self.arrangement)
        regions.draw(writer, arm.name)
        regions.send(writer, arm.name, arm.motion, detail)
        frame = next(iter(arm.frames.values()), None)
        if frame is not None:
            ellipsoids = Ellipsoids(arm.robot, arm.q[0], frame, self.arrangement.size)
            ellipsoids.draw(writer, world_path(arm.name, "ellipsoid"))
            ellipsoids.send(writer, world_path(arm.name, "ellipsoid"), arm.motion, detail)

    def _send_path(self, writer: RecordingWriter, arm: Arm, task: str, colour: int, ticks: IntArray) -> None:
        """Send the desired path, the target, the actual path and the error between them."""
        points = rr.Radius.ui_points
        wanted, path = _path(arm.desired(task)), world_path(arm.name, "task", task)
        line = rr.LineStrips3D([wanted], colors=colours(TARGET), radii=points(1.2))
        writer.log_static(f"{path}/desired", line)
        for kind, paint in (("actual", colour), ("error", ERROR)):
            look = rr.LineStrips3D.from_fields(colors=colours(paint), radii=points(3.0))
            writer.log_static(f"{path}/{kind}", look)
        writer.log_static(f"{path}/target", rr.TransformAxes3D(_AXES * self.arrangement.size))
        desired, actual = arm.desired(task)[ticks], arm.actual(task)[ticks]
        known = np.isfinite(desired).all(axis=(1, 2))
        some, index, time = ticks[known], arm.index[ticks], arm.time[ticks]
        axes = rr.Transform3D.columns(
            translation=desired[known, :3, 3], mat3x3=desired[known, :3, :3].reshape(-1, 9)
        )
        writer.send_columns(f"{path}/target", arm.index[some], arm.time[some], axes)
        apart = list(np.stack([actual, desired[:, :3, 3]], axis=1)[known])
        errors = rr.LineStrips3D.columns(strips=apart)
        writer.send_columns(f"{path}/error", arm.index[some], arm.time[some], errors)
        segments = np.stack([np.concatenate([actual[:1], actual[:-1]]), actual], axis=1)
        writer.send_columns(f"{path}/actual", index, time, rr.LineStrips3D.columns(strips=list(segments)))

    def _send_marks(self, writer: RecordingWriter, arm: Arm, drawing: RobotDrawing, ticks: IntArray) -> None:
        """Send a ball at each joint that is near a position limit, or held by any limit."""
        robot, path = arm.robot, world_path(arm.name, "limits")
        joints = {name: 1 + robot.joints.index(name) for name in robot.velocity_names if name in robot.joints}
        single = np.array([name in joints for name in robot.velocity_names])
        near = np.abs(np.nan_to_num(arm.answers.position_share)) > _NEAR
        held = _held(arm)
        shown = ((near | held) & single)[ticks]
        count = shown.sum(axis=1)
        poses = drawing.joint_poses(arm.q[ticks])[..., :3, 3]
        places = poses[:, [joints.get(name, 0) for name in robot.velocity_names]]
        paint = np.where(held[ticks][shown], UPPER, VIOLATED).astype(np.uint32)
        names = np.array(robot.velocity_names)[np.nonzero(shown)[1]].tolist()
        marks = rr.Points3D.columns(positions=places[shown], colors=paint, labels=[*map(drawable, names)])
        look = rr.Points3D.from_fields(radii=_MARK * drawing.thickness, show_labels=False)
        writer.log_static(path, look)
        writer.send_columns(path, arm.index[ticks], arm.time[ticks], marks.partition(count))

    def _label(self, writer: RecordingWriter, arm: Arm, colour: int) -> None:
        """Write the name of an arm beside a flat robot, and above any other."""
        room = self.arrangement
        middle = 0.5 * (room.lower + room.upper)
        above = np.array([middle[0], middle[1], room.upper[2] + 0.1 * room.size])
        place = np.array([middle[0], room.upper[1] + 0.05 * room.size, 0.0]) if room.flat else above
        label = rr.Points3D(
            [place],
            labels=[drawable(arm.name)],
            colors=colours(colour),
            radii=[_LABEL * room.size],
            show_labels=True,
        )
        writer.log_static(world_path(arm.name, "label"), label)


def _path(poses: Array) -> Array:
    """Return the places of poses (k, 4, 4) that are known, at most `_SAMPLES` and the last, (s, 3) [m]."""
    places = poses[np.isfinite(poses).all(axis=(1, 2)), :3, 3]
    every = max(1, -(-len(places) // _SAMPLES))
    return np.concatenate([places[::every], places[-1:]])


def _held(arm: Arm) -> Mask:
    """Return True where a bound on an unknown is active or broken, (k, n)."""
    held = np.zeros((len(arm.index), arm.robot.nv), dtype=bool)
    columns = {name: i for i, name in enumerate(arm.answers.log.layout.unknowns)}
    for lane in arm.lanes:
        column = columns.get(lane.name.partition("/")[2])
        if column is not None:
            for stretch in lane.stretches:
                held[stretch.first : stretch.last + 1, column] = True
    return held
