"""The kinematic tree of a robot for lock-step, and the kernel that places its joints.

Each joint has a frame of its own whose z axis is the axis of the joint, so that one rule holds for joints
about any axis: turn the x and y axes, or move along z.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.jit.pack import load, spread, store
from taskopt.kinematics.engine import JointModel
from taskopt.kinematics.lockstep.functions import sine_cosine
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.joints import kind_and_axis

REVOLUTE, PRISMATIC = 0, 1
_NUMBERS = {"revolute": REVOLUTE, "prismatic": PRISMATIC}


class Chain(NamedTuple):
    """The kinematic tree; a joint is known by the index of its velocity.

    Attributes:
        parent: Joint on which each joint stands, or −1 for the world, (nv,).
        kind: REVOLUTE or PRISMATIC, (nv,).
        position: Index of each joint's coordinate in q, (nv,).
        place: Pose of each joint at zero in the frame of its parent, (nv, 12).
    """

    parent: IntArray
    kind: IntArray
    position: IntArray
    place: Array


class Tree:
    """The kinematic tree of a robot, read once.

    Args:
        robot: The robot.

    Attributes:
        chain: The arrays.

    Raises:
        InvalidValue: A joint is neither revolute nor prismatic, or couplings tie joints together.
    """

    def __init__(self, robot: Robot) -> None:
        if robot.couplings:
            raise InvalidValue(
                f"a batch cannot keep the couplings of {robot.name}: {robot.couplings[0]}; lock these joints"
            )
        model = robot.model
        self._robot = robot
        self._columns = [-1, *(joint.idx_v for joint in list(model.joints)[1:])]
        self._turned = [np.eye(4)]
        n = robot.nv
        parent, kind, position = np.zeros((3, n), np.int64)
        place = np.zeros((n, 12))
        for i, joint in list(enumerate(model.joints))[1:]:
            j = joint.idx_v
            kind[j], axis = _kind_and_axis(robot, model.names[i], joint)
            self._turned.append(_onto_z(axis))
            parent[j], position[j] = self._columns[model.parents[i]], joint.idx_q
            placed = self._turned[model.parents[i]].T @ model.jointPlacements[i].homogeneous
            place[j] = twelve(placed @ self._turned[i])
        self.chain = Chain(parent, kind, position, place)

    def placed(self, frame: str) -> tuple[int, Array]:
        """Find where a frame stands.

        Args:
            frame: Name of the frame.

        Returns:
            The joint of the frame, −1 for the world, and the frame's pose (12,) in the frame of that joint.
        """
        found = self._robot.model.frames[self._robot.frame_id(frame)]
        joint = found.parentJoint
        return self._columns[joint], twelve(self._turned[joint].T @ found.placement.homogeneous)


def twelve(pose: Array) -> Array:
    """Convert poses to twelve numbers each: the columns of the rotation, then the translation.

    Args:
        pose: Poses, (…, 4, 4).

    Returns:
        The numbers, (…, 12).
    """
    return np.swapaxes(pose[..., :3, :], -1, -2).reshape(*pose.shape[:-2], 12)


def homogeneous(numbers: Array) -> Array:
    """Convert poses that `twelve` wrote back to homogeneous matrices.

    Args:
        numbers: Poses, (…, 12).

    Returns:
        Poses, (…, 4, 4).
    """
    poses = np.zeros((*numbers.shape[:-1], 4, 4))
    poses[..., :3, :] = np.swapaxes(numbers.reshape(*numbers.shape[:-1], 4, 3), -1, -2)
    poses[..., 3, 3] = 1.0
    return poses


def _kind_and_axis(robot: Robot, name: str, joint: JointModel) -> tuple[int, Array]:
    """Return the kind and the axis of a joint, or raise an error that names it."""
    found = kind_and_axis(joint)
    if found is None or found[0] not in _NUMBERS:
        raise InvalidValue(
            f"a batch takes revolute and prismatic joints with one coordinate, and {name} of {robot.name} is "
            f"of Pinocchio's kind {joint.shortname().removeprefix('JointModel')}; lock it, or use a "
            "Controller for each robot"
        )
    return _NUMBERS[found[0]], found[1]


def _onto_z(axis: Array) -> Array:
    """Return a rotation (4, 4) that turns z onto an axis."""
    x = np.roll(axis, -2) if np.count_nonzero(axis) == 1 else np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    turned = np.eye(4)
    turned[:3, 0] = x / np.linalg.norm(x)
    turned[:3, 1], turned[:3, 2] = np.cross(axis, turned[:3, 0]), axis
    return turned


@kernel
def place_joints(chain, q, poses, jacobians):
    """Compute the poses of all joints and the columns of their Jacobians, (3.31).

    Args:
        chain: The kinematic tree, see `Chain`.
        q: Coordinates of the joints, (nv, 8) [rad, m].
        poses: (12 nv, 8) receives the poses of the joints' frames.
        jacobians: (6 nv, 8) receives for each joint the spatial twist of its unit velocity at the origin of
            the world, linear then angular.
    """
    for j in range(chain.parent.size):
        place_on(chain.parent[j], chain.place, j, poses, 12 * j)
        if chain.kind[j] == REVOLUTE:
            s, c = sine_cosine(load(q, j))
            for k in range(12 * j, 12 * j + 3):
                x, y = load(poses, k), load(poses, k + 3)
                store(poses, k, c * x + s * y)
                store(poses, k + 3, c * y - s * x)
        else:
            for k in range(12 * j, 12 * j + 3):
                store(poses, k + 9, load(poses, k + 9) + load(q, j) * load(poses, k + 6))
        wx, wy, wz = load(poses, 12 * j + 6), load(poses, 12 * j + 7), load(poses, 12 * j + 8)
        if chain.kind[j] == REVOLUTE:
            px, py, pz = load(poses, 12 * j + 9), load(poses, 12 * j + 10), load(poses, 12 * j + 11)
            store(jacobians, 6 * j, py * wz - pz * wy)
            store(jacobians, 6 * j + 1, pz * wx - px * wz)
            store(jacobians, 6 * j + 2, px * wy - py * wx)
            store(jacobians, 6 * j + 3, wx)
            store(jacobians, 6 * j + 4, wy)
            store(jacobians, 6 * j + 5, wz)
        else:
            store(jacobians, 6 * j, wx)
            store(jacobians, 6 * j + 1, wy)
            store(jacobians, 6 * j + 2, wz)
            for k in range(3, 6):
                store(jacobians, 6 * j + k, spread(0.0))


@kernel
def place_on(joint, place, i, poses, out):
    """Compute the pose of a frame that stands on a joint.

    Args:
        joint: Index of the joint, −1 for the world.
        place: Poses in the frames of joints, (any, 12).
        i: Row of the frame in `place`.
        poses: Packs of poses, twelve for each joint; receives the pose of the frame.
        out: Index of the first pack of the result.
    """
    if joint < 0:
        for k in range(12):
            store(poses, out + k, spread(place[i, k]))
        return
    at = 12 * joint
    for r in range(3):
        x, y, z = load(poses, at + r), load(poses, at + 3 + r), load(poses, at + 6 + r)
        for c in range(3):
            k = 3 * c
            store(poses, out + k + r, x * place[i, k] + y * place[i, k + 1] + z * place[i, k + 2])
        moved = x * place[i, 9] + y * place[i, 10] + z * place[i, 11]
        store(poses, out + 9 + r, moved + load(poses, at + 9 + r))
