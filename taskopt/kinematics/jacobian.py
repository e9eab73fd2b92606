"""Kernels from joint Jacobians to a frame's: pose, geometric Jacobian (3.5), and its derivative.

`joint_jacobians` has, per velocity, the spatial twist at the world's origin: linear, then angular.
Frame Jacobians are in world axes, the linear part being that of the frame's origin. Nothing is
allocated, so task kernels may call these on every tick.
"""

from taskopt.jit import kernel


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
