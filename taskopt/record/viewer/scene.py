"""What stands in the 3D view: a robot for each resolver, its desired and actual path, its ellipsoid."""

from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import log3
from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.arrangement import place_for
from taskopt.record.viewer.obstacles import corners, declared_obstacles
from taskopt.record.viewer.palette import ELLIPSOID, ERROR, TARGET, colours, part, resolver_colour, slug
from taskopt.record.viewer.plots import rows_in
from taskopt.record.viewer.regions import Regions
from taskopt.record.viewer.robot3d import RobotDrawing
from taskopt.record.viewer.writer import Stage

MOTION = 0.01  # [s] between two poses of the robot
DETAIL = 0.04  # [s] between two segments of a path, two ellipsoids
_SAMPLES = 240  # points of a desired path
_ELLIPSOID = 0.09  # largest half-axis at the start, as a share of the robot's size


class Scene:
    """Draws all robots of a run, and moves them batch by batch."""

    def __init__(self, info: RunInfo) -> None:
        robot, q0 = info.scenario.robot, info.scenario.start
        self._info = info
        self._dt = info.scenario.dt
        self._robot = RobotDrawing(robot)
        self._at = Configuration(robot, q0)
        self._tracked = next((task.frame for task in info.plan.tasks if task.frame is not None), None)
        self._last: dict[str, Array] = {}
        self._placed = {task.name for task in info.plan.tasks if rows_in(task, "m").any()}
        self._desired = _desired_paths(info)
        around = [corners(obstacle) for obstacle in declared_obstacles(info)]
        known = [self._robot.corners(q0), *self._desired.values()]
        self.place = place_for(known, len(info.resolvers), around)
        self._scale = self._ellipsoid_scale()
        self._regions = Regions(info, self.place)

    def draw(self, stage: Stage) -> None:
        """Log what does not move: the shapes, the names, the colours."""
        import rerun as rr

        several = len(self._info.resolvers) > 1
        stage.static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for index, name in enumerate(self._info.resolvers):
            colour, path = resolver_colour(index), _world(name)
            stage.static(path, rr.Transform3D(translation=self.place.offset(index)))
            self._robot.draw(stage, f"{path}/robot", colour if several else None)
            self._robot.move(stage, f"{path}/robot", *_start(), self._info.scenario.start[None])
            self._draw_signs(stage, path, colour)
            self._regions.draw(stage, path)
            if several:
                self._draw_label(stage, path, colour, name)

    def _draw_label(self, stage: Stage, path: str, colour: int, label: str) -> None:
        """The resolver's name, behind a flat robot, above any other."""
        import rerun as rr

        place = self.place
        middle = 0.5 * (place.lower + place.upper)
        above = np.array([0.0, 0.0, place.upper[2] + 0.08 * place.size])
        spot = np.array([middle[0], place.upper[1], 0.0]) if place.flat else above
        sign = rr.Points3D(
            [spot], labels=[label], colors=colours(colour), radii=[0.002 * place.size], show_labels=True
        )
        stage.static(f"{path}/label", sign)

    def _draw_signs(self, stage: Stage, path: str, colour: int) -> None:
        """Desired paths, and the looks of what will move."""
        import rerun as rr

        line = rr.Radius.ui_points
        for task in self._info.plan.tasks:
            if task.frame is None:
                continue
            at = f"{path}/task/{part(task.name)}"
            if task.name in self._desired:
                desired = rr.LineStrips3D([self._desired[task.name]], colors=colours(TARGET), radii=line(1.2))
                stage.static(f"{at}/desired", desired)
                for kind, shade in (("actual", colour), ("error", ERROR)):
                    look = rr.LineStrips3D.from_fields(colors=colours(shade), radii=line(3.0))
                    stage.static(f"{at}/{kind}", look)
            stage.static(f"{at}/target", rr.TransformAxes3D(0.11 * self.place.size))
        solid = rr.Ellipsoids3D.from_fields(colors=colours(ELLIPSOID), fill_mode="solid")
        stage.static(f"{path}/ellipsoid", solid)

    def send(self, stage: Stage, batch: Batch) -> None:
        """Send poses at 100 Hz, paths and ellipsoids at 25 Hz."""
        path = _world(batch.resolver)
        pick = batch.every(MOTION, self._dt)
        self._robot.move(stage, f"{path}/robot", batch.index[pick], batch.time[pick], batch.q[pick])
        pick = batch.every(DETAIL, self._dt)
        if not len(pick):
            return
        self._regions.send(stage, path, batch, pick)
        for task in batch.frame_tasks:
            self._paths(stage, batch, task, pick, f"{path}/task/{part(task)}")
        if self._tracked is not None:
            self._ellipsoids(stage, batch, pick, self._tracked, f"{path}/ellipsoid")

    def _paths(self, stage: Stage, batch: Batch, task: str, pick: IntArray, path: str) -> None:
        import rerun as rr

        tick, time = batch.index[pick], batch.time[pick]
        actual = batch.actual(task)[pick]
        target = np.where(batch.in_force(task)[pick, None, None], batch.target(task)[pick], actual)
        placed = task in self._placed  # else it turns the frame wherever that is
        rotation, place = target[:, :3, :3].reshape(-1, 9), (target if placed else actual)[:, :3, 3]
        axes = rr.Transform3D.columns(translation=place, mat3x3=rotation)
        stage.columns(f"{path}/target", tick, time, axes)
        if not placed:
            return
        strips = np.stack([actual[:, :3, 3], target[:, :3, 3]], axis=1)
        stage.columns(f"{path}/error", tick, time, rr.LineStrips3D.columns(strips=list(strips)))
        points = actual[:, :3, 3]
        before: Array = self._last.get(path, points[:1])
        self._last[path] = points[-1:]
        segments = np.stack([np.concatenate([before, points[:-1]]), points], axis=1)
        stage.columns(f"{path}/actual", tick, time, rr.LineStrips3D.columns(strips=list(segments)))

    def _ellipsoids(self, stage: Stage, batch: Batch, pick: IntArray, frame: str, path: str) -> None:
        import rerun as rr

        centres, axes, turns = [], [], []
        for q in batch.q[pick]:
            centre, sigma, rotation = self._velocity_ellipsoid(frame, q)
            centres.append(centre)
            axes.append(np.maximum(self._scale * sigma, 0.004 * self.place.size))
            turns.append(_quaternion(rotation))
        shape = rr.Ellipsoids3D.columns(centers=centres, half_sizes=axes, quaternions=turns)
        stage.columns(path, batch.index[pick], batch.time[pick], shape)

    def _velocity_ellipsoid(self, frame: str, q: Array) -> tuple[Array, Array, Array]:
        """Centre, half-axes [m/s] and their directions: ṗ of the frame for ‖v‖ ≤ 1, ṗᵀ(J Jᵀ)⁻¹ṗ ≤ 1."""
        self._at.update(q)
        J = self._at.jacobian(frame)[:3]
        rotation, sigma, _ = np.linalg.svd(J @ J.T)
        return self._at.pose(frame)[:3, 3], np.sqrt(sigma), rotation

    def _ellipsoid_scale(self) -> float:
        if self._tracked is None:
            return 0.0
        largest = self._velocity_ellipsoid(self._tracked, self._info.scenario.start)[1].max()
        return _ELLIPSOID * self.place.size / max(float(largest), 1e-9)


