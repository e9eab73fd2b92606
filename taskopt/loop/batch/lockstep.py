"""The compiled call that resolves many arms, eight at a time in lock-step."""

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask, StateArray
from taskopt.jit import kernel, kernel_unlocked
from taskopt.jit.borrowed import borrowed
from taskopt.jit.pack import PACK, store
from taskopt.kinematics.lockstep.chain import Chain
from taskopt.kinematics.lockstep.rows import fill_pack, state_in, state_packs, state_size
from taskopt.kinematics.lockstep.tables import Tables
from taskopt.resolver.active_set.lockstep import resolve_pack
from taskopt.resolver.active_set.lockstep.doubt import ranks_in_doubt
from taskopt.resolver.active_set.lockstep.records import (
    ArmAnswers,
    ArmRows,
    Cost,
    Watch,
    scratch_in,
    scratch_packs,
)


class Arms(NamedTuple):
    """The arrays of all arms.

    Attributes:
        order: All arms in the order in which they share packs, (N,).
        q: Postures, (N, nq) [rad, m].
        goals: Target of each frame task, (F, N, 12), as `chain.twelve` writes poses.
        joint_goals: Target of each row of the joint tasks, (N, R) [rad, m].
        state: Working sets: tried first, then written, (N, nv).
        v: Velocities, written, (N, nv) [rad/s, m/s].
        bound: Bound on their error, written, (N, nv).
        proven: True where the answer is proven, written, (N,).
        doubt: True where the answer may have to be damped, written, (N,).
    """

    order: IntArray
    q: Array
    goals: Array
    joint_goals: Array
    state: StateArray
    v: Array
    bound: Array
    proven: Mask
    doubt: Mask


def new_memory(tables: Tables) -> Array:
    """Allocate what one thread needs to resolve arms.

    Args:
        tables: The tables of the plan.

    Returns:
        Packs, (any, 8).
    """
    n, m, frames, joint_rows = _sizes(tables)
    packs = state_packs(n, frames, joint_rows) + m * n + m + 7 * n + 1 + scratch_packs(m, n)
    return np.zeros((packs, PACK))


def _sizes(tables: Tables) -> tuple[int, int, int, int]:
    """Return the numbers of columns, rows of M, frame tasks, and rows of joint tasks."""
    return tables.box.shape[1], len(tables.rows), len(tables.frames), len(tables.joints)


@kernel_unlocked
def resolve_arms(tables, arms, first, stop, memory):
    """Resolve the arms from `first` to `stop` in their order, eight at a time.

    Args:
        tables: The `Tables` of the plan.
        arms: The `Arms`.
        first: First arm.
        stop: The arm after the last.
        memory: Packs that `new_memory` allocated.
    """
    t, arms, memory = _borrowed_tables(tables), _borrowed_arms(arms), borrowed(memory)
    n, m = t.box.shape[1], t.rows.shape[0]
    packs = state_size(n, t.frames.shape[0], t.joints.shape[0])
    state = state_in(memory, n, t.frames.shape[0], t.joints.shape[0])
    rest = memory[packs:]
    columns = rest[m * n + m :]
    rows = ArmRows(
        rest[: m * n], rest[m * n : m * n + m],
        columns[:n], columns[n : 2 * n], columns[2 * n : 3 * n], columns[3 * n : 4 * n],
    )  # fmt: skip
    answers = ArmAnswers(
        columns[4 * n : 5 * n], columns[5 * n : 6 * n], columns[6 * n : 7 * n], columns[7 * n : 7 * n + 1]
    )
    scratch = scratch_in(columns[7 * n + 1 :], m, n)
    cost = Cost(t.D, t.root, t.slack, t.first)
    below = t.D[: n if t.costs.shape[0] > 0 else 0]
    watch = Watch(t.period, t.group, t.share, t.heaviest, t.counted, t.box, below)
    for begin in range(first, stop, PACK):
        _gather(t, arms, begin, stop, state, answers.state)
        fill_pack(t, state, rows)
        resolve_pack(cost, rows, answers, scratch)
        _scatter(arms, begin, stop, answers)
        if t.period[0] > 0.0:
            store(answers.proven, 0, ranks_in_doubt(watch, rows, answers.x, scratch, (m, n)))
            for lane in range(min(PACK, stop - begin)):
                arms.doubt[arms.order[begin + lane]] = answers.proven[0, lane] > 0.5


@kernel
def _gather(t, arms, begin, stop, state, working_sets):
    """Read the postures, targets and working sets of eight arms; the last arm stands for missing ones."""
    for lane in range(PACK):
        arm = arms.order[min(begin + lane, stop - 1)]
        for j in range(t.chain.position.size):
            state.q[j, lane] = arms.q[arm, t.chain.position[j]]
            working_sets[j, lane] = arms.state[arm, j]
        for f in range(arms.goals.shape[0]):
            for k in range(12):
                state.goals[12 * f + k, lane] = arms.goals[f, arm, k]
        for i in range(arms.joint_goals.shape[1]):
            state.joint_goals[i, lane] = arms.joint_goals[arm, i]


@kernel
def _scatter(arms, begin, stop, answers):
    """Write the answers of eight arms."""
    for lane in range(min(PACK, stop - begin)):
        arm = arms.order[begin + lane]
        for j in range(arms.v.shape[1]):
            arms.v[arm, j] = answers.x[j, lane]
            arms.bound[arm, j] = answers.bound[j, lane]
            arms.state[arm, j] = np.int8(answers.state[j, lane])
        arms.proven[arm] = answers.proven[0, lane] > 0.5


@kernel
def _borrowed_arms(arms):
    """Return the arrays of all arms, whose references are not counted."""
    return Arms(
        borrowed(arms.order),
        borrowed(arms.q), borrowed(arms.goals), borrowed(arms.joint_goals), borrowed(arms.state),
        borrowed(arms.v), borrowed(arms.bound), borrowed(arms.proven), borrowed(arms.doubt),
    )  # fmt: skip


@kernel
def _borrowed_tables(t):
    """Return the tables, whose references are not counted."""
    chain = Chain(
        borrowed(t.chain.parent), borrowed(t.chain.kind), borrowed(t.chain.position), borrowed(t.chain.place)
    )
    return Tables(
        chain, borrowed(t.frames), borrowed(t.places), borrowed(t.moves), borrowed(t.rows),
        borrowed(t.gains), borrowed(t.joints), borrowed(t.joint_gains), borrowed(t.constants),
        borrowed(t.costs), borrowed(t.cost_weights), borrowed(t.D), borrowed(t.root), borrowed(t.slack),
        borrowed(t.first), borrowed(t.period), borrowed(t.group), borrowed(t.share), borrowed(t.heaviest),
        borrowed(t.counted), borrowed(t.box), borrowed(t.ranges), borrowed(t.range_numbers),
    )  # fmt: skip
