"""The 3D view: a robot for each resolver, its desired and its actual paths, obstacles and regions."""

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.arrangement import arrange
from taskopt.recording.viewer.ellipsoids import Ellipsoids
from taskopt.recording.viewer.motion import motion_of
from taskopt.recording.viewer.obstacles import Obstacles, obstacle_corners
from taskopt.recording.viewer.palette import ERROR, TARGET, colours, resolver_colour
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.regions import Regions
from taskopt.recording.viewer.robot3d import RobotDrawing
from taskopt.recording.viewer.rows import rows_in_unit
from taskopt.recording.viewer.trails import Trails
from taskopt.recording.viewer.writer import RecordingWriter

_MOTION_PERIOD = 0.01  # [s] between two poses of the robot
_DETAIL_PERIOD = 0.04  # [s] between two segments of a path, or two ellipsoids
_SAMPLES = 240  # points of a desired path
_AXES = 0.11  # length of the axes of a desired pose, as a share of the size of the scene


class Scene:
    """Draw the robots of all resolvers with their surroundings, and move them batch by batch.

    Attributes:
        arrangement: The places of the robots and of the camera.
    """

    def __init__(self, info: RunInfo) -> None:
        """Arrange the scene for a run.

        Args:
            info: The facts about the run.
        """
        self._info = info
        self._robot = RobotDrawing(info.scenario.robot)
        self._last: dict[str, Array] = {}  # the last point of each actual path, (1, 3)
        self._placed = {task.name for task in info.plan.tasks if rows_in_unit(task, "m").any()}
        self._desired, moved = desired_paths(info)
        reached, paths = [self._robot.corners(info.scenario.start)], [*self._desired.values()]
        obstacles = info.plan.obstacles
        around = [obstacle_corners(shape) for shape in obstacles.values()]
        self.arrangement = arrange(reached, len(info.resolvers), [*around, *moved.values()], paths)
        self._obstacles = Obstacles(obstacles, info.plan.moving.keys(), self.arrangement)
        robot, tasks = info.scenario.robot, info.plan.tasks
        boxes = {task.name: task.box for task in tasks if task.box is not None}
        cones = {task.name: task.cone for task in tasks if task.cone is not None}
        self._regions = Regions(robot, boxes, cones, self.arrangement)
        self._trails = Trails(info)
        frame = next((task.frame for task in info.plan.tasks if task.frame is not None), None)
        size = self.arrangement.size
        self._ellipsoids = None if frame is None else Ellipsoids(robot, info.scenario.start, frame, size)

    def draw(self, writer: RecordingWriter) -> None:
        """Send everything that stands still: shapes, obstacles, desired paths, names and colours.

        Args:
            writer: The recording.
        """
        several = len(self._info.resolvers) > 1
        start = np.zeros(1, dtype=np.int64)
        writer.log_static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for index, name in enumerate(self._info.resolvers):
            colour, robot = resolver_colour(index), world_path(name, "robot")
            writer.log_static(world_path(name), rr.Transform3D(translation=self.arrangement.offset(index)))
            self._robot.draw(writer, robot, colour if several else None)
            q = self._info.scenario.start[None]
            self._robot.move(writer, robot, start, start.astype("timedelta64[ns]"), q)
            self._obstacles.draw(writer, name)
            self._draw_paths(writer, name, colour)
            self._regions.draw(writer, name)
            self._trails.draw(writer, name)
            if self._ellipsoids is not None:
                self._ellipsoids.draw(writer, world_path(name, "ellipsoid"))
            if several:
                self._draw_label(writer, name, colour)

    def send(self, writer: RecordingWriter, batch: Batch) -> None:
        """Send poses at 100 Hz, paths and ellipsoids at 25 Hz.

        Args:
            writer: The recording.
            batch: The steps that follow those of the last call for the same resolver.
        """
        motion = motion_of(batch)
        dt, robot = self._info.scenario.dt, world_path(batch.resolver, "robot")
        ticks = batch.ticks_every(_MOTION_PERIOD, dt)
        self._robot.move(writer, robot, batch.index[ticks], batch.time[ticks], batch.q[ticks])
        self._obstacles.send(writer, batch.resolver, motion, ticks)
        ticks = batch.ticks_every(_DETAIL_PERIOD, dt)
        if not len(ticks):
            return
        self._regions.send(writer, batch.resolver, motion, ticks)
        self._trails.send(writer, batch, ticks)
        for task in batch.frame_tasks:
            self._send_paths(writer, batch, task, ticks)
        if self._ellipsoids is not None:
            self._ellipsoids.send(writer, world_path(batch.resolver, "ellipsoid"), motion, ticks)

    def _draw_label(self, writer: RecordingWriter, resolver: str, colour: int) -> None:
        """Write the resolver's name behind a flat robot, and above any other."""
        room = self.arrangement
        middle = 0.5 * (room.lower + room.upper)
        above = np.array([0.0, 0.0, room.upper[2] + 0.08 * room.size])
        position = np.array([middle[0], room.upper[1], 0.0]) if room.flat else above
        label = rr.Points3D(
            [position],
            labels=[resolver],
            colors=colours(colour),
            radii=[0.002 * room.size],
            show_labels=True,
        )
        writer.log_static(world_path(resolver, "label"), label)

    def _draw_paths(self, writer: RecordingWriter, resolver: str, colour: int) -> None:
        """Draw desired paths, and set colour and width of the actual paths."""
        points = rr.Radius.ui_points
        for task in self._info.plan.tasks:
            if task.frame is None:
                continue
            if task.name in self._desired:
                strip = [self._desired[task.name]]
                desired = rr.LineStrips3D(strip, colors=colours(TARGET), radii=points(1.2))
                writer.log_static(world_path(resolver, "task", task.name, "desired"), desired)
                for kind, paint in (("actual", colour), ("error", ERROR)):
                    look = rr.LineStrips3D.from_fields(colors=colours(paint), radii=points(3.0))
                    writer.log_static(world_path(resolver, "task", task.name, kind), look)
            axes = rr.TransformAxes3D(_AXES * self.arrangement.size)
            writer.log_static(world_path(resolver, "task", task.name, "target"), axes)

    def _send_paths(self, writer: RecordingWriter, batch: Batch, task: str, ticks: IntArray) -> None:
        """Send the desired pose, the error and the next segments of the actual path of a task."""
        index, time = batch.index[ticks], batch.time[ticks]
        actual = batch.actual(task)[ticks]
        desired = np.where(batch.in_force(task)[ticks, None, None], batch.desired(task)[ticks], actual)
        placed = task in self._placed  # else the task turns the frame wherever that is
        position = (desired if placed else actual)[:, :3, 3]
        axes = rr.Transform3D.columns(translation=position, mat3x3=desired[:, :3, :3].reshape(-1, 9))
        writer.send_columns(world_path(batch.resolver, "task", task, "target"), index, time, axes)
        if not placed:
            return
        points = actual[:, :3, 3]
        errors = rr.LineStrips3D.columns(strips=list(np.stack([points, desired[:, :3, 3]], axis=1)))
        writer.send_columns(world_path(batch.resolver, "task", task, "error"), index, time, errors)
        path = world_path(batch.resolver, "task", task, "actual")
        previous: Array = self._last.get(path, points[:1])
        self._last[path] = points[-1:]
        segments = np.stack([np.concatenate([previous, points[:-1]]), points], axis=1)
        writer.send_columns(path, index, time, rr.LineStrips3D.columns(strips=list(segments)))


def desired_paths(info: RunInfo) -> tuple[dict[str, Array], dict[str, Array]]:
    """Compute the paths of the targets of frame tasks and of obstacles, which are known before the run.

    Args:
        info: The facts about the run.

    Returns:
        Points (samples, 3) of each task with rows in metres, by its name, in the robot's world [m]; and the
        same for the middle of each obstacle that moves.
    """
    plan, q0 = info.new_plan(), info.scenario.start
    plan.start(q0, 0.0)
    paths: dict[str, list[Array]] = {}
    moved: dict[str, list[Array]] = {}
    for t in np.linspace(0.0, info.scenario.duration, _SAMPLES):
        plan.at(q0, float(t))
        for task in plan.tasks:
            if task.desired is not None and rows_in_unit(task, "m").any():
                paths.setdefault(task.name, []).append(task.desired[:3, 3].copy())
        for name, pose in plan.moving.items():
            moved.setdefault(name, []).append(pose[:3, 3].copy())
    found = ({name: np.array(points) for name, points in of.items()} for of in (paths, moved))
    return next(found), next(found)
