"""Parts of a plan: tasks and limits that are bound to a robot.

A part fills its rows, or narrows the bounds of the joint velocities, on every tick. It does so in Python, by
its method `fill` or `narrow`, or by a compiled kernel, which is given by three attributes:

    kernel       a function compiled by `taskopt.jit.kernel_apart`
    parameters   integers that the kernel reads: sizes, row indices, columns
    memory       numbers that the kernel reads and writes: targets, gains, errors

The plan calls the kernels of all its parts in one compiled call (`taskopt.kinematics.plan`), since a call
from Python costs more than the rows of a task. A part that a user writes can have a kernel in the same way.

The kernel of rows has the signature `(parameters, memory, state, rows)`, with `RobotState` and `RowArrays`.
The kernel of a limit on single velocities has `(parameters, memory, state, bounds, owner)`, with the last two
as in `BoundLimit.narrow`.
"""

from collections.abc import Callable, Mapping, Sequence
from inspect import ismethod, signature
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import COMPILED, Kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Parameter
from taskopt.kinematics.robot import Robot


class RobotState(NamedTuple):
    """State of the robot at one tick, as kernels read it.

    Attributes:
        q: Posture, (nq,) [rad, m].
        jacobians: Spatial Jacobian of all joints, (6, nv): column j is the velocity of the point of the body
            that passes the world's origin, then its angular velocity, both in the axes of the world, for a
            unit velocity j.
        placements: Pose of each joint in the world, the world itself first, (joints + 1, 12): the columns of
            its rotation one after another, then its translation [m].
    """

    q: Array
    jacobians: Array
    placements: Array


class RowArrays(NamedTuple):
    """The rows of one part, to be written by its kernel.

    Attributes:
        A: Coefficients of the joint velocities, (m, nv).
        lower: Lower bounds of A v, (m,); −inf where there is none.
        upper: Upper bounds of A v, (m,); equal to `lower` in an equality.
    """

    A: Array
    lower: Array
    upper: Array


class Motion(NamedTuple):
    """Motion of the robot at one tick of a stack of second order, as kernels read it.

    Attributes:
        dt: Δt [s], the time to the next tick.
        velocity: Velocity v at the beginning of the tick, (nv,) [rad/s, m/s].
        jacobian_rates: Rate of `RobotState.jacobians` along v, (6, nv).
    """

    dt: float
    velocity: Array
    jacobian_rates: Array


RowKernel = Callable[[IntArray, Array, RobotState, RowArrays], None]
LiftKernel = Callable[[IntArray, Array, RobotState, Motion, RowArrays], None]
BoxKernel = Callable[[IntArray, Array, RobotState, Array, int], None]

_ROW_ARGUMENTS = "parameters", "memory", "state", "rows"
_BOX_ARGUMENTS = "parameters", "memory", "state", "bounds", "owner"
_NO_PARAMETERS = np.zeros(0, dtype=np.int64)
_NO_MEMORY = np.zeros(0)


