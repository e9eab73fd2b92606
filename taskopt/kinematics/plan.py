"""The compiled function that fills the rows and the bounds of velocities of a tick in one call.

Every part of a plan that has a kernel (`taskopt.kinematics.part`) is called from one compiled function. That
function is made for the set of kernels that the plan needs: `fill_function` nests one small function around
another, each of which calls its kernel or passes on to the next,

    link 3: if index == 3 call the third kernel, else link 2: if index == 2 …

The kernels are called and not inlined, so that the function for a new set of kernels compiles in a fraction
of a second. Its machine code is cached by its content like that of every kernel, and plans with the same
kernels share it.

In a plan of second order each task has a second kernel, which turns its rows A v = b into A q̈ = b. The
limits are filled at s = q ⊕ v h/2 and turned into bounds on q̈ by q̈ = (v⁺ − v)/h, see
`taskopt.kinematics.second_order`.

The function reads two arrays. `program` holds integers: a header, then the entry of each part, which ends
with the part's own parameters. `numbers` holds all floats of the plan: the buffer of the hierarchy, its norm,
the bounds of velocities with which each tick starts (the box), the motion of the robot (nothing at first
order), the memories of the parts, and what `rank_in_doubt` keeps from tick to tick.
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
from taskopt.kinematics.limit.base import close_crossed
from taskopt.kinematics.part import (
    BoxKernel,
    LiftKernel,
    Motion,
    Part,
    RobotState,
    RowArrays,
    RowKernel,
    RowPart,
)

Fill = Callable[[IntArray, Array, Array, Array, Array], bool]
Tick = tuple[IntArray, Array, Array, Array, Array]

NO_MOTION = np.zeros(0)


class Header(IntEnum):
    """The integers with which a program begins."""

    UNKNOWNS = 0
    ROWS = 1
    LEVELS = 2
    NORM = 3  # where the norm begins in `numbers`; the buffer of the hierarchy ends there
    BOX = 4  # where the box begins with which each tick starts
    MOTION = 5  # where the motion of the robot begins, see `motion_size`
    OFFSETS = 6  # the offsets of the levels begin here, then the columns of the rows, then the parts


class Entry(IntEnum):
    """The integers with which the entry of a part begins."""

    KERNEL = 0  # k > 0: the k-th kernel of rows; k < 0: the (−k)-th kernel of bounds
    PLACE = 1  # first row of the part, or its first index in the owners of bounds
    COUNT = 2  # number of rows
    START = 3  # where its memory begins in `numbers`
    STOP = 4  # where its memory ends
    LIFT = 5  # k > 0: the k-th kernel that turns rows of velocities into rows of accelerations; 0: none
    SIZE = 6  # number of its own parameters, which follow
    PARAMETERS = 7


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
    parts: Sequence[tuple[Part, int]],
    configuration: Configuration,
    hierarchy: Hierarchy,
    groups: IntArray,
    motion: Array = NO_MOTION,
) -> CompiledTick:
    """Make the compiled function of some parts, and move their memory into one array.

    Args:
        parts: Parts that have a kernel, each with its first row, or with its first index in the owners of
            bounds.
        configuration: Robot whose arrays the function reads, now and later.
        hierarchy: Hierarchy in which all constant numbers are written; every tick starts with its box.
        groups: Groups of curved rows, see `taskopt.hierarchy.rank_doubt.new_watch`.
        motion: Memory of the motion of the robot, see `motion_size`; empty for a plan of first order.

    Returns:
        The function, its arguments, and the hierarchy in its new memory.
    """
    layout, n = hierarchy.layout, hierarchy.layout.n
    rows = _distinct(part.kernel for part, _ in parts if isinstance(part, RowPart))
    bounds = _distinct(part.kernel for part, _ in parts if not isinstance(part, RowPart))
    lifts = _distinct(part.lift_kernel for part, _ in parts if isinstance(part, RowPart) and motion.size)
    pieces = [hierarchy.buffer, hierarchy.norm.ravel(), box_of(hierarchy.buffer, n).ravel(), motion]
    pieces += [*(part.memory.ravel() for part, _ in parts), new_watch(n, groups)]
    numbers = np.concatenate(pieces)
    starts = list(accumulate(map(len, pieces), initial=0))
    program = [n, layout.row_count, layout.level_count, *starts[1:4]]
    program += [*layout.offsets, *layout.columns]
    for (part, place), start, stop in zip(parts, starts[4:], starts[5:], strict=False):
        lift = 0
        if isinstance(part, RowPart):
            head = [rows.index(part.kernel) + 1, place, len(part.row_names)]
            lift = lifts.index(part.lift_kernel) + 1 if part.lift_kernel in lifts else 0
        else:
            head = [-bounds.index(part.kernel) - 1, place, 0]
        program += [*head, start, stop, lift, len(part.parameters), *part.parameters.tolist()]
        part.use(numbers[start:stop].reshape(part.memory.shape))
    norm = numbers[starts[1] : starts[2]].reshape(hierarchy.norm.shape)
    moved = Hierarchy.view(layout, numbers[: starts[1]], norm)
    arrays = configuration.q, configuration.joint_jacobians, configuration.joint_placements
    arguments = np.array(program, dtype=np.int64), numbers, *arrays
    fill = accelerated_fill(rows, bounds, lifts) if motion.size else fill_function(rows, bounds)
    return CompiledTick(fill, arguments, moved)


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
        View, see `new_watch`. Its first two entries are Δt [s], or 0 if no tick is to be damped.
    """
    return tick[1][-watch_size(int(tick[0][Header.UNKNOWNS]), int(tick[0][Header.ROWS])) :]


