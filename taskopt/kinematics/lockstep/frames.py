"""Poses and Jacobians of one frame for many postures at once, and checks of many poses."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.jit import kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.jit.pack import PACK, load, store
from taskopt.kinematics.lockstep.chain import Tree, homogeneous, place_joints, place_on
from taskopt.kinematics.pose import is_pose
from taskopt.kinematics.robot import Robot


def frame_poses(robot: Robot, frame: str, q: ArrayLike) -> Array:
    """Compute the pose of a frame at many postures at once, (3.1).

    Args:
        robot: The robot; its joints are revolute or prismatic, with one coordinate each.
        frame: Name of the frame.
        q: Postures, (N, nq) [rad, m].

    Returns:
        Poses in the world, (N, 4, 4), translation in [m].

    Raises:
        UnknownName: The robot has no frame of that name.
        InvalidValue: q has the wrong shape or is not finite, or a joint is of another kind.
    """
    return _measured(robot, frame, q)[0]


def frame_jacobians(robot: Robot, frame: str, q: ArrayLike) -> Array:
    """Compute the geometric Jacobian of a frame at many postures at once, along the axes of the world, (3.5).

    Args:
        robot: The robot; its joints are revolute or prismatic, with one coordinate each.
        frame: Name of the frame.
        q: Postures, (N, nq) [rad, m].

    Returns:
        Jacobians (N, 6, nv): linear velocity of the frame's origin [m/s per unit of v], then angular [rad/s
        per unit of v].

    Raises:
        UnknownName: The robot has no frame of that name.
        InvalidValue: q has the wrong shape or is not finite, or a joint is of another kind.
    """
    return _measured(robot, frame, q)[1]


def _measured(robot: Robot, frame: str, q: ArrayLike) -> tuple[Array, Array]:
    """Return poses and Jacobians of a frame."""
    tree = Tree(robot)
    joint, place = tree.placed(frame)
    postures = finite("q", q, (None, robot.nq))
    count, nv = len(postures), robot.nv
    moves = np.zeros(nv, np.int64)
    moves[robot.support(frame)] = 1
    numbers, jacobians = np.empty((count, 12)), np.zeros((count, 6, nv))
    memory = np.zeros((nv + 12 * (nv + 1) + 6 * nv, PACK))
    place_frames(tree.chain, (joint, place[None], moves), postures, (numbers, jacobians), memory)
    return homogeneous(numbers), jacobians


@kernel_apart
def place_frames(chain, frame, q, out, memory):
    """Compute poses and Jacobians of one frame.

    Args:
        chain: The kinematic tree, see `Chain`.
        frame: Joint of the frame, its pose in that joint (1, 12), and 1 for each joint that moves it, (nv,).
        q: Postures, (N, nq) [rad, m].
        out: Receives poses (N, 12) and Jacobians (N, 6, nv), whose other columns are zero.
        memory: Packs, (19 nv + 12, 8).
    """
    nv, (joint, place, moves), (numbers, jacobians) = chain.parent.size, frame, out
    memory = borrowed(memory)
    at, end = memory[nv:], memory.shape[0]
    for first in range(0, q.shape[0], PACK):
        for lane in range(PACK):
            arm = min(first + lane, q.shape[0] - 1)
            for j in range(nv):
                memory[j, lane] = q[arm, chain.position[j]]
        twists = memory[end - 6 * nv :]
        place_joints(chain, memory, at, twists)
        place_on(joint, place, 0, at, 12 * nv)
        for lane in range(min(PACK, q.shape[0] - first)):
            for k in range(12):
                numbers[first + lane, k] = at[12 * nv + k, lane]
        p = 12 * nv + 9
        px, py, pz = load(at, p), load(at, p + 1), load(at, p + 2)
        for j in range(nv):
            if moves[j] != 0:
                wx, wy, wz = load(twists, 6 * j + 3), load(twists, 6 * j + 4), load(twists, 6 * j + 5)
                store(twists, 6 * j, load(twists, 6 * j) + wy * pz - wz * py)
                store(twists, 6 * j + 1, load(twists, 6 * j + 1) + wz * px - wx * pz)
                store(twists, 6 * j + 2, load(twists, 6 * j + 2) + wx * py - wy * px)
                for lane in range(min(PACK, q.shape[0] - first)):
                    for k in range(6):
                        jacobians[first + lane, k, j] = twists[6 * j + k, lane]


@kernel_apart
def take_poses(poses, out):
    """Write poses as twelve numbers each, and return the index of the first that is none, or −1.

    Args:
        poses: (N, 4, 4), translation in [m].
        out: (N, 12) receives the columns of the rotations, then the translations.
    """
    for arm in range(poses.shape[0]):
        pose = poses[arm]
        if not is_pose(pose):
            return arm
        for c in range(4):
            for r in range(3):
                out[arm, 3 * c + r] = pose[r, c]
    return -1
