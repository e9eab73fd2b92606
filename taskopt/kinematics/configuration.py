"""A robot at q: forward kinematics, Jacobians and their derivatives, computed once per update.

The kernels at the end of the module compute pose and Jacobian of a frame from Pinocchio's joint Jacobians.
They allocate nothing, so that the kernels of tasks can call them on every tick. Their arrays are

    joint_jacobians    (6, nv) spatial twist of the world's origin for each velocity: linear, then angular
    pose               (4, 4) of the frame in the world, translation in [m]
    columns            (k,) the columns of the Jacobian that move the frame
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue, NotInstalled
from taskopt.jit import kernel
from taskopt.kinematics.engine import Data
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class FrameView:
    """Views into the memory of a configuration, from which a kernel computes the pose of a frame.

    Attributes:
        joint_rotation: Rotation (3, 3) of the frame's joint in the world; changes with every update.
        joint_translation: Origin (3,) [m] of the frame's joint in the world; changes with every update.
        placement: (4, 4) pose of the frame in its joint, constant.
        columns: (k,) columns of the Jacobian that move the frame, constant.
        memory: The object that owns the memory of the views, kept alive by this reference.
    """

    joint_rotation: Array
    joint_translation: Array
    placement: Array
    columns: IntArray
    memory: object


class Configuration:
    """A robot at q, with the joint poses and joint Jacobians that belong to it.

    `update` changes it in place and allocates nothing, so that a control loop uses one configuration
    throughout.

    Attributes:
        robot: The robot.
        q: (nq,) [rad, m], overwritten by `update`.
        joint_jacobians: (6, nv), a view of Pinocchio's memory: for each velocity the spatial twist at the
            origin of the world, linear then angular, along the axes of the world.
        jacobian_rates: (6, nv), a view of Pinocchio's memory: the derivative of `joint_jacobians` by time, as
            of the last `update` with a velocity.
        joint_placements: (joints + 1, 12), a view of Pinocchio's memory: pose of each joint in the world, the
            rotation column by column and then the translation [m]; the world itself comes first.
    """

    def __init__(self, robot: Robot, q: ArrayLike) -> None:
        """Place a robot at q.

        Args:
            robot: The robot.
            q: (nq,) [rad, m].

        Raises:
            InvalidValue: q has the wrong size, a number that is not finite, or a quaternion that is not of
                norm 1; or the robot is none.
        """
        if not isinstance(robot, Robot):
            raise InvalidValue(f"robot must be a Robot, as Robot.load makes one, got {robot!r}")
        robot.require_unchanged()
        self.robot = robot
        self.q: Array = robot.checked_q(q)
        self._shape = self.q.shape
        self._model, self._data = robot.model, robot.model.createData()
        self._views: dict[str, FrameView] = {}
        # Pinocchio's array is in Fortran order, and for nv = 1 it has lost its second axis.
        self.joint_jacobians: Array = self._data.J.reshape((6, robot.nv), order="F")
        self.jacobian_rates: Array = self._data.dJ.reshape((6, robot.nv), order="F")
        self.joint_placements: Array = _placements(self._data)
        self.update(self.q)

    def __reduce__(self) -> tuple[type["Configuration"], tuple[Robot, Array]]:
        return Configuration, (self.robot, self.q.copy())

    def update(self, q: Array, v: Array | None = None) -> None:
        """Move the robot to q, in place.

        Args:
            q: (nq,) [rad, m]. Only its size is checked, since this is called on every tick.
            v: Velocity (nv,) [rad/s, m/s] along which `jacobian_rates` are computed; None leaves them.

        Raises:
            InvalidValue: q has the wrong size.
        """
        self.take(q)
        if v is None:
            pin.computeJointJacobians(self._model, self._data, self.q)
        else:
            pin.computeJointJacobiansTimeVariation(self._model, self._data, self.q, v)

    def take(self, q: Array) -> None:
        """Take a posture without placing the joints there, which `place_joints` must do then.

        Args:
            q: (nq,) [rad, m].

        Raises:
            InvalidValue: q has the wrong size.
        """
        if q.shape != self._shape:
            raise InvalidValue(f"q of {self.robot.name} must have {self.robot.nq} numbers, got {q.shape}")
        self.q[...] = q

    def frame(self, name: str) -> FrameView:
        """Return the views of a frame that kernels need.

        Args:
            name: The frame.

        Returns:
            Views that follow every `update`.

        Raises:
            UnknownName: The robot has no frame of that name.
        """
        if name not in self._views:
            frame = self._model.frames[self.robot.frame_id(name)]
            joint = self._data.oMi[frame.parentJoint]
            self._views[name] = FrameView(
                joint.rotation,
                joint.translation,
                frame.placement.homogeneous,
                self.robot.support(name),
                self._data,
            )
        return self._views[name]

    def pose(self, frame: str) -> Array:
        """Compute the pose of a frame.

        Args:
            frame: Name of the frame.

        Returns:
            (4, 4) pose in the world, translation in [m]; a new array.

        Raises:
            UnknownName: The robot has no frame of that name.

        Source:
            (3.1).
        """
        view, out = self.frame(frame), np.empty((4, 4))
        frame_pose_into(view.joint_rotation, view.joint_translation, view.placement, out)
        return out

    def frame_into(self, frame: str, pose: Array, jacobian: Array) -> None:
        """Write pose and Jacobian of a frame into existing arrays, without an allocation in each tick.

        Args:
            frame: Name of the frame.
            pose: (4, 4) receives the pose in the world, translation in [m].
            jacobian: (6, nv) receives the geometric Jacobian along the axes of the world.

        Raises:
            UnknownName: The robot has no frame of that name.
        """
        view = self.frame(frame)
        frame_pose_into(view.joint_rotation, view.joint_translation, view.placement, pose)
        frame_jacobian_into(self.joint_jacobians, pose, view.columns, jacobian)

    @property
    def data(self) -> Data:
        """Pinocchio's own memory (`pin.Data`), with the joints placed at q."""
        return self._data

    def joint_poses(self) -> Array:
        """Return the poses (joints + 1, 4, 4) of all joints in the world [m], with the world itself first."""
        return np.array([placement.homogeneous for placement in self._data.oMi])

    def jacobian(self, frame: str, expressed: Literal["world", "own"] = "world") -> Array:
        """Compute the geometric Jacobian of a frame, which maps v (nv,) to its velocity.

        Args:
            frame: Name of the frame.
            expressed: "world" for rows along the axes of the world, "own" for the axes of the frame.

        Returns:
            J (6, nv): linear velocity of the frame's origin [m/s per unit of v], then angular [rad/s per unit
            of v]; a new array.

        Raises:
            UnknownName: The robot has no frame of that name.
            InvalidValue: `expressed` is another word.

        Source:
            (3.5), and (3.31) for the columns.
        """
        if expressed not in ("world", "own"):
            raise InvalidValue(f"expressed must be 'world' or 'own', got {expressed!r}")
        pose, out = self.pose(frame), np.empty((6, self.robot.nv))
        frame_jacobian_into(self.joint_jacobians, pose, self.frame(frame).columns, out)
        if expressed == "own":
            out[:3], out[3:] = pose[:3, :3].T @ out[:3], pose[:3, :3].T @ out[3:]
        return out

    def centre_of_mass(self) -> tuple[Array, Array]:
        """Compute the centre of mass and its Jacobian.

        Returns:
            The centre of mass (3,) [m] in the world, and its Jacobian (3, nv) along the axes of the world;
            both are new arrays.
        """
        J = pin.jacobianCenterOfMass(self._model, self._data, False)
        return self._data.com[0].copy(), np.array(J).reshape((3, self.robot.nv), order="F")

    def mass_matrix(self) -> Array:
        """Compute the mass matrix M(q), for which ½ vᵀ M v is the kinetic energy.

        Returns:
            (nv, nv) symmetric array, a new one [kg m², kg m, kg].
        """
        M = np.triu(pin.crba(self._model, self._data, self.q, pin.Convention.LOCAL))
        return M + np.triu(M, 1).T

    def hessian(self, frame: str) -> Array:
        """Compute the derivative of a frame's Jacobian by the joint variables, in the axes of the world.

        Args:
            frame: Name of the frame.

        Returns:
            (6, nv, nv) array H with H[:, j, k] = ∂J[:, j]/∂q_k. The derivative by q_k is taken along velocity
            k of the robot, also for joints with quaternions.

        Raises:
            UnknownName: The robot has no frame of that name.
        """
        nv = self.robot.nv
        out = np.empty((6, nv, nv))
        frame_hessian_into(self.jacobian(frame), self.frame(frame).columns, self.robot.column_joint, out)
        return out