def _world(resolver: str) -> str:
    return f"/world/{slug(resolver)}"


def _start() -> tuple[Any, Any]:
    return np.zeros(1, dtype=np.int64), np.zeros(1, dtype="timedelta64[ns]")


def _desired_paths(info: RunInfo) -> dict[str, Array]:
    """Where the references of the frame tasks will go, (samples, 3) each; known before the run."""
    plan, q0 = info.new_plan(), info.scenario.start
    plan.start(q0, 0.0)
    paths: dict[str, list[Array]] = {}
    for t in np.linspace(0.0, info.scenario.duration, _SAMPLES):
        plan.at(q0, float(t))
        for task in plan.tasks:
            if task.desired is not None and rows_in(task, "m").any():
                paths.setdefault(task.name, []).append(task.desired[:3, 3].copy())
    return {name: np.array(points) for name, points in paths.items()}


def _quaternion(rotation: Array) -> Array:
    """xyzw of the axes of an ellipsoid, made right-handed (a mirrored axis is the same ellipsoid)."""
    right = rotation * np.array([1.0, 1.0, np.sign(np.linalg.det(rotation))])
    turn = log3(right)
    half = 0.5 * float(np.linalg.norm(turn))
    return np.array([*(0.5 * np.sinc(half / np.pi) * turn), np.cos(half)])
