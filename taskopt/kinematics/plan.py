"""The compiled function that fills the rows and the bounds of velocities of a tick in one call.

Every part of a plan that has a kernel (`taskopt.kinematics.part`) is called from one compiled function. That
function is made for the set of kernels that the plan needs: `fill_function` nests one small function around
another, each of which calls its kernel or passes on to the next,

    link 3: if index == 3 call the third kernel, else link 2: if index == 2 …

The kernels are called and not inlined, so that the function for a new set of kernels compiles in a fraction
of a second. Its machine code is cached by its content like that of every kernel, and plans with the same
kernels share it.

The function reads two arrays. `program` holds integers: a header, then the entry of each part, which ends
with the part's own parameters. `numbers` holds all floats of the plan: the buffer of the hierarchy, its norm,
the bounds of velocities with which each tick starts (the box), the memories of the parts, and what
`rank_in_doubt` keeps from tick to tick.
"""

from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from functools import lru_cache
from itertools import accumulate
from types import FunctionType
from typing import NamedTuple, cast

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank_doubt import new_watch, watch_size
from taskopt.hierarchy.view import Rows, box_of, view_box, view_rows
from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.part import BoxKernel, Part, RobotState, RowArrays, RowKernel, RowPart

Fill = Callable[[IntArray, Array, Array, Array, Array], bool]
Tick = tuple[IntArray, Array, Array, Array, Array]


class Header(IntEnum):
    """The integers with which a program begins."""

    UNKNOWNS = 0
    ROWS = 1
    LEVELS = 2
    NORM = 3  # where the norm begins in `numbers`; the buffer of the hierarchy ends there
    BOX = 4  # where the box begins with which each tick starts
    OFFSETS = 5  # the offsets of the levels begin here, then the columns of the rows, then the parts


class Entry(IntEnum):
    """The integers with which the entry of a part begins."""

    KERNEL = 0  # k > 0: the k-th kernel of rows; k < 0: the (−k)-th kernel of bounds
    PLACE = 1  # first row of the part, or its first index in the owners of bounds
    COUNT = 2  # number of rows
    START = 3  # where its memory begins in `numbers`
    STOP = 4  # where its memory ends
    SIZE = 5  # number of its own parameters, which follow
    PARAMETERS = 6


class Problem(NamedTuple):
    """The arrays that a resolver needs, as views into a plan's `program` and `numbers`.

    Attributes:
        buffer: Buffer of the hierarchy, see `taskopt.hierarchy.view`.
        norm: Norm W, its diagonal (n,) or all of it row by row (n · n,).
        offsets: First row of each level, and the end, (L + 2,).
        columns: For each row, the index j of the velocity if the row of A is always the unit vector e_j, else
            −1, (M,).
    """

    buffer: Array
    norm: Array
    offsets: IntArray
    columns: IntArray


class CompiledTick(NamedTuple):
    """The compiled function of a plan, and its arguments.

    Attributes:
        fill: Function that fills the hierarchy from `arguments`; it returns True if the hierarchy is flawed,
            see `flawed`.
        arguments: Program, numbers, and the q, Jacobians and placements of the configuration.
        hierarchy: The hierarchy that is filled, in the memory of `numbers`.
    """

    fill: Fill
    arguments: Tick
    hierarchy: Hierarchy


def compiled_tick(
    parts: Sequence[tuple[Part, int]], configuration: Configuration, hierarchy: Hierarchy, groups: IntArray
) -> CompiledTick:
    """Make the compiled function of some parts, and move their memory into one array.

    Args:
        parts: Parts that have a kernel, each with its first row, or with its first index in the owners of
            bounds.
        configuration: Robot whose arrays the function reads, now and later.
        hierarchy: Hierarchy in which all constant numbers are written; every tick starts with its box.
        groups: Groups of curved rows, see `taskopt.hierarchy.rank_doubt.new_watch`.

    Returns:
        The function, its arguments, and the hierarchy in its new memory.
    """
    layout, n = hierarchy.layout, hierarchy.layout.n
    rows = _distinct(part for part, _ in parts if isinstance(part, RowPart))
    bounds = _distinct(part for part, _ in parts if not isinstance(part, RowPart))
    pieces = [hierarchy.buffer, hierarchy.norm.ravel(), box_of(hierarchy.buffer, n).ravel()]
    pieces += [*(part.memory.ravel() for part, _ in parts), new_watch(n, groups)]
    numbers = np.concatenate(pieces)
    starts = list(accumulate(map(len, pieces), initial=0))
    program = [n, layout.row_count, layout.level_count, starts[1], starts[2]]
    program += [*layout.offsets, *layout.columns]
    for (part, place), start, stop in zip(parts, starts[3:], starts[4:], strict=False):
        if isinstance(part, RowPart):
            head = [rows.index(part.kernel) + 1, place, len(part.row_names)]
        else:
            head = [-bounds.index(part.kernel) - 1, place, 0]
        program += [*head, start, stop, len(part.parameters), *part.parameters.tolist()]
        part.use(numbers[start:stop].reshape(part.memory.shape))
    norm = numbers[starts[1] : starts[2]].reshape(hierarchy.norm.shape)
    moved = Hierarchy.view(layout, numbers[: starts[1]], norm)
    arrays = configuration.q, configuration.joint_jacobians, configuration.joint_placements
    arguments = np.array(program, dtype=np.int64), numbers, *arrays
    return CompiledTick(fill_function(rows, bounds), arguments, moved)


def base_box(tick: Tick) -> Array:
    """Return the bounds of velocities with which each tick of a plan begins.

    Args:
        tick: Arguments of the compiled function.

    Returns:
        View (4, n): lower bounds, upper bounds, owner of each lower bound, owner of each upper bound.
    """
    program, numbers = tick[0], tick[1]
    n, start = int(program[Header.UNKNOWNS]), int(program[Header.BOX])
    return numbers[start : start + 4 * n].reshape(4, n)


