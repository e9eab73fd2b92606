"""What a batch reads of a plan: the tables from which the rows of eight arms are filled in lock-step."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, BoolArray, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block
from taskopt.hierarchy.tolerances import FAST_PATH_COVERED
from taskopt.kinematics.limit.joint import BoundJointPosition
from taskopt.kinematics.lockstep.chain import Chain, Tree
from taskopt.kinematics.plan import base_box
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task import BoundTask
from taskopt.kinematics.task.frame import BoundFrame
from taskopt.kinematics.task.joint import BoundJoints

FRAME, JOINT, CONSTANT = 0, 1, 2  # sources of rows
KNOWN = "FrameTask, PositionTask, OrientationTask, JointTask, DampingTask"
LIMITS = "JointPositionLimit and JointVelocityLimit"


class Tables(NamedTuple):
    """The tables, read-only in the kernels.

    Attributes:
        chain: The kinematic tree.
        frames: For each frame task its mode, its joint, and 1 if it has rotations among its rows, (F, 3).
        places: Pose of each of these frames in its joint, (F, 12).
        moves: 1 where a joint moves a frame, (F, nv).
        rows: For each row of M its source, the number there (a frame task, a row of a joint task, or a
            constant row), and for frames the row of six, (m, 3).
        gains: K of each of these rows [1/s], (m,).
        joints: Column and place in q of each row of the joint tasks, (R, 2).
        joint_gains: K of each of these rows [1/s], (R,).
        constants: Constant rows, A and then b, (c, nv + 1).
        costs: Column, source and number of each row of the last cost, (k, 3).
        cost_weights: Weights of these rows, (k,).
        D: Weight of each column in the last cost, the sum of its rows or else the norm, (nv,).
        root: D^-½, (nv,).
        slack: 1/w of each row of M that may keep a residual, 0 of the others, (m,).
        first: Weights of the rows of the first level, unless that is the last one, (k,).
        period: Δt [s], or 0 if the stack has no damping, (1,).
        group: Group of each row of M whose entries change with the posture, 0 of the others, (m,).
        share: Weight of each row of M as a share of the least one of curved rows in its level, or of the
            largest one if there are none, (m,).
        heaviest: Largest of these in the group of each row, (m,).
        counted: True for curved rows of M, and for all in levels before the last curved one, (m,).
        box: Lower and upper bounds with which each tick starts, (2, nv) [rad/s, m/s].
        ranges: Column and place in q of each bound on a position, (l, 2).
        range_numbers: Lower and upper limit [rad, m] inside the margin, and κ/Δt [1/s], (l, 3).
    """

    chain: Chain
    frames: IntArray
    places: Array
    moves: IntArray
    rows: IntArray
    gains: Array
    joints: IntArray
    joint_gains: Array
    constants: Array
    costs: IntArray
    cost_weights: Array
    D: Array
    root: Array
    slack: Array
    first: Array
    period: Array
    group: IntArray
    share: Array
    heaviest: Array
    counted: BoolArray
    box: Array
    ranges: IntArray
    range_numbers: Array


class Reader:
    """Reads a plan, or refuses it.

    Args:
        plan: The stack, compiled for the robot.

    Attributes:
        frame_tasks: Tasks whose targets are poses, in the order of `Tables.frames`.
        joint_tasks: Tasks whose targets are postures, each with its first row in `Tables.joints`.
        tree: The kinematic tree.

    Raises:
        InvalidValue: The plan has a part that lock-step does not know; the message names it.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan, self.tree = plan, Tree(plan.robot)
        self.frame_tasks: list[BoundFrame] = []
        self.joint_tasks: list[tuple[BoundJoints, int]] = []
        self._constants: list[Array] = []
        self._rows: list[tuple[int, int, int, int]] = []  # of all tasks: source, number, row of six, column
        self._gains: list[float] = []
        self._require_known()
        blocks = [block for block in plan.layout.blocks if block.level]
        for task, block in zip(plan.tasks, blocks, strict=True):
            self._read(task, block)

    def tables(self) -> Tables:
        """Return the tables, with the present gains, weights and Δt of the plan."""
        plan, nv = self._plan, self._plan.robot.nv
        weight, offsets = plan.hierarchy.weight, plan.layout.offsets
        soft = int(offsets[-2]) - int(offsets[1])
        rows = np.array(self._rows, dtype=np.int64).reshape(-1, 4)
        in_cost = (np.arange(len(rows)) >= soft) & (rows[:, 3] >= 0)
        if not in_cost.any():
            soft = len(rows)
        D = np.array(plan.hierarchy.norm)
        if in_cost.any():
            D = np.zeros(nv)
            np.add.at(D, rows[in_cost, 3], weight[in_cost])
            self._require_covered(D)
        rest = np.flatnonzero(~in_cost)
        ranges, numbers = self._ranges()
        return Tables(
            self.tree.chain,
            *self._frame_tables(),
            np.ascontiguousarray(rows[rest, :3]),
            np.array(self._gains)[rest],
            *self._joint_tables(),
            np.array(self._constants).reshape(-1, nv + 1),
            np.ascontiguousarray(rows[in_cost][:, [3, 0, 1]]),
            weight[in_cost],
            D,
            1.0 / np.sqrt(D),
            np.where(rest >= soft, 1.0 / weight[rest], 0.0),
            weight[: int(offsets[2])] if len(offsets) > 3 else np.zeros(0),
            np.array([plan.dt if plan.stack.damping is not None else 0.0]),
            *self._watched(rest),
            base_box(plan.tick)[:2].copy(),
            ranges,
            numbers,
        )

    def _require_known(self) -> None:
        """Raise an error that names what lock-step does not know."""
        plan, what = self._plan, "a batch does not know"
        declared = [task for level in plan.stack.levels for task in level]
        for task, made in zip(plan.tasks, declared, strict=True):
            known = type(task) in (BoundFrame, BoundJoints) or _is_constant(plan, task)
            if not known:
                raise InvalidValue(
                    f"{what} '{task.name}', a {type(made).__name__}; it takes {KNOWN}. Use a Controller for "
                    "each robot, or leave the task out"
                )
        for limit, made in zip(plan.limits, plan.stack.limits, strict=True):
            if type(limit) is not BoundJointPosition and not (limit.constant and hasattr(limit, "owners")):
                raise InvalidValue(
                    f"{what} the limit '{limit.name}', a {type(made).__name__}; it takes {LIMITS}. Use a "
                    "Controller for each robot, or leave the limit out"
                )
        if plan.hierarchy.norm.ndim == 2:
            raise InvalidValue(f"{what} a norm that is a full matrix; give its diagonal (nv,)")

    def _require_covered(self, D: Array) -> None:
        """Raise an error if the joint rows of the last level leave out a joint."""
        thin = np.flatnonzero(FAST_PATH_COVERED * D.max() >= D)
        if thin.size:
            names = ", ".join(self._plan.robot.velocity_names[j] for j in thin)
            raise InvalidValue(
                f"a batch needs a joint task of all joints in the last level, or of none; it has none of, or "
                f"too small a weight for, {names}; add DampingTask() to the last level"
            )

    def _read(self, task: BoundTask, block: Block) -> None:
        """Read the rows of one task."""
        m = len(task.row_names)
        gains = np.broadcast_to(task.gain, m).tolist()
        if type(task) is BoundFrame:
            rows = task.parameters[3 : 3 + m].tolist()
            self._rows += [(FRAME, len(self.frame_tasks), i, -1) for i in rows]
            self.frame_tasks.append(task)
        elif type(task) is BoundJoints:
            first = sum(len(known.row_names) for known, _ in self.joint_tasks)
            self._rows += [(JOINT, first + i, 0, column) for i, column in enumerate(task.column)]
            self.joint_tasks.append((task, first))
        else:
            hierarchy, first = self._plan.hierarchy, len(self._constants)
            self._rows += [(CONSTANT, first + i, 0, column) for i, column in enumerate(task.column)]
            for i in range(block.rows.start, block.rows.stop):
                self._constants.append(np.append(hierarchy.A[i], hierarchy.lower[i]))
        self._gains += gains

    def _frame_tables(self) -> tuple[IntArray, Array, IntArray]:
        """Return `frames`, `places` and `moves`."""
        count, nv = len(self.frame_tasks), self._plan.robot.nv
        frames, places = np.zeros((count, 3), np.int64), np.zeros((count, 12))
        moves = np.zeros((count, nv), np.int64)
        for f, task in enumerate(self.frame_tasks):
            m = len(task.row_names)
            joint, places[f] = self.tree.placed(str(task.frame))
            frames[f] = task.parameters[0], joint, task.parameters[2 + m] >= 3
            moves[f, task.parameters[3 + m :]] = 1
        return frames, places, moves

    def _joint_tables(self) -> tuple[IntArray, Array]:
        """Return `joints` and `joint_gains`."""
        position = self.tree.chain.position
        columns = [column for task, _ in self.joint_tasks for column in task.column]
        gains = [np.broadcast_to(task.gain, len(task.row_names)) for task, _ in self.joint_tasks]
        pairs = np.column_stack([columns, position[columns]]) if columns else np.zeros((0, 2))
        return pairs.astype(np.int64), np.concatenate([np.zeros(0), *gains])

    def _watched(self, rest: IntArray) -> tuple[IntArray, Array, Array, BoolArray]:
        """Return `group`, `share`, `heaviest` and `counted` of the rows `rest`, which are those of M."""
        layout, weight = self._plan.layout, self._plan.hierarchy.weight
        level = np.repeat(np.arange(layout.level_count + 1), np.diff(layout.offsets))
        curved = self._plan.groups > 0
        share = np.ones(len(level))
        for k in np.unique(level):
            own, bent = level == k, curved & (level == k)
            share[own] = weight[own] / (weight[bent].min() if bent.any() else weight[own].max())
        heaviest = [share[self._plan.groups == group].max() for group in self._plan.groups]
        last = level[curved].max(initial=0)
        counted = curved | (level < last)
        return (
            np.asarray(self._plan.groups, dtype=np.int64)[rest],
            share[rest],
            np.array(heaviest)[rest],
            counted[rest],
        )

    def _ranges(self) -> tuple[IntArray, Array]:
        """Return `ranges` and `range_numbers`."""
        columns, numbers = [np.zeros((0, 2), np.int64)], [np.zeros((0, 3))]
        for limit in self._position_limits():
            lower, upper, margin = limit.memory[1:].reshape(-1, 3).T
            rate = np.full(lower.size, limit.memory[0])
            columns.append(limit.parameters.reshape(-1, 2))
            numbers.append(np.column_stack([lower + margin, upper - margin, rate]))
        return np.concatenate(columns), np.concatenate(numbers)

    def _position_limits(self) -> Iterator[BoundJointPosition]:
        """Yield the limits on positions."""
        for limit in self._plan.limits:
            if isinstance(limit, BoundJointPosition):
                yield limit


def _is_constant(plan: Plan, task: BoundTask) -> bool:
    """Return True if all rows of a task are constant equalities."""
    if not task.constant:
        return False
    rows = next(block.rows for block in plan.layout.blocks if block.level and block.name == task.name)
    return bool((plan.hierarchy.lower[rows] == plan.hierarchy.upper[rows]).all())
