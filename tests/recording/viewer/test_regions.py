"""Regions of inequality tasks in the scene: cones have their angle, boxes their sides, cones move along."""

import numpy as np
import pytest

from taskopt import Configuration, JointTask, Scenario, Stack
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.task import BoxTask, During, GazeTask
from taskopt.loop.run import run
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.arrangement import Arrangement
from taskopt.recording.viewer.motion import motion_of
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.regions import Regions, cone_lines
from taskopt.resolver.active_set.resolver import ActiveSet


class Told:
    """What a stage would be told, by path."""

    def __init__(self) -> None:
        self.logged: dict[str, object] = {}

    def log_static(self, path: str, *archetypes: object) -> None:
        self.logged[path] = archetypes[0]

    def send_columns(self, path: str, tick: object, time: object, columns: object) -> None:
        self.logged[f"{path} moves"] = columns


@pytest.mark.parametrize("half_angle", [0.3, 2.0])
def test_every_line_of_a_cone_is_at_its_half_angle(half_angle):
    """About any axis, the axes of the frame included, the rim and the ends of the sides are on the cone."""
    for axis in (*np.eye(3), np.array([2.0, -1.0, 0.5])):
        unit = axis / np.linalg.norm(axis)
        rim, *sides = cone_lines(unit, half_angle, 0.7)
        points = np.vstack([rim, *[side[1:] for side in sides]])
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.7, rtol=1e-12)
        np.testing.assert_allclose(points @ unit, 0.7 * np.cos(half_angle), atol=1e-12)
        np.testing.assert_allclose(rim[0], rim[-1], atol=1e-12)


def test_boxes_stand_with_their_open_sides_at_the_end_of_the_scene_and_cones_move():
    """Timed tasks have their regions too; a cone has the pose of its frame in each tick that is drawn."""
    arm = planar_arm([0.5, 0.5])
    box = BoxTask("tip", [0.2, -np.inf, -np.inf], [0.9, np.inf, np.inf], name="box")
    look = During(GazeTask("tip", target=(1.0, 1.0, 0.0), half_angle=0.5, axis=(1, 0, 0), name="look"))
    stack = Stack([[box, look], [JointTask([1.0, 0.3])]])
    scenario = Scenario(robot=arm, q0=[0.3, 0.5], stack=stack, duration=0.02, dt=2e-3, name="regions")
    place = Arrangement(np.full(3, -2.0), np.full(3, 2.0), flat=False, columns=1)
    plan, stage = RunInfo(scenario, ("active-set",)).plan, Told()
    boxes = {task.name: task.box for task in plan.tasks if task.box is not None}
    cones = {task.name: task.cone for task in plan.tasks if task.cone is not None}
    regions = Regions(arm, boxes, cones, place)
    regions.draw(stage, "active-set")  # type: ignore[arg-type]
    drawn = stage.logged[world_path("active-set", "task", "box", "region")]
    half, centre = (np.array(getattr(drawn, name).as_arrow_array().to_pylist()[0]) for name in
                    ("half_sizes", "centers"))  # fmt: skip
    np.testing.assert_allclose(centre - half, [0.2, -2.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(centre + half, [0.9, 2.0, 2.0], atol=1e-6)
    batch = Batch(tuple(run(scenario, ActiveSet())))
    regions.send(stage, "active-set", motion_of(batch), np.array([0, 9]))  # type: ignore[arg-type]
    assert world_path("active-set", "task", "look", "region") in stage.logged
    columns = list(stage.logged[world_path("active-set", "task", "look", "region") + " moves"])  # type: ignore[call-overload]
    places = next(c.as_arrow_array().to_pylist() for c in columns if "translation" in str(c.descriptor))
    for place_, k in zip(places, (0, 9), strict=True):
        np.testing.assert_allclose(place_[0], Configuration(arm, batch.q[k]).pose("tip")[:3, 3], atol=1e-6)