def motion_of(tick: Tick) -> Array:
    """Return the memory of the motion of the robot, see `motion_size`.

    Args:
        tick: Arguments of the compiled function of a plan of second order.

    Returns:
        View of the memory.
    """
    size = motion_size(int(tick[0][Header.UNKNOWNS]), tick[2].size, len(tick[4]))
    start = int(tick[0][Header.MOTION])
    return tick[1][start : start + size]


def motion_size(nv: int, nq: int, joints: int) -> int:
    """Return the length of the memory of the motion of a robot.

    It holds Δt, v (nv,), the rates of the joint Jacobians (nv, 6), and then the robot at s = q ⊕ v Δt/2:
    s (nq,), joint Jacobians (nv, 6), joint placements (joints, 12).

    Args:
        nv: Number of velocities.
        nq: Number of coordinates.
        joints: Number of joints, the world included.

    Returns:
        The number of floats.
    """
    return 1 + nv + 6 * nv + nq + 6 * nv + 12 * joints


@kernel
def motion_in(memory, nv):
    """Return the motion of a robot from its memory.

    Args:
        memory: The memory, see `motion_size`.
        nv: Number of velocities.

    Returns:
        Views into the memory.
    """
    return Motion(memory[0], memory[1 : 1 + nv], memory[1 + nv : 1 + 7 * nv].reshape((nv, 6)).T)


@kernel
def state_ahead(memory, nv, nq, joints):
    """Return the arrays of the robot at s = q ⊕ v Δt/2 from the memory of its motion.

    Args:
        memory: The memory, see `motion_size`.
        nv: Number of velocities.
        nq: Number of coordinates.
        joints: Number of joints, the world included.

    Returns:
        Views into the memory.
    """
    q = 1 + 7 * nv
    jacobians, placements = q + nq, q + nq + 6 * nv
    return RobotState(
        memory[q:jacobians],
        memory[jacobians:placements].reshape((nv, 6)).T,
        memory[placements : placements + 12 * joints].reshape((joints, 12)),
    )


def _distinct(kernels: Iterable[object]) -> tuple[FunctionType, ...]:
    """Return kernels, each once and without None, in an order that does not depend on that of the parts."""
    found = dict.fromkeys(cast("FunctionType", kernel) for kernel in kernels if kernel is not None)
    return tuple(sorted(found, key=lambda one: (str(one.__module__), one.__qualname__)))


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
        close_crossed(bounds)
        return flawed(rows)

    return fill


