"""One compiled call that fills the rows and the box of a tick.

A call into compiled code costs more than the rows of a task, so the tasks and limits that have a kernel
are listed in one integer program over one float memory, and a single kernel walks it. A task or limit
without one fills its rows from Python, before or after that call.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.configuration import Configuration
from taskopt.jit import kernel
from taskopt.limit.joint_acceleration import narrow_by_acceleration
from taskopt.limit.joint_position import narrow_by_position
from taskopt.problem.hierarchy import Hierarchy
from taskopt.task.frame_kernel import frame_rows
from taskopt.task.joint import joint_rows

FRAME, JOINTS, POSITION_LIMIT, ACCELERATION_LIMIT = 0, 1, 2, 3
KINDS = {
    "frame": FRAME,
    "joints": JOINTS,
    "joint position limit": POSITION_LIMIT,
    "joint acceleration limit": ACCELERATION_LIMIT,
}


class Compiled(Protocol):
    """What a task or limit with a kernel offers besides: one of KINDS, its program, and its memory."""

    kind: str
    program: IntArray
    memory: Array

    def use(self, memory: Array) -> None:
        """Live in this memory from now on; it holds what the old one held."""
        ...


def compiled_tick(
    parts: Sequence[tuple[Compiled, int]], at: Configuration, hierarchy: Hierarchy
) -> tuple[Array | IntArray, ...]:
    """The arguments of `fill_tick` for a hierarchy.

    `parts`: each with the row where it begins, or with its number as owner of bounds. The box and its
    owners start on every tick as they stand in the hierarchy now.
    """
    flat, tabular = [hierarchy.buffer[-4 * hierarchy.n :]], [np.zeros((0, 6))]
    program = [hierarchy.n, hierarchy.layout.row_count]
    for part, place in parts:
        pool = flat if part.memory.ndim == 1 else tabular
        start = sum(map(len, pool))
        program += [KINDS[part.kind], place, start, start + len(part.memory), len(part.program)]
        program += part.program.tolist()
        pool.append(part.memory)
    numbers, tables = np.concatenate(flat), np.concatenate(tabular)
    at_flat, at_table = len(flat[0]), 0
    for part, _ in parts:
        if part.memory.ndim == 1:
            part.use(numbers[at_flat : (at_flat := at_flat + len(part.memory))])
        else:
            part.use(tables[at_table : (at_table := at_table + len(part.memory))])
    instructions = np.array(program, dtype=np.int64)
    J, placements = at.joint_jacobians, at.joint_placements
    return instructions, numbers, tables, at.q, J, placements, hierarchy.buffer


@kernel
def fill_tick(program, numbers, tables, q, J, joint_placements, buffer):
    """Fill the hierarchy; True where the outcome is flawed (see `flawed`).

    The program is [n, rows], then for each part its kind, row or owner, memory, length, own program.
    """
    n, rows = program[0], program[1]
    A = buffer[: rows * n].reshape((rows, n))
    lower, upper = buffer[rows * n : rows * (n + 1)], buffer[rows * (n + 1) : rows * (n + 2)]
    bounds = buffer[rows * (n + 3) :].reshape((4, n))
    for side in range(4):
        for j in range(n):
            bounds[side, j] = numbers[side * n + j]
    at = 2
    while at < program.size:
        kind, place, start, stop = program[at], program[at + 1], program[at + 2], program[at + 3]
        own = program[at + 5 : at + 5 + program[at + 4]]
        if kind == FRAME:
            frame_rows(own, J, joint_placements, tables[start:stop], A[place:], lower[place:], upper[place:])
        elif kind == JOINTS:
            joint_rows(own, q, numbers[start:stop], lower[place:], upper[place:])
        elif kind == ACCELERATION_LIMIT:
            narrow_by_acceleration(own, q, numbers[start:stop], bounds, place)
        else:
            narrow_by_position(own, q, numbers[start:stop], bounds, place)
        at += 5 + own.size
    return flawed(buffer, n, rows)


@kernel
def flawed(buffer, n, rows):
    """Whether there is NaN anywhere, inf in A, or a bound that nothing can meet; ±inf bounds are fine."""
    bad = False
    for i in range(rows * n):
        bad |= not abs(buffer[i]) < np.inf
    for i in range(rows * n, rows * (n + 1)):
        bad |= not (buffer[i] < np.inf and buffer[i + rows] > -np.inf)
    for j in range(rows * (n + 3), rows * (n + 3) + n):
        bad |= not (buffer[j] < np.inf and buffer[j + n] > -np.inf)
    return bad
