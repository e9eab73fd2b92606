"""The kernel of the frame tasks, which fills their rows: the error, its exact derivative, and b.

The spatial Jacobian J (6, nv) of Pinocchio has columns (v_j, ω_j): the velocity of the point of the body that
passes the origin of the world, and the angular velocity. With p and R the origin and rotation of the frame,
its own motion is w_j = (v_j + ω_j × p, ω_j). Every error below has ė = M (w_d − w) for a 6×6 matrix M, so
that A = M w and the feedforward is M w_d:

    OWN       e = log6(T⁻¹ T_d) = −log6(X), X = T_d⁻¹ T     M = Jlog6(X) diag(Rᵀ, Rᵀ)
    WORLD     e = [p_d − p; log3(E)], E = R_d Rᵀ            M = diag(I, Jlog3(E))
    POSITION  e = [Rᵀ(p_d − p); –]                          M = [[Rᵀ, −[e]× Rᵀ], [0, 0]]

w_d is the rate of the target, carried to where it acts: for OWN its linear part at p instead of p_d, for
WORLD its angular part turned back by Eᵀ.

Source:
    OWN: Solà, Deray and Atchuthan (2018), eq. 79.
"""

import numpy as np

from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.configuration import frame_pose_into
from taskopt.kinematics.lie import log6_jlog6_into, relative_into
from taskopt.kinematics.pose import is_pose
from taskopt.kinematics.task.base import task_rate

OWN, WORLD, POSITION = 0, 1, 2

# Rows in the table (rows, 6) of a task; poses take the first four columns of theirs. Views of rows and
# columns cost a kernel nothing.
PLACEMENT, ACTUAL, TARGET = 0, 4, 8  # (4, 4): frame in its joint, frame and its target in the world
TWIST, GAIN, ERROR = 12, 13, 14  # (6,); ERROR has the rows chosen, in front
MOVING = 15  # (1): 1.0 where the twist is to be read, else the target stands still
FULL_ERROR, X, JLOG, M_ROWS = 16, 17, 21, 27
ACCELERATION, RATE_GAIN = 33, 34  # (6,), read at second order only
MEMORY_SHAPE = (35, 6)