@lru_cache(maxsize=256)
def accelerated_fill(
    row_kernels: tuple[RowKernel, ...],
    box_kernels: tuple[BoxKernel, ...],
    lift_kernels: tuple[LiftKernel, ...],
) -> Fill:
    """Return the compiled function that fills a hierarchy of second order by calling kernels.

    Args:
        row_kernels: Kernels of parts with rows.
        box_kernels: Kernels of limits on single velocities.
        lift_kernels: Kernels that turn the rows of tasks into rows of accelerations.

    Returns:
        A function as that of `fill_function`.
    """
    fill_rows, narrow, lift = _row_chain(row_kernels), _box_chain(box_kernels), _lift_chain(lift_kernels)

    @kernel_apart
    def fill(program, numbers, q, jacobians, placements):
        """Fill the limits at s = q ⊕ v h/2 and the tasks at q, and turn all of them to accelerations."""
        problem = problem_in(program, numbers)
        n = program[Header.UNKNOWNS]
        rows = view_rows(problem.buffer, n, problem.norm, problem.offsets, problem.columns)
        bounds = view_box(problem.buffer, n)
        moving = numbers[program[Header.MOTION] :]
        motion, ahead = motion_in(moving, n), state_ahead(moving, n, q.size, placements.shape[0])
        here = RobotState(q, jacobians, placements)
        for side in range(4):
            for j in range(n):
                bounds[side, j] = numbers[program[Header.BOX] + side * n + j]
        at = Header.OFFSETS + program[Header.LEVELS] + 2 + program[Header.ROWS]
        while at < program.size:
            index, place = program[at + Entry.KERNEL], program[at + Entry.PLACE]
            memory = numbers[program[at + Entry.START] : program[at + Entry.STOP]]
            to_lift, stop = program[at + Entry.LIFT], place + program[at + Entry.COUNT]
            first = at + Entry.PARAMETERS
            at = first + program[at + Entry.SIZE]
            parameters = program[first:at]
            if index <= 0:
                narrow(-index, parameters, memory, ahead, bounds, place)
                continue
            own = RowArrays(rows.A[place:stop], rows.lower[place:stop], rows.upper[place:stop])
            if place < problem.offsets[1]:
                fill_rows(index, parameters, memory, ahead, own)
                lift_limit(own.A, own.lower, own.upper, motion.velocity, motion.dt)
            else:
                fill_rows(index, parameters, memory, here, own)
                lift(to_lift, parameters, memory, here, motion, own)
        lift_box(bounds, motion.velocity, motion.dt)
        return flawed(rows)

    return fill


@kernel
def lift_limit(A, lower, upper, v, dt):
    """Turn bounds lower ≤ A v⁺ ≤ upper on the velocity of the next tick into bounds on A q̈.

    Args:
        A: Rows, (m, nv).
        lower: Lower bounds, (m,), overwritten by (lower − A v)/Δt.
        upper: Upper bounds, (m,), overwritten in the same way.
        v: Velocity of this tick, (nv,) [rad/s, m/s].
        dt: Δt [s].
    """
    for i in range(lower.size):
        now = 0.0
        for j in range(v.size):
            now += A[i, j] * v[j]
        lower[i], upper[i] = (lower[i] - now) / dt, (upper[i] - now) / dt


@kernel
def lift_box(bounds, v, dt):
    """Turn bounds on single velocities of the next tick into bounds on single accelerations.

    Bounds that cross by rounding meet in the middle before.

    Args:
        bounds: (4, nv), see `BoundLimit.narrow`; lower and upper bounds are overwritten by (bound − v)/Δt.
        v: Velocity of this tick, (nv,) [rad/s, m/s].
        dt: Δt [s].
    """
    close_crossed(bounds)
    for j in range(v.size):
        bounds[0, j], bounds[1, j] = (bounds[0, j] - v[j]) / dt, (bounds[1, j] - v[j]) / dt


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


def _lift_chain(kernels: tuple[LiftKernel, ...]) -> Callable[..., None]:
    """Return a compiled function that calls the lift kernel with a given number, counted from 1."""
    if not kernels:
        return _no_lift
    place, last, others = len(kernels), kernels[-1], _lift_chain(kernels[:-1])

    @kernel
    def link(index, parameters, memory, state, motion, rows):
        """Call the own kernel, or hand on to the others."""
        if index == place:
            last(parameters, memory, state, motion, rows)
        else:
            others(index, parameters, memory, state, motion, rows)

    return link


@kernel
def _no_lift(index, parameters, memory, state, motion, rows):
    """Do nothing: the end of a chain of lift kernels."""


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
