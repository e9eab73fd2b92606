"""Forward kinematics, joint Jacobians and integration by compiled code, so that a tick need not leave it.

Pinocchio does the same, at the price of two calls from Python for each tick. Joints with one axis and
free-flyers are known here; for a robot with others, such as ball joints, Pinocchio goes on doing it.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import math

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.engine import JointModel
from taskopt.kinematics.lie import exp_terms
from taskopt.kinematics.robot.joints import kind_and_axis
from taskopt.kinematics.robot.robot import Robot

REVOLUTE, CONTINUOUS, PRISMATIC, FREE = 0, 1, 2, 3  # CONTINUOUS: cosine and sine stand in q
KIND, PARENT, AT_Q, AT_V = 0, 1, 2, 3  # columns of the table of joints
AXIS = 12  # the twelve numbers before are the placement of the joint
_NUMBERS = {"revolute": REVOLUTE, "continuous": CONTINUOUS, "prismatic": PRISMATIC}


def joint_tables(robot: Robot) -> tuple[IntArray, Array] | None:
    """Read the kinematic tree of a robot.

    Args:
        robot: The robot.

    Returns:
        For each joint, the world first: kind, parent, place in q and place in v, (joints + 1, 4); and its
        placement in its parent, column by column and then the translation [m], and its axis (joints + 1, 15).
        None if a joint is of a kind that the kernels do not know.
    """
    model = robot.model
    table, numbers = np.zeros((model.njoints, 4), np.int64), np.zeros((model.njoints, 15))
    for i in range(1, model.njoints):
        found = _kind_and_axis(model.joints[i])
        if found is None:
            return None
        kind, axis = found
        table[i] = kind, model.parents[i], model.joints[i].idx_q, model.joints[i].idx_v
        placement = model.jointPlacements[i]
        numbers[i] = np.concatenate([placement.rotation.T.ravel(), placement.translation, axis])
    return table, numbers


def _kind_and_axis(joint: JointModel) -> tuple[int, Array] | None:
    """Return the kind of a joint and its axis (3,); None if the kernels do not know it."""
    if joint.shortname() == "JointModelFreeFlyer":
        return FREE, np.zeros(3)
    found = kind_and_axis(joint)
    return None if found is None else (_NUMBERS[found[0]], found[1])


@kernel_apart
def place_joints(table, numbers, q, placements, jacobians):
    """Compute the poses of all joints in the world, and their Jacobians.

    Args:
        table: See `joint_tables`.
        numbers: See `joint_tables`.
        q: Posture, (nq,) [rad, m].
        placements: Receives the poses, (joints + 1, 12), see `RobotState`; that of the world stands there.
        jacobians: Receives the spatial twist of each unit velocity, (6, nv), see `RobotState`.

    Source:
        (3.31) for the columns.
    """
    for i in range(1, table.shape[0]):
        place, at = placements[i], table[i, AT_Q]
        _stand(placements[table[i, PARENT]], numbers[i], place)
        kind, column = table[i, KIND], table[i, AT_V]
        if kind == FREE:
            _float(place, q[at : at + 7])
            for k in range(3):
                ax, ay, az = place[3 * k], place[3 * k + 1], place[3 * k + 2]
                _move_column(jacobians, column + k, ax, ay, az)
                _turn_column(jacobians, column + 3 + k, ax, ay, az, place)
            continue
        x, y, z = numbers[i, AXIS], numbers[i, AXIS + 1], numbers[i, AXIS + 2]
        ax = place[0] * x + place[3] * y + place[6] * z
        ay = place[1] * x + place[4] * y + place[7] * z
        az = place[2] * x + place[5] * y + place[8] * z
        if kind == PRISMATIC:
            place[9] += q[at] * ax
            place[10] += q[at] * ay
            place[11] += q[at] * az
            _move_column(jacobians, column, ax, ay, az)
        else:
            c, s = (q[at], q[at + 1]) if kind == CONTINUOUS else (math.cos(q[at]), math.sin(q[at]))
            _turn(place, c, s, (x, y, z), (ax, ay, az))
            _turn_column(jacobians, column, ax, ay, az, place)


@kernel
def _stand(parent, own, out):
    """Compute the pose of what stands at the pose `own` in the frame `parent`, each (12,)."""
    for d in range(3):
        r, s, t = parent[d], parent[3 + d], parent[6 + d]
        for c in range(0, 12, 3):
            out[c + d] = r * own[c] + s * own[c + 1] + t * own[c + 2]
        out[9 + d] += parent[9 + d]


@kernel
def _turn(place, c, s, axis, seen):
    """Turn a pose (12,) about an axis of its own, which the world sees as `seen`: R exp3(θ a).

    With r a row of R, Rodrigues' formula is r cos θ + (r × a) sin θ + (1 − cos θ) (r·a) a.
    """
    x, y, z = axis
    for d in range(3):
        u, v, w, along = place[d], place[3 + d], place[6 + d], (1.0 - c) * seen[d]
        place[d] = c * u + s * (v * z - w * y) + along * x
        place[3 + d] = c * v + s * (w * x - u * z) + along * y
        place[6 + d] = c * w + s * (u * y - v * x) + along * z


@kernel
def _float(place, own):
    """Move a pose (12,) by that of a free-flyer, (7,): translation [m], then the quaternion x, y, z, w."""
    x, y, z, w = own[3], own[4], own[5], own[6]
    r = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y))
    s = (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x))
    t = (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
    for d in range(3):
        a, b, c = place[d], place[3 + d], place[6 + d]
        place[9 + d] += a * own[0] + b * own[1] + c * own[2]
        place[d] = a * r[0] + b * r[1] + c * r[2]
        place[3 + d] = a * s[0] + b * s[1] + c * s[2]
        place[6 + d] = a * t[0] + b * t[1] + c * t[2]


@kernel
def _move_column(jacobians, j, x, y, z):
    """Write the column of a velocity along an axis (x, y, z)."""
    jacobians[0, j], jacobians[1, j], jacobians[2, j] = x, y, z
    jacobians[3, j], jacobians[4, j], jacobians[5, j] = 0.0, 0.0, 0.0


@kernel
def _turn_column(jacobians, j, x, y, z, place):
    """Write the column of a turn about an axis (x, y, z) through the origin of a pose: (p × a, a)."""
    px, py, pz = place[9], place[10], place[11]
    jacobians[0, j], jacobians[1, j], jacobians[2, j] = py * z - pz * y, pz * x - px * z, px * y - py * x
    jacobians[3, j], jacobians[4, j], jacobians[5, j] = x, y, z


@kernel_apart
def move_joints(table, q, v, dt, out):
    """Compute the posture q ⊕ v Δt.

    Args:
        table: See `joint_tables`.
        q: Posture, (nq,) [rad, m].
        v: Velocity, (nv,) [rad/s, m/s].
        dt: Δt [s].
        out: Receives the posture, (nq,).

    Source:
        (3.48).
    """
    for i in range(1, table.shape[0]):
        kind, at, column = table[i, KIND], table[i, AT_Q], table[i, AT_V]
        if kind == FREE:
            _move_free(q[at : at + 7], v[column : column + 6], dt, out[at : at + 7])
        elif kind == CONTINUOUS:
            c, s = math.cos(v[column] * dt), math.sin(v[column] * dt)
            x, y = c * q[at] - s * q[at + 1], s * q[at] + c * q[at + 1]
            scale = _to_unit(x * x + y * y)
            out[at], out[at + 1] = scale * x, scale * y
        else:
            out[at] = q[at] + v[column] * dt


@kernel
def _move_free(q, v, dt, out):
    """Move a free-flyer (7,) by the exponential of its body twist (6,) times Δt [s]."""
    vx, vy, vz, wx, wy, wz = v[0] * dt, v[1] * dt, v[2] * dt, v[3] * dt, v[4] * dt, v[5] * dt
    angle = math.sqrt(wx * wx + wy * wy + wz * wz)
    a, b, c = exp_terms(angle)
    along = c * (wx * vx + wy * vy + wz * vz)
    px = a * vx + b * (wy * vz - wz * vy) + along * wx
    py = a * vy + b * (wz * vx - wx * vz) + along * wy
    pz = a * vz + b * (wx * vy - wy * vx) + along * wz
    x, y, z, w = q[3], q[4], q[5], q[6]
    ux, uy, uz = 2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)
    out[0] = q[0] + px + w * ux + y * uz - z * uy
    out[1] = q[1] + py + w * uy + z * ux - x * uz
    out[2] = q[2] + pz + w * uz + x * uy - y * ux
    half, cosine = 0.5 * exp_terms(0.5 * angle)[0], math.cos(0.5 * angle)
    half, cosine = (half, cosine) if cosine >= 0.0 else (-half, -cosine)  # the nearer of ± the quaternion
    bx, by, bz = half * wx, half * wy, half * wz
    nx, ny = w * bx + x * cosine + y * bz - z * by, w * by + y * cosine + z * bx - x * bz
    nz, nw = w * bz + z * cosine + x * by - y * bx, w * cosine - x * bx - y * by - z * bz
    scale = _to_unit(nx * nx + ny * ny + nz * nz + nw * nw)
    out[3], out[4], out[5], out[6] = scale * nx, scale * ny, scale * nz, scale * nw


@kernel
def _to_unit(square):
    """Return the factor that brings a vector whose squared length is nearly 1 to length 1: a Newton step."""
    return 0.5 * (3.0 - square)
