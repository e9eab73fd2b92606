"""A robot at q: forward kinematics, Jacobians and their derivatives, computed once per update."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue, NotInstalled
from taskopt.jit import kernel
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class FrameView:
    """Where a frame stands in the memory of a configuration: what a kernel needs to place it.

    The rotation (3, 3) and translation (3,) of its joint change with every update; the frame's
    placement (4, 4) in the joint and the columns of J that move it do not. `memory` owns what is viewed.
    """

    joint_rotation: Array
    joint_translation: Array
    placement: Array
    columns: IntArray
    memory: object


class Configuration:
    """A robot at q (nq,), with the joint Jacobians and joint poses that belong to it.

    `update` moves it in place and allocates nothing, which is the way of a control loop. Raises
    `InvalidValue` for a q of the wrong size, with NaN, or with a quaternion that is not of norm 1.
    """

    def __init__(self, robot: Robot, q: ArrayLike) -> None:
        self.robot = robot
        self.q: Array = robot.checked_q(q)
        self._shape = self.q.shape
        self._model, self._data = robot.model, robot.model.createData()
        self._views: dict[str, FrameView] = {}
        # (6, nv), Fortran order, Pinocchio's own memory; for nv = 1 its array has lost the second axis.
        self.joint_jacobians: Array = self._data.J.reshape((6, robot.nv), order="F")
        self.joint_placements: Array = _placements(self._data)  # (joints + 1, 12), likewise
        self.update(self.q)

    def update(self, q: Array) -> None:
        """Move to q; only its size is checked."""
        if q.shape != self._shape:
            raise InvalidValue(f"q of {self.robot.name} must have {self.robot.nq} numbers, got {q.shape}")
        self.q[...] = q
        pin.computeJointJacobians(self._model, self._data, self.q)

    def frame(self, name: str) -> FrameView:
        """Views for kernels, valid as long as this configuration; raise `UnknownName`."""
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
        """Pose (4, 4) of a frame in the world; raise `UnknownName`."""
        view, out = self.frame(frame), np.empty((4, 4))
        frame_pose_into(view.joint_rotation, view.joint_translation, view.placement, out)
        return out

    @property
    def data(self) -> Any:
        """Pinocchio's own memory (pin.Data), joints placed at q."""
        return self._data

    def joint_poses(self) -> Array:
        """Poses (joints + 1, 4, 4) of all joints in the world, the world itself first."""
        return np.array([placement.homogeneous for placement in self._data.oMi])

    def jacobian(self, frame: str, expressed: Literal["world", "own"] = "world") -> Array:
        """Geometric Jacobian (6, nv) (3.5): linear velocity of the frame's origin, then angular.

        In the axes of the world, or in the frame's own.
        """
        if expressed not in ("world", "own"):
            raise InvalidValue(f"expressed must be 'world' or 'own', got {expressed!r}")
        pose, out = self.pose(frame), np.empty((6, self.robot.nv))
        frame_jacobian_into(self.joint_jacobians, pose, self.frame(frame).columns, out)
        if expressed == "own":
            out[:3], out[3:] = pose[:3, :3].T @ out[:3], pose[:3, :3].T @ out[3:]
        return out

    def centre_of_mass(self) -> tuple[Array, Array]:
        """Centre of mass (3,) [m] in the world, and its Jacobian (3, nv); both are copies."""
        J = pin.jacobianCenterOfMass(self._model, self._data, False)
        return self._data.com[0].copy(), np.array(J).reshape((3, self.robot.nv), order="F")

    def hessian(self, frame: str) -> Array:
        """(6, nv, nv): entry [:, j, k] is the derivative of column j of the world-axes Jacobian along q_k."""
        nv = self.robot.nv
        out = np.empty((6, nv, nv))
        frame_hessian_into(self.jacobian(frame), self.frame(frame).columns, self.robot.column_joint, out)
        return out


def _placements(data: Any) -> Array:
    """All joint poses as they stand in memory: rotation by columns, then translation, the world first.

    One array for all joints is what a kernel can take; Pinocchio only hands them out one by one.
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
    return array.__array_interface__["data"][0]


@kernel
def frame_pose_into(joint_rotation, joint_translation, placement, out):
    """Pose (4, 4) of a frame that stands at `placement` in its joint."""
    for i in range(3):
        r0, r1, r2 = joint_rotation[i, 0], joint_rotation[i, 1], joint_rotation[i, 2]
        for j in range(4):
            out[i, j] = r0 * placement[0, j] + r1 * placement[1, j] + r2 * placement[2, j]
        out[i, 3] += joint_translation[i]
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@kernel
def frame_jacobian_into(joint_jacobians, pose, columns, out):
    """Jacobian (6, nv) of a frame: ṗ = v + ω × p for each of its columns, zero elsewhere."""
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
    """out[:, j, k] = ∂J[:, j]/∂q_k (6, nv, nv) of a world-axes Jacobian, q_k along the tangent.

    A joint k at or before j turns the whole column, ω_k × (v_j, ω_j). One behind j only moves the
    frame's origin, ω_j × v_k. Joint axes must be constant in their own frame, as all of URDF's are.
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