@kernel_apart
def frame_rows(parameters, memory, state, rows):
    """Fill the rows of a frame task.

    Args:
        parameters: Flat array of integers: the mode, the index of the frame's joint, m, the m rows chosen of
            six, and the columns of the joint velocities that move the frame.
        memory: Flat table of shape `MEMORY_SHAPE`, which holds poses, target rate, gains and errors.
        state: The robot, see `RobotState`.
        rows: The m rows, see `RowArrays`.
    """
    indices, memory, J, A = parameters, memory.reshape(MEMORY_SHAPE), state.jacobians, rows.A
    mode, m = indices[0], indices[2]
    joint = state.placements[indices[1]]
    flaw = 0.0 if is_pose(memory[TARGET : TARGET + 4, :4]) else np.nan  # found by `flawed`, which names it
    T = memory[ACTUAL : ACTUAL + 4, :4]
    placement = memory[PLACEMENT : PLACEMENT + 4, :4]
    frame_pose_into(joint[:9].reshape((3, 3)).T, joint[9:], placement, T)
    error = memory[FULL_ERROR]
    M = memory[M_ROWS : M_ROWS + 6]
    if mode == OWN:
        _own(T, memory, error, M)
    elif mode == WORLD:
        _world(T, memory, error, M)
    else:
        _position(T, memory, error, M)
    moving = memory[MOVING, 0] != 0.0
    twist = acting_twist(mode, T, memory) if moving else (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    px, py, pz = T[0, 3], T[1, 3], T[2, 3]
    for r in range(m):
        i = indices[3 + r]
        a, b, c = M[i, 0], M[i, 1], M[i, 2]
        # M_v · (v + ω × p) + M_ω · ω = M_v · v + (M_ω + p × M_v) · ω
        d, e, f = M[i, 3] + py * c - pz * b, M[i, 4] + pz * a - px * c, M[i, 5] + px * b - py * a
        for k in range(3 + m, indices.size):
            j = indices[k]
            A[r, j] = a * J[0, j] + b * J[1, j] + c * J[2, j] + d * J[3, j] + e * J[4, j] + f * J[5, j]
        feedforward = 0.0
        if moving:
            for j in range(6):
                feedforward += M[i, j] * twist[j]
        rows.lower[r] = rows.upper[r] = task_rate(feedforward, memory[GAIN, i], error[i]) + flaw
        memory[ERROR, r] = error[i]


@kernel
def _own(T, memory, error, M):
    """Write error (6,) and matrix M (6, 6) of the mode OWN, for the pose T (4, 4)."""
    relative = memory[X : X + 4, :4]
    jlog = memory[JLOG : JLOG + 6]
    relative_into(memory[TARGET : TARGET + 4, :4], T, relative)
    log6_jlog6_into(relative, error, jlog)
    for i in range(6):
        error[i] = -error[i]
        for k in range(3):
            M[i, k] = jlog[i, 0] * T[k, 0] + jlog[i, 1] * T[k, 1] + jlog[i, 2] * T[k, 2]
            M[i, 3 + k] = jlog[i, 3] * T[k, 0] + jlog[i, 4] * T[k, 1] + jlog[i, 5] * T[k, 2]


@kernel
def _world(T, memory, error, M):
    """Write error (6,) and matrix M (6, 6) of the mode WORLD, for the pose T (4, 4)."""
    Td = memory[TARGET : TARGET + 4, :4]
    E = memory[X : X + 4, :4]
    for i in range(3):
        for j in range(3):
            E[i, j] = Td[i, 0] * T[j, 0] + Td[i, 1] * T[j, 1] + Td[i, 2] * T[j, 2]
        E[i, 3] = 0.0  # without a translation, Jlog6 is diag(Jlog3, Jlog3)
    log6_jlog6_into(E, error, M)
    for i in range(3):
        error[i] = Td[i, 3] - T[i, 3]
        for j in range(3):
            M[i, j] = 1.0 if i == j else 0.0


@kernel
def _position(T, memory, error, M):
    """Write error (6,) and matrix M (6, 6) of the mode POSITION, for the pose T (4, 4)."""
    Td = memory[TARGET : TARGET + 4, :4]
    dx, dy, dz = Td[0, 3] - T[0, 3], Td[1, 3] - T[1, 3], Td[2, 3] - T[2, 3]
    for i in range(3):
        error[i] = T[0, i] * dx + T[1, i] * dy + T[2, i] * dz
        error[3 + i] = 0.0
        # −[e]× Rᵀ with e = Rᵀ d is −Rᵀ [d]×
        M[i, 0], M[i, 1], M[i, 2] = T[0, i], T[1, i], T[2, i]
        M[i, 3] = T[2, i] * dy - T[1, i] * dz
        M[i, 4] = T[0, i] * dz - T[2, i] * dx
        M[i, 5] = T[1, i] * dx - T[0, i] * dy
        for j in range(6):
            M[3 + i, j] = 0.0


@kernel
def acting_twist(mode, T, memory):
    """Return the twist w_d of the target at the point where it acts on the error.

    Args:
        mode: OWN, WORLD or POSITION.
        T: (4, 4) pose of the frame.
        memory: Table of the task, see `frame_rows`.

    Returns:
        Six numbers, linear [m/s] and then angular [rad/s].
    """
    vx, vy, vz = memory[TWIST, 0], memory[TWIST, 1], memory[TWIST, 2]
    wx, wy, wz = memory[TWIST, 3], memory[TWIST, 4], memory[TWIST, 5]
    if mode == OWN:
        Td = memory[TARGET : TARGET + 4, :4]
        dx, dy, dz = Td[0, 3] - T[0, 3], Td[1, 3] - T[1, 3], Td[2, 3] - T[2, 3]
        return vx + dy * wz - dz * wy, vy + dz * wx - dx * wz, vz + dx * wy - dy * wx, wx, wy, wz
    if mode == WORLD:
        E = memory[X : X + 4, :4]
        return (
            vx,
            vy,
            vz,
            E[0, 0] * wx + E[1, 0] * wy + E[2, 0] * wz,
            E[0, 1] * wx + E[1, 1] * wy + E[2, 1] * wz,
            E[0, 2] * wx + E[1, 2] * wy + E[2, 2] * wz,
        )
    return vx, vy, vz, 0.0, 0.0, 0.0