class Part:
    """Base of bound tasks and bound limits, each of which fills its part of the hierarchy.

    Attributes:
        name: Name of the part in its plan.
        constant: True if the part writes its numbers when the stack is compiled, and never again.
        kernel: Compiled function that does the work of each tick, or None to do it in Python. Assign it in
            `__init__`; a function in the body of a class would become a method.
        parameters: Integers that the kernel reads, a flat array of any length.
        memory: Floats that the kernel reads and writes, a flat array of any length.
    """

    name: str
    constant: bool = False
    kernel: RowKernel | BoxKernel | None = None
    parameters: IntArray = _NO_PARAMETERS
    memory: Array = _NO_MEMORY

    def use(self, memory: Array) -> None:
        """Make this part use another memory, which already holds its current numbers.

        The plan calls this once, after it has joined the memories of all parts. A part that keeps views into
        its memory must make new views here.

        Args:
            memory: The memory from now on, of the size of the old one.
        """
        self.memory = memory

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the parameters of this part by name of attribute, such as "gain"; none by default.

        The plan calls this once, after `use`.
        """
        return {}

    def retime(self, dt: float) -> None:
        """Change Δt for all later ticks.

        A limit must define this method if its rows or bounds depend on Δt and change from tick to tick. If
        such a limit lacks it, the plan refuses to change Δt.

        Args:
            dt: Δt [s].
        """

    def recall(self) -> object:
        """Return the state of the part from earlier ticks, besides its parameters; None for most parts."""
        return None

    def remember(self, kept: object) -> None:
        """Restore the state that `recall` of the same part returned, in a copy of a plan.

        Args:
            kept: The state.
        """


class RowPart(Part):
    """A part that fills rows lower ≤ A v ≤ upper.

    Args:
        name: Name of the part in its plan.
        row_names: Name of each row, such as ("x", "y").
        row_units: Unit of A v for each row, such as ("m/s", "m/s").
        column: For each row, the index j of the velocity if the row of A is always the unit vector e_j, else
            −1. Solvers skip work for unit vectors. None means −1 for all rows.

    Attributes:
        fixed_target: True if `aim` need not be called on every tick, since the target stands still.
        curved: False if A never changes with the posture; rows that are unit vectors count as such anyway.
        choices: Names that a row may have instead of its own; `fill` writes the number of the
            name, counted from 1, as the label of the row. Empty where each row has one name for good.
        lift_kernel: Compiled function that, in a stack of second order, turns the rows A v = b that `kernel`
            has written into rows A q̈ = b; or None. Its signature is `(parameters, memory, state, motion,
            rows)`, with `Motion`.
    """

    fixed_target: bool = False
    curved: bool = True
    lift_kernel: LiftKernel | None = None
    choices: tuple[str, ...] = ()

    def __init__(
        self,
        name: str,
        row_names: Sequence[str],
        row_units: Sequence[str],
        column: Sequence[int] | None = None,
    ) -> None:
        self.name = name
        self.row_names, self.row_units = tuple(row_names), tuple(row_units)
        self.column = (-1,) * len(self.row_names) if column is None else tuple(column)

    def prepare(self, rows: LevelRows) -> None:
        """Write the numbers of the rows that never change; the plan calls this once.

        Args:
            rows: Rows of this part in the hierarchy, in which A and the bounds are zero.
        """

    def start(self, configuration: Configuration, t: float) -> None:
        """Start the targets of a task or a limit from the present posture.

        Args:
            configuration: Robot at the start posture.
            t: Time [s].

        Raises:
            InvalidValue: A declared target does not fit.
        """

    def aim(self, t: float) -> None:
        """Write the target at t into `memory` for the kernel; a part without a kernel does not need this.

        Args:
            t: Time [s].
        """

    def lift(self, state: RobotState, motion: Motion, rows: LevelRows) -> None:
        """Turn the rows A v = b of this tick, which `fill` has written, into rows A q̈ = b.

        A part with a `lift_kernel` inherits this method, which runs the kernel; other parts that a stack of
        second order may have define their own.

        Args:
            state: Arrays of the robot at this tick.
            motion: Its motion at this tick.
            rows: Rows of this part in the hierarchy.
        """
        if self.lift_kernel is not None:
            arrays = RowArrays(rows.A, rows.lower, rows.upper)
            self.lift_kernel(self.parameters, self.memory, state, motion, arrays)

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows in place.

        A part with a kernel inherits this method, which runs the kernel; other parts define their own.

        Args:
            configuration: Robot at the posture of this tick.
            t: Time [s].
            rows: Rows of this part in the hierarchy.
        """
        if self.kernel is not None:
            self.aim(t)
            arrays = RowArrays(rows.A, rows.lower, rows.upper)
            self.kernel(self.parameters, self.memory, state_of(configuration), arrays)  # type: ignore[call-arg]


def state_of(configuration: Configuration) -> RobotState:
    """Return the arrays of a robot that kernels read, as views into a configuration.

    Args:
        configuration: The robot at q.

    Returns:
        Views that follow the configuration when it moves.
    """
    return RobotState(configuration.q, configuration.joint_jacobians, configuration.joint_placements)


