"""The kernel that fills the rows, the cost and the bounds of eight arms in lock-step."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.jit.pack import load, size, spread, store, where_less
from taskopt.kinematics.lockstep.chain import place_joints, place_on
from taskopt.kinematics.lockstep.frame_rows import MATRIX, error_and_matrix
from taskopt.kinematics.lockstep.functions import LARGEST_ANGLE
from taskopt.kinematics.lockstep.tables import CONSTANT, FRAME


class ArmState(NamedTuple):
    """Postures and targets of eight arms, and what is computed from them.

    Attributes:
        q: Coordinates of the joints, (nv, 8) [rad, m].
        goals: Target pose of each frame task, (12 F, 8).
        joint_goals: Target of each row of the joint tasks, (R, 8) [rad, m].
        poses: Pose of each joint, then one of a frame, (12 (nv + 1), 8).
        jacobians: Spatial twist of each joint, (6 nv, 8).
        errors: Error of each frame task, six packs each, (6 F, 8).
        matrices: Matrix M of each frame task, (36 F, 8).
    """

    q: Array
    goals: Array
    joint_goals: Array
    poses: Array
    jacobians: Array
    errors: Array
    matrices: Array


def state_packs(nv: int, frames: int, joint_rows: int) -> int:
    """Return how many packs `state_in` takes.

    Args:
        nv: Number of joints.
        frames: Number of frame tasks.
        joint_rows: Number of rows of joint tasks.

    Returns:
        The number.
    """
    return 19 * nv + 12 + (18 + MATRIX) * frames + joint_rows


state_size = kernel(state_packs)


@kernel
def state_in(memory, nv, frames, joint_rows):
    """Return the memory of eight arms as views.

    Args:
        memory: (state_packs(nv, frames, joint_rows), 8).
        nv: Number of joints.
        frames: Number of frame tasks.
        joint_rows: Number of rows of joint tasks.

    Returns:
        An `ArmState`.
    """
    goals = nv
    joint_goals = goals + 12 * frames
    poses = joint_goals + joint_rows
    jacobians = poses + 12 * nv + 12
    errors = jacobians + 6 * nv
    matrices = errors + 6 * frames
    return ArmState(
        memory[:nv], memory[goals:joint_goals], memory[joint_goals:poses], memory[poses:jacobians],
        memory[jacobians:errors], memory[errors:matrices], memory[matrices : matrices + MATRIX * frames],
    )  # fmt: skip


@kernel
def fill_pack(tables, state, rows):
    """Fill the hierarchies of eight arms; a coordinate that is too large becomes NaN.

    Args:
        tables: The `Tables` of the plan.
        state: An `ArmState` with q and the targets.
        rows: The `ArmRows` of the resolver, to be filled.
    """
    nv = tables.chain.parent.size
    place_joints(tables.chain, state.q, state.poses, state.jacobians)
    for f in range(tables.frames.shape[0]):
        place_on(tables.frames[f, 1], tables.places, f, state.poses, 12 * nv)
        error_and_matrix(
            tables.frames[f, 0], tables.frames[f, 2] != 0, state.poses[12 * nv :],
            state.goals[12 * f : 12 * f + 12], state.errors[6 * f : 6 * f + 6],
            state.matrices[MATRIX * f : MATRIX * f + MATRIX],
        )  # fmt: skip
        for a in range(tables.rows.shape[0]):
            if tables.rows[a, 0] == FRAME and tables.rows[a, 1] == f:
                _frame_row(tables, state, rows, a)
    for a in range(tables.rows.shape[0]):
        if tables.rows[a, 0] != FRAME:
            _other_row(tables, state, rows, a)
    _fill_cost(tables, state, rows)
    _fill_bounds(tables, state, rows)


@kernel
def _frame_row(tables, state, rows, a):
    """Fill row a, which belongs to the frame task whose pose stands last in `poses`."""
    nv, f, i = tables.chain.parent.size, tables.rows[a, 1], tables.rows[a, 2]
    at, p = MATRIX * f + 6 * i, 12 * nv + 9
    M, J = state.matrices, state.jacobians
    px, py, pz = load(state.poses, p), load(state.poses, p + 1), load(state.poses, p + 2)
    x, y, z = load(M, at), load(M, at + 1), load(M, at + 2)
    # M_v · (v + ω × p) + M_ω · ω = M_v · v + (M_ω + p × M_v) · ω
    u = load(M, at + 3) + py * z - pz * y
    v = load(M, at + 4) + pz * x - px * z
    w = load(M, at + 5) + px * y - py * x
    for j in range(nv):
        if tables.moves[f, j] != 0:
            k = 6 * j
            linear = x * load(J, k) + y * load(J, k + 1) + z * load(J, k + 2)
            angular = u * load(J, k + 3) + v * load(J, k + 4) + w * load(J, k + 5)
            store(rows.A, a * nv + j, linear + angular)
        else:
            store(rows.A, a * nv + j, spread(0.0))
    store(rows.r, a, load(state.errors, 6 * f + i) * tables.gains[a])


@kernel
def _other_row(tables, state, rows, a):
    """Fill row a of a joint task or of a constant task."""
    nv, number = tables.chain.parent.size, tables.rows[a, 1]
    constant = tables.rows[a, 0] == CONSTANT
    for j in range(nv):
        entry = tables.constants[number, j] if constant else 1.0 * (tables.joints[number, 0] == j)
        store(rows.A, a * nv + j, spread(entry))
    store(rows.r, a, _rate(tables, state, tables.rows[a, 0], number))


@kernel
def _rate(tables, state, source, number):
    """Return the right-hand side of a row of a joint task or of a constant task."""
    if source == CONSTANT:
        return spread(tables.constants[number, tables.constants.shape[1] - 1])
    error = load(state.joint_goals, number) - load(state.q, tables.joints[number, 0])
    return error * tables.joint_gains[number]


@kernel
def _fill_cost(tables, state, rows):
    """Fill the targets x0 of the columns."""
    nv = tables.chain.parent.size
    for j in range(nv):
        store(rows.x0, j, spread(0.0))
        store(rows.reach, j, spread(0.0))
    for k in range(tables.costs.shape[0]):
        j = tables.costs[k, 0]
        part = tables.cost_weights[k] * _rate(tables, state, tables.costs[k, 1], tables.costs[k, 2])
        store(rows.x0, j, load(rows.x0, j) + part)
        store(rows.reach, j, load(rows.reach, j) + size(part))
    if tables.costs.shape[0] > 0:
        for j in range(nv):
            store(rows.x0, j, load(rows.x0, j) / tables.D[j])


@kernel
def _fill_bounds(tables, state, rows):
    """Fill the bounds of the velocities."""
    for j in range(tables.chain.parent.size):
        q = load(state.q, j)
        kept = where_less(size(q), LARGEST_ANGLE, 0.0 * q, np.nan)
        store(rows.lower, j, tables.box[0, j] + kept)
        store(rows.upper, j, tables.box[1, j] + kept)
    for k in range(tables.ranges.shape[0]):
        j = tables.ranges[k, 0]
        lower = tables.range_numbers[k, 2] * (tables.range_numbers[k, 0] - load(state.q, j))
        upper = tables.range_numbers[k, 2] * (tables.range_numbers[k, 1] - load(state.q, j))
        lower, upper = where_less(lower, 0.0, lower, 0.0), where_less(0.0, upper, upper, 0.0)
        store(rows.lower, j, where_less(load(rows.lower, j), lower, lower, load(rows.lower, j)))
        store(rows.upper, j, where_less(upper, load(rows.upper, j), upper, load(rows.upper, j)))