def _placements(data: Data) -> Array:
    """View the poses of all joints as one array (joints + 1, 12), as they stand in Pinocchio's memory.

    A kernel needs one array for all joints, while Pinocchio returns one array for each. Raises `NotInstalled`
    if this build of Pinocchio has another layout.
    """
    first = data.oMi[0].rotation.T.reshape(9)
    view = np.lib.stride_tricks.as_strided(first, (len(data.oMi), 12), (12 * first.itemsize, first.itemsize))
    for row, placement in zip(view, data.oMi, strict=True):
        if (_address(row), _address(row[9:])) != (
            _address(placement.rotation),
            _address(placement.translation),
        ):
            raise NotInstalled("a Pinocchio whose joint poses lie side by side in memory", "'pin>=4.1,<5'")
    return view


def _address(array: Array) -> int:
    """Return the address of the first number of an array."""
    return array.__array_interface__["data"][0]


@kernel
def frame_pose_into(joint_rotation, joint_translation, placement, out):
    """Compute the pose of a frame from that of its joint.

    Args:
        joint_rotation: (3, 3) rotation of the joint in the world.
        joint_translation: (3,) origin of the joint in the world [m].
        placement: (4, 4) pose of the frame in the joint.
        out: (4, 4) receives the pose of the frame in the world.
    """
    for i in range(3):
        r0, r1, r2 = joint_rotation[i, 0], joint_rotation[i, 1], joint_rotation[i, 2]
        for j in range(4):
            out[i, j] = r0 * placement[0, j] + r1 * placement[1, j] + r2 * placement[2, j]
        out[i, 3] += joint_translation[i]
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@kernel
def frame_jacobian_into(joint_jacobians, pose, columns, out):
    """Compute the Jacobian of a frame along the axes of the world, with columns (v + ω × p, ω).

    Args:
        joint_jacobians: (6, nv) joint Jacobians at the origin of the world.
        pose: (4, 4) pose of the frame in the world, p its translation [m].
        columns: (k,) columns that move the frame.
        out: (6, nv) receives the Jacobian; all other columns become zero.

    Source:
        (3.5).
    """
    px, py, pz = pose[0, 3], pose[1, 3], pose[2, 3]
    out[:] = 0.0
    for c in columns:
        wx, wy, wz = joint_jacobians[3, c], joint_jacobians[4, c], joint_jacobians[5, c]
        out[0, c] = joint_jacobians[0, c] + wy * pz - wz * py
        out[1, c] = joint_jacobians[1, c] + wz * px - wx * pz
        out[2, c] = joint_jacobians[2, c] + wx * py - wy * px
        out[3, c], out[4, c], out[5, c] = wx, wy, wz


