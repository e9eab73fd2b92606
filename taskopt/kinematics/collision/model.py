"""Distances between the shapes of a robot and obstacles, or one another, in memory that kernels can read."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, NotInstalled
from taskopt.kinematics.collision.pairs import Pair, shape_names, shapes_of
from taskopt.kinematics.geometry.coal import core, exact, obstacle_object, solid
from taskopt.kinematics.geometry.shapes import Shape, obstacle_names
from taskopt.kinematics.robot.robot import Robot

_ROUGH = 1e-9  # distances are good to it even so
_RESULT = 20  # floats that a coal::DistanceResult takes; normal, first and second point stand side by side


class Collision:
    """Pairs of convex solids, each with a name; `update` measures all of them at once.

    `contact` (P, 9) is Coal's own memory: unit normal from the first solid to the second, witness point
    on the first, and on the second, in the world [m]. The distance is normal · (second − first), negative
    where they overlap. Where the cores of two capsules cross, as they do in a planar arm, Coal has no
    normal, which is then zero, and the distance is `crossed` (P,), minus the sum of the radii. `turn` (P, nv)
    has +1 where a velocity moves the second solid alone, −1 for the first alone, 0 for both or neither.
    """

    def __init__(self, robot: Robot, names: Sequence[str], shapes: Any, pairs: Sequence[Pair]) -> None:
        self.robot, self.names, self.shapes, self.pairs = robot, tuple(names), shapes, tuple(pairs)
        for pair in pairs:
            shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._data = exact(shapes.createData())
        joints = [int(shape.parentJoint) for shape in shapes.geometryObjects]
        self.joints = tuple((joints[first], joints[second]) for first, second in pairs)
        self.turn = np.zeros((len(pairs), robot.nv))
        for row, (first, second) in zip(self.turn, self.joints, strict=True):
            row[:] = _moves(robot, second) - _moves(robot, first)
        radius = [core(shape)[1] for shape in shapes.geometryObjects]
        self.crossed: Array = np.array([-radius[first] - radius[second] for first, second in pairs])
        self.contact = self._contacts()

    @staticmethod
    def with_obstacles(
        robot: Robot, obstacles: Iterable[Shape], links: Iterable[str] | None = None
    ) -> "Collision":
        """Every shape that moves (or those of some links) against every obstacle, "panda_link5 – sphere"."""
        obstacles = tuple(obstacles)
        chosen, shapes = shapes_of(robot, links), solid(robot.geometry)
        known, called = shape_names(robot), obstacle_names(obstacles)
        pairs, names = [], []
        for obstacle, name in zip(obstacles, called, strict=True):
            place = shapes.addGeometryObject(obstacle_object(obstacle, f"obstacle: {name}"))
            pairs += [(i, place) for i in chosen]
            names += [f"{known[i]} – {name}" for i in chosen]
        return Collision(robot, names, shapes, pairs)

    @staticmethod
    def of_itself(robot: Robot, pairs: Sequence[Pair]) -> "Collision":
        """Shapes of the robot against one another, "panda_link0 – panda_hand"."""
        known = shape_names(robot)
        names = [f"{known[first]} – {known[second]}" for first, second in pairs]
        return Collision(robot, names, solid(robot.geometry), pairs)

    def update(self, data: Any) -> None:
        """Measure at the joint poses of a pin.Data."""
        pin.updateGeometryPlacements(self.robot.model, data, self.shapes, self._data)
        pin.computeDistances(self.shapes, self._data)

    def remeasure(self) -> None:
        """Measure pairs with one and the same witness point, or NaN, again, with less accuracy asked for.

        About once in 10^7 Coal's iteration runs into rounding: it says NaN, or that solids half a metre apart
        touch.
        """
        apart = np.abs(self.contact[:, 6:] - self.contact[:, 3:6]).max(axis=1)
        for pair in np.flatnonzero(~(apart > 0.0)):
            request = self._data.distanceRequests[int(pair)]
            asked, request.gjk_tolerance = request.gjk_tolerance, _ROUGH
            pin.computeDistance(self.shapes, self._data, int(pair))
            request.gjk_tolerance = asked

    def _contacts(self) -> Array:
        """(P, 9) over the results of Coal; asked one by one they cost a microsecond each."""
        results = self._data.distanceResults
        if not self.pairs:
            return np.zeros((0, 9))
        first = results[0].normal
        step = first.itemsize
        view = np.lib.stride_tricks.as_strided(
            first, (len(results), 9), (_RESULT * step, step), writeable=False
        )
        data = self.robot.model.createData()
        pin.forwardKinematics(self.robot.model, data, self.robot.posture("middle"))
        self.update(data)
        for row, result in zip(view, results, strict=True):
            shown = [result.normal, result.getNearestPoint1(), result.getNearestPoint2()]
            if not np.array_equal(row, np.concatenate(shown), equal_nan=True):
                raise NotInstalled("a Coal whose distance results lie as in version 3.0", "'coal>=3.0,<3.1'")
        return view


def checked_obstacles(obstacles: Any) -> tuple[Shape, ...]:
    """The obstacles as a tuple; raise `InvalidValue` for none, or for what is no shape."""
    if isinstance(obstacles, Shape):
        obstacles = (obstacles,)
    out = tuple(obstacles)
    for item in out or [None]:
        if not isinstance(item, Shape):
            raise InvalidValue(
                f"obstacles must be a list of Sphere, Capsule, Box or HalfSpace, got {item!r} in it"
            )
    return out


def _moves(robot: Robot, joint: int) -> Array:
    """(nv,) 1 where a velocity moves a joint."""
    out = np.zeros(robot.nv)
    for i in robot.model.supports[joint]:
        if i > 0:
            out[robot.model.joints[i].idx_v : robot.model.joints[i].idx_v + robot.model.joints[i].nv] = 1.0
    return out
