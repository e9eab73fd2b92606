"""One compiled call that fills the rows and the box of a tick.

A call into compiled code costs more than the rows of a task, so the tasks and limits that have a kernel
are listed in one integer program over one float memory, and a single kernel walks it. A task or limit
without one fills its rows from Python, before or after that call.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.acceleration import narrow_by_acceleration
from taskopt.kinematics.limit.joint import narrow_by_position
from taskopt.kinematics.task.centre_of_mass import centre_of_mass_rows
from taskopt.kinematics.task.frame_kernel import frame_rows
from taskopt.kinematics.task.joint import joint_rows

KINDS = ("frame", "joints", "centre of mass", "joint position limit", "joint acceleration limit")
FRAME, JOINTS, CENTRE_OF_MASS, POSITION_LIMIT = range(4)


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
) -> tuple[IntArray, Array, Array, Array, Array, Array]:
    """The arguments of `fill_tick` for a hierarchy.

    `parts`: each with the row where it begins, or with its number as owner of bounds. The box and its
    owners start on every tick as they stand in the hierarchy now.
    """
    layout = hierarchy.layout
    program = [layout.n, layout.row_count, layout.level_count, *layout.offsets, *layout.columns]
    pool = [hierarchy.buffer[-4 * layout.n :]]
    for part, place in parts:
        start = sum(map(len, pool))
        program += [KINDS.index(part.kind), place, start, start + part.memory.size, len(part.program)]
        program += part.program.tolist()
        pool.append(part.memory.ravel())
    numbers = np.concatenate(pool)
    start = len(pool[0])
    for part, _ in parts:
        shape, stop = part.memory.shape, start + part.memory.size
        part.use(numbers[start:stop].reshape(shape))
        start = stop
    instructions = np.array(program, dtype=np.int64)
    return instructions, numbers, at.q, at.joint_jacobians, at.joint_placements, hierarchy.buffer


@kernel_apart
def fill_tick(program, numbers, q, J, joint_placements, buffer):
    """Fill the hierarchy; True where the outcome is flawed (see `flawed`).

    The program is n, M and the number of levels, offsets and columns as in `Layout`, then for each part
    its kind, row or owner, first and last number of its memory, and the length of its own program, which
    follows.
    """
    n, rows = program[0], program[1]
    A = buffer[: rows * n].reshape((rows, n))
    lower, upper = buffer[rows * n : rows * (n + 1)], buffer[rows * (n + 1) : rows * (n + 2)]
    bounds = buffer[rows * (n + 3) :].reshape((4, n))
    for side in range(4):
        for j in range(n):
            bounds[side, j] = numbers[side * n + j]
    start = 3 + program[2] + 2
    at = start + rows
    while at < program.size:
        kind, place, memory = program[at], program[at + 1], numbers[program[at + 2] : program[at + 3]]
        own = program[at + 5 : at + 5 + program[at + 4]]
        if kind in (FRAME, CENTRE_OF_MASS):
            table = memory.reshape((memory.size // 6, 6))
            fill = A[place:], lower[place:], upper[place:]
            if kind == FRAME:
                frame_rows(own, J, joint_placements, table, *fill)
            else:
                centre_of_mass_rows(own, J, joint_placements, table, *fill)
        elif kind == JOINTS:
            joint_rows(own, q, memory, lower[place:], upper[place:])
        elif kind == POSITION_LIMIT:
            narrow_by_position(own, q, memory, bounds, place)
        else:
            narrow_by_acceleration(own, q, memory, bounds, place)
        at += 5 + own.size
    return flawed(buffer, n, program[start : start + rows])


@kernel
def flawed(buffer, n, columns):
    """Whether there is NaN anywhere, inf in A, or a bound that nothing can meet; ±inf bounds are fine."""
    bad, rows = False, columns.size
    for i in range(rows):
        if columns[i] < 0:  # the others are unit vectors for good
            for j in range(i * n, (i + 1) * n):
                bad |= not abs(buffer[j]) < np.inf
    for i in range(rows * n, rows * (n + 1)):
        bad |= not (buffer[i] < np.inf and buffer[i + rows] > -np.inf)
    for j in range(rows * (n + 3), rows * (n + 3) + n):
        bad |= not (buffer[j] < np.inf and buffer[j + n] > -np.inf)
    return bad