@kernel
def frame_hessian_into(jacobian, columns, column_joint, out):
    """Compute the derivatives ∂J[:, j]/∂q_k of a Jacobian, all along the axes of the world.

    A joint k at or before j turns the whole column, so that the derivative is (ω_k × v_j, ω_k × ω_j). A joint
    k behind j only moves the origin of the frame, so that it is (ω_j × v_k, 0). This holds for joints whose
    axes are constant in their own frame, as all joints of a URDF file are.

    Args:
        jacobian: (6, nv) Jacobian of the frame, as `frame_jacobian_into` writes it.
        columns: (k,) columns that move the frame.
        column_joint: (nv,) index of the joint of each column, see `Robot.column_joint`.
        out: (6, nv, nv) receives the derivative at [:, j, k].
    """
    out[:] = 0.0
    for j in columns:
        for k in columns:
            before = column_joint[k] <= column_joint[j]
            turns, moved = (k, j) if before else (j, k)
            wx, wy, wz = jacobian[3, turns], jacobian[4, turns], jacobian[5, turns]
            for part in range(0, 6 if before else 3, 3):
                x, y, z = jacobian[part, moved], jacobian[part + 1, moved], jacobian[part + 2, moved]
                out[part, j, k] = wy * z - wz * y
                out[part + 1, j, k] = wz * x - wx * z
                out[part + 2, j, k] = wx * y - wy * x
