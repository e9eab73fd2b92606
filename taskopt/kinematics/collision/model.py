"""Pairs of solids, measured by Coal in memory that kernels can read."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Sequence

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, IntArray
from taskopt.errors import NotInstalled
from taskopt.hierarchy.tolerances import COAL_RETRY
from taskopt.kinematics.collision.pairs import SolidPair, shape_names, shapes_of
from taskopt.kinematics.engine import Data, GeometryModel
from taskopt.kinematics.geometry.coal import core, exact, obstacle_object, solid
from taskopt.kinematics.geometry.shapes import Shape, obstacle_names
from taskopt.kinematics.robot.joints import velocity_slice
from taskopt.kinematics.robot.robot import Robot

_RESULT = 20  # floats in a coal::DistanceResult; its normal, first and second point stand side by side


class Collision:
    """Named pairs of convex solids; `update` measures all of them at once.

    The distance of a pair is n · (p₂ − p₁), negative where the solids overlap. If the axes of two capsules
    cross, as they can in a planar arm, Coal finds no normal; n is then zero, and the distance is taken to be
    `crossed`.

    Attributes:
        robot: The robot.
        names: Name of each pair (P of them), such as "panda_link5 – sphere".
        shapes: All solids (`pin.GeometryModel`), those of the robot first.
        pairs: Indices in `shapes` of the two solids of each pair (P of them).
        joints: Indices of the two joints that carry the solids of each pair (P of them), 0 for the world.
        contact: (P, 9) a view of Coal's memory: unit normal n from the first solid to the second, nearest
            point p₁ on the first and p₂ on the second, in the world [m].
        crossed: (P,) minus the sum of the radii of the two solids [m].
        turn: (P, nv) +1 where a velocity moves the second solid alone, −1 for the first alone, 0 for both or
            neither.
    """

    def __init__(
        self, robot: Robot, names: Sequence[str], shapes: GeometryModel, pairs: Sequence[SolidPair]
    ) -> None:
        """Pair solids; most callers use `with_obstacles` or `of_itself`.

        Args:
            robot: The robot.
            names: Name of each pair (P of them).
            shapes: All solids; the pairs are added to them.
            pairs: Indices in `shapes` of the two solids of each pair (P of them).

        Raises:
            NotInstalled: This version of Coal has another layout of its results in memory.
        """
        self.robot, self.names, self.shapes, self.pairs = robot, tuple(names), shapes, tuple(pairs)
        for pair in pairs:
            shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._data = exact(shapes.createData())
        joints = [int(shape.parentJoint) for shape in shapes.geometryObjects]
        self.joints = tuple((joints[first], joints[second]) for first, second in pairs)
        self.turn = np.zeros((len(pairs), robot.nv))
        moves = {joint: _moves(robot, joint) for joint in set(joints)}
        for row, (first, second) in zip(self.turn, self.joints, strict=True):
            row[:] = moves[second] - moves[first]
        radius = [core(shape)[1] for shape in shapes.geometryObjects]
        self.crossed: Array = np.array([-radius[first] - radius[second] for first, second in pairs])
        self.contact = self._contacts()

    @staticmethod
    def with_obstacles(
        robot: Robot, obstacles: Iterable[Shape], links: Iterable[str] | None = None
    ) -> "Collision":
        """Pair the shapes of a robot with obstacles, under names such as "panda_link5 – sphere".

        Args:
            robot: The robot.
            obstacles: The obstacles; their names are numbered where several are the same.
            links: Names of the links; default: all links that move.

        Returns:
            The pairs, obstacle by obstacle.

        Raises:
            UnknownName: No link with a shape has that name.
            InvalidValue: The robot has no shapes.
        """
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
    def of_itself(robot: Robot, pairs: Sequence[SolidPair]) -> "Collision":
        """Pair shapes of a robot with one another, under names such as "panda_link0 – panda_hand".

        Args:
            robot: The robot.
            pairs: Indices in `robot.geometry` of the two shapes of each pair.

        Returns:
            The pairs in the order given.
        """
        known = shape_names(robot)
        names = [f"{known[first]} – {known[second]}" for first, second in pairs]
        return Collision(robot, names, solid(robot.geometry), pairs)

    def update(self, data: Data) -> None:
        """Measure all pairs, into `contact`.

        Args:
            data: `pin.Data` in which the poses of the joints are up to date.
        """
        pin.updateGeometryPlacements(self.robot.model, data, self.shapes, self._data)
        pin.computeDistances(self.shapes, self._data)

    def update_some(self, data: Data, pairs: IntArray) -> None:
        """Measure some pairs, into their rows of `contact`; the other rows stay as they were.

        Args:
            data: `pin.Data` with the joints placed.
            pairs: Indices of the pairs.
        """
        shapes, memory, measure = self.shapes, self._data, pin.computeDistance
        pin.updateGeometryPlacements(self.robot.model, data, shapes, memory)
        for pair in pairs.tolist():
            measure(shapes, memory, pair)

    def remeasure(self, pairs: IntArray | None = None) -> None:
        """Measure pairs again whose nearest points coincide or are NaN, with a larger tolerance.

        About once in 10⁷ distances Coal's iteration fails by rounding: it returns NaN, or zero for solids
        that are half a metre apart.

        Args:
            pairs: Indices of the pairs to look at; default: all.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        apart = np.abs(self.contact[pairs, 6:] - self.contact[pairs, 3:6]).max(axis=1)
        for pair in pairs[~(apart > 0.0)]:
            request = self._data.distanceRequests[int(pair)]
            asked, request.gjk_tolerance = request.gjk_tolerance, COAL_RETRY
            pin.computeDistance(self.shapes, self._data, int(pair))
            request.gjk_tolerance = asked

    def _contacts(self) -> Array:
        """View the results of Coal as one array (P, 9), since reading each alone takes a microsecond.

        Raises `NotInstalled` if this version of Coal has another layout.
        """
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


def _moves(robot: Robot, joint: int) -> Array:
    """Return (nv,) with 1 where a velocity moves a joint."""
    out = np.zeros(robot.nv)
    for i in robot.model.supports[joint]:
        out[velocity_slice(robot.model.joints[i])] = 1.0
    return out