def check_complete(part: object, base: type[Part], what: str, needed: Sequence[str]) -> None:
    """Check that a bound part has everything that a plan needs.

    Args:
        part: The bound part.
        base: The class that it must derive from.
        what: The declaration that made the part, for the message.
        needed: Names of the attributes that must be there.

    Raises:
        InvalidValue: The part derives from another class, lacks an attribute, has neither `fill` nor a kernel
            where it needs one, its kernel cannot be called with what the plan hands to it, or its sizes
            disagree.
    """
    own = type(part).__name__
    if not isinstance(part, base):
        raise InvalidValue(
            f"bind() of {what} must return a {base.__name__}, and {own} does not derive from it"
        )
    missing = [name for name in needed if not hasattr(part, name)]
    if missing:
        raise InvalidValue(
            f"{own}, to which {what} is bound, lacks {', '.join(missing)} of {base.__name__}; "
            f"call super().__init__() in its __init__"
        )
    if ismethod(part.kernel):
        raise InvalidValue(f"{own}.kernel is a method; assign the kernel in __init__, as self.kernel = …")
    if part.kernel is not None:
        _check_kernel(part, own, what)
    if isinstance(part, RowPart):
        _check_rows(part, own, what)


def _check_kernel(part: Part, own: str, what: str) -> None:
    """Raise `InvalidValue` if a plan could not call the kernel of a part, or not with its two arrays."""
    names = _ROW_ARGUMENTS if isinstance(part, RowPart) else _BOX_ARGUMENTS
    expected, made = f"({', '.join(names)})", f"to which {what} is bound"
    if not callable(part.kernel) or (COMPILED and not isinstance(part.kernel, Kernel)):
        raise InvalidValue(
            f"{own}, {made}, has a kernel that is not compiled, {part.kernel!r}; write a function {expected} "
            "and decorate it with taskopt.jit.kernel_apart"
        )
    try:
        signature(part.kernel).bind(*names)
    except TypeError:
        raise InvalidValue(
            f"the kernel of {own}, {made}, takes {signature(part.kernel)}, and a plan calls it with "
            f"{expected}; give it these {len(names)} parameters, and put what else it needs into memory"
        ) from None
    _check_memory(part.parameters, part.memory, f"{own}, {made},")


def _check_memory(parameters: object, memory: object, owner: str) -> None:
    """Raise `InvalidValue` unless the parameters of a kernel are integers, and its memory floats."""
    if not isinstance(parameters, np.ndarray) or parameters.ndim != 1 or parameters.dtype.kind != "i":
        raise InvalidValue(
            f"parameters of {owner} must be an array of integers (any,), got {_described(parameters)}; "
            "write np.array([...], dtype=np.int64), and put numbers that are no integers into memory"
        )
    if not isinstance(memory, np.ndarray) or memory.dtype != np.float64:
        raise InvalidValue(
            f"memory of {owner} must be an array of floats, got {_described(memory)}; "
            "write self.use(np.array([...], dtype=float)), even for a single number"
        )


def _described(value: object) -> str:
    """Describe a value that is not the expected array."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} with the shape {value.shape}"
    return f"{value!r}, an object of type {type(value).__name__}"


def _check_rows(part: RowPart, own: str, what: str) -> None:
    """Raise `InvalidValue` if a part cannot fill its rows, or if the number of names does not fit."""
    if part.kernel is None and not part.constant and type(part).fill is RowPart.fill:
        raise InvalidValue(f"{own}, to which {what} is bound, lacks fill() or a kernel of {RowPart.__name__}")
    m = len(part.row_names)
    for name in ("row_units", "column"):
        size = len(vars(part)[name])
        if size != m:
            raise InvalidValue(f"{own}, to which {what} is bound, has {m} row_names and {size} {name}")


def check_mass(robot: Robot, name: str) -> None:
    """Raise an error if a robot has no centre of mass.

    Args:
        robot: The robot.
        name: What needs it.

    Raises:
        InvalidValue: All its links are without inertia.
    """
    if not robot.mass > 0.0:
        raise InvalidValue(f"'{name}' needs masses, and {robot.name} has none; give its links inertia")