def watch_of(tick: Tick) -> Array:
    """Return what `taskopt.hierarchy.rank_doubt` keeps from tick to tick.

    Args:
        tick: Arguments of the compiled function.

    Returns:
        View, see `new_watch`. Its first entry is Δt [s], or 0 if no tick is to be damped.
    """
    return tick[1][-watch_size(int(tick[0][Header.UNKNOWNS]), int(tick[0][Header.ROWS])) :]


def _distinct(parts: Iterable[Part]) -> tuple[FunctionType, ...]:
    """Return the kernels of parts, each once, in an order that does not depend on that of the parts."""
    kernels = dict.fromkeys(cast("FunctionType", part.kernel) for part in parts)
    return tuple(sorted(kernels, key=lambda found: (str(found.__module__), found.__qualname__)))


@lru_cache(maxsize=256)
def fill_function(row_kernels: tuple[RowKernel, ...], box_kernels: tuple[BoxKernel, ...]) -> Fill:
    """Return the compiled function that fills a hierarchy by calling kernels.

    Args:
        row_kernels: Kernels of parts with rows.
        box_kernels: Kernels of limits on single velocities.

    Returns:
        A compiled function of five arrays: `program`, the layout of the hierarchy; `numbers`, its memory,
        which is filled; and the three fields of `RobotState`. It returns True if the numbers are flawed.
    """
    fill_rows, narrow = _row_chain(row_kernels), _box_chain(box_kernels)

    @kernel_apart
    def fill(program, numbers, q, jacobians, placements):
        """Start from the plan's own box, then call the kernel of each part."""
        problem = problem_in(program, numbers)
        n = program[Header.UNKNOWNS]
        rows = view_rows(problem.buffer, n, problem.norm, problem.offsets, problem.columns)
        bounds = view_box(problem.buffer, n)
        start = program[Header.BOX]
        for side in range(4):
            for j in range(n):
                bounds[side, j] = numbers[start + side * n + j]
        state = RobotState(q, jacobians, placements)
        at = Header.OFFSETS + program[Header.LEVELS] + 2 + program[Header.ROWS]
        while at < program.size:
            index, place = program[at + Entry.KERNEL], program[at + Entry.PLACE]
            memory = numbers[program[at + Entry.START] : program[at + Entry.STOP]]
            first = at + Entry.PARAMETERS
            at = first + program[at + Entry.SIZE]
            parameters = program[first:at]
            if index > 0:
                stop = place + program[first - Entry.PARAMETERS + Entry.COUNT]
                own = RowArrays(rows.A[place:stop], rows.lower[place:stop], rows.upper[place:stop])
                fill_rows(index, parameters, memory, state, own)
            else:
                narrow(-index, parameters, memory, state, bounds, place)
        return flawed(rows)

    return fill


def _row_chain(kernels: tuple[RowKernel, ...]) -> Callable[..., None]:
    """Return a compiled function that calls the kernel of rows with a given number, counted from 1."""
    if not kernels:
        return _no_rows
    place, last, others = len(kernels), kernels[-1], _row_chain(kernels[:-1])

    @kernel
    def link(index, parameters, memory, state, rows):
        """Call the own kernel, or hand on to the others."""
        if index == place:
            last(parameters, memory, state, rows)
        else:
            others(index, parameters, memory, state, rows)

    return link


def _box_chain(kernels: tuple[BoxKernel, ...]) -> Callable[..., None]:
    """Return a compiled function that calls the kernel of bounds with a given number, counted from 1."""
    if not kernels:
        return _no_bounds
    place, last, others = len(kernels), kernels[-1], _box_chain(kernels[:-1])

    @kernel
    def link(index, parameters, memory, state, bounds, owner):
        """Call the own kernel, or hand on to the others."""
        if index == place:
            last(parameters, memory, state, bounds, owner)
        else:
            others(index, parameters, memory, state, bounds, owner)

    return link


@kernel
def _no_rows(index, parameters, memory, state, rows):
    """Do nothing: the end of a chain of kernels of rows."""


@kernel
def _no_bounds(index, parameters, memory, state, bounds, owner):
    """Do nothing: the end of a chain of kernels of bounds."""


@kernel
def problem_in(program, numbers):
    """Return the `Problem` of a plan, as views.

    Args:
        program: Integers of the plan.
        numbers: Numbers of the plan.

    Returns:
        Buffer of the hierarchy, norm, offsets and columns.
    """
    columns = Header.OFFSETS + program[Header.LEVELS] + 2
    return Problem(
        numbers[: program[Header.NORM]],
        numbers[program[Header.NORM] : program[Header.BOX]],
        program[Header.OFFSETS : columns],
        program[columns : columns + program[Header.ROWS]],
    )


@kernel_apart
def flawed(rows: Rows) -> bool:
    """Return True if a hierarchy holds numbers with which it cannot be solved.

    Such numbers are NaN anywhere, ±inf in A, a lower bound of +inf, and an upper bound of −inf. A lower bound
    of −inf or an upper bound of +inf means that there is none.

    Args:
        rows: Views of the hierarchy.

    Returns:
        True if there is such a number.
    """
    bad = False
    for i in range(rows.columns.size):
        if rows.columns[i] < 0:  # the others are unit vectors for good
            for j in range(rows.A.shape[1]):
                bad |= not abs(rows.A[i, j]) < np.inf
        bad |= not (rows.lower[i] < np.inf and rows.upper[i] > -np.inf)
    for j in range(rows.box_lower.size):
        bad |= not (rows.box_lower[j] < np.inf and rows.box_upper[j] > -np.inf)
    return bad
