"""Parts with a kernel of their own: what a plan could not call is refused when the stack is compiled."""

from dataclasses import dataclass

import numpy as np
import pytest

from taskopt import BoundLimit, BoundTask, InvalidValue, JointTask, Limit, Stack, Task
from taskopt.jit import COMPILED, kernel_apart
from taskopt.kinematics.robot import planar_arm


@kernel_apart
def four(parameters, memory, state, rows):
    """Ask the first joint for the velocity in `memory`."""
    rows.A[0, parameters[0]] = 1.0
    rows.lower[0] = memory[0]
    rows.upper[0] = memory[0]


@kernel_apart
def five(parameters, memory, state, bounds, owner):
    """Bound the first joint from above by the velocity in `memory`."""
    if memory[0] < bounds[1, parameters[0]]:
        bounds[1, parameters[0]] = memory[0]
        bounds[3, parameters[0]] = owner


@kernel_apart
def three(parameters, memory, rows):
    """Take less than a plan hands over."""


def plain(parameters, memory, state, rows):
    """Take what a plan hands over, and be no compiled function."""


@kernel_apart
def array_for_number(parameters, memory, state, rows):
    """Write all of `memory` where one number belongs."""
    rows.A[0, 0] = memory


@kernel_apart
def number_for_array(parameters, memory, state, rows):
    """Read a number as if it were an array."""
    rows.A[0, 0] = memory[0][0]


@kernel_apart
def assigned_field(parameters, memory, state, rows):
    """Assign to a field instead of writing into its array."""
    rows.lower = memory


@dataclass(frozen=True)
class OwnTask(Task):
    """A task of one row, with the attributes of its part as the test likes them."""

    kernel: object = four
    parameters: object = (0,)
    memory: object = (0.25,)
    name: str | None = "own"

    def bind(self, robot, name):
        """Return a part with the attributes."""
        part = BoundTask(name, ("x",), ("rad/s",))
        return _with_attributes(part, self)


@dataclass(frozen=True)
class OwnLimit(Limit):
    """A limit on the first joint, with the attributes of its part as the test likes them."""

    kernel: object = five
    parameters: object = (0,)
    memory: object = (0.125,)
    name: str = "own"

    def bind(self, robot, dt):
        """Return a part with the attributes."""
        return _with_attributes(BoundLimit(self.name), self)


def _with_attributes(part, declared):
    """Give a part its kernel and arrays; tuples become arrays of integers or floats."""
    part.kernel = declared.kernel
    made = {tuple: np.array}
    part.parameters = made.get(type(declared.parameters), lambda value: value)(declared.parameters)
    part.memory = made.get(type(declared.memory), lambda value: value)(declared.memory)
    return part


def test_a_part_with_a_kernel_that_fits_is_filled_by_it():
    """The kernels of both kinds are called with the arrays of their parts."""
    plan = Stack([[OwnTask()], [JointTask()]], [OwnLimit()]).compile(planar_arm((1.0, 1.0)), 1e-3)
    hierarchy = plan.at(np.zeros(2), 0.0)
    level = hierarchy.levels[0]
    np.testing.assert_array_equal(level.A, [[1.0, 0.0]])
    np.testing.assert_array_equal(level.lower, [0.25])
    np.testing.assert_array_equal(hierarchy.box_upper, [0.125, np.inf])


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            OwnTask(kernel=three),
            r"kernel of BoundTask, .* 'own' is bound, takes \(parameters, memory, rows\)",
        ),
        (OwnTask(kernel=five), r"calls it with \(parameters, memory, state, rows\); give it these 4 "),
        (OwnTask(kernel=3.0), r"a kernel that is not compiled, 3.0; write a function \(parameters, memory, "),
        (
            OwnTask(parameters=0),
            r"parameters of BoundTask, .* array of integers .*, got 0, an object of type int; write np",
        ),
        (
            OwnTask(parameters=(0.0,)),
            r"got an array of float64 with the shape \(1,\); .* no integers into mem",
        ),
        (OwnTask(parameters=((0,),)), r"parameters .* got an array of int64 with the shape \(1, 1\)"),
        (OwnTask(parameters=[0]), r"parameters .* got \[0\], an object of type list"),
        (
            OwnTask(memory=0.25),
            r"memory of BoundTask, .* array of floats, got 0.25, an object of type float; write self.use",
        ),
        (OwnTask(memory=(1,)), r"memory .* got an array of int64 with the shape \(1,\)"),
    ],
)
def test_a_task_whose_kernel_cannot_be_called_is_refused(part, message):
    """The message says what is wrong, what is expected, and the way out."""
    with pytest.raises(InvalidValue, match=message):
        Stack([[part]]).compile(planar_arm((1.0, 1.0)), 1e-3)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            OwnLimit(kernel=four),
            r"calls it with \(parameters, memory, state, bounds, owner\); give it these 5 ",
        ),
        (OwnLimit(parameters=(0.5,)), r"parameters of BoundLimit, .* got an array of float64"),
        (
            OwnLimit(memory=0.125),
            r"memory of BoundLimit, to which 'own' is bound, must be an array of floats",
        ),
    ],
)
def test_a_limit_whose_kernel_cannot_be_called_is_refused(part, message):
    """A limit on single velocities hands over bounds and owner in the place of rows."""
    with pytest.raises(InvalidValue, match=message):
        Stack([[JointTask()]], [part]).compile(planar_arm((1.0, 1.0)), 1e-3)


@pytest.mark.skipif(not COMPILED, reason="NUMBA_DISABLE_JIT=1 leaves every kernel a plain function")
def test_a_kernel_that_is_not_compiled_is_refused():
    """A plain function cannot be called from the compiled function of a plan."""
    with pytest.raises(
        InvalidValue, match=r"not compiled, <function plain .*; write .* taskopt.jit.kernel_apart"
    ):
        Stack([[OwnTask(kernel=plain)]]).compile(planar_arm((1.0, 1.0)), 1e-3)


@pytest.mark.skipif(not COMPILED, reason="NUMBA_DISABLE_JIT=1 leaves nothing to compile")
@pytest.mark.parametrize(
    ("own", "message"),
    [
        (
            array_for_number,
            r"test_part.py, line \d+\): .*setitem\(array\(.*, array\(float64, 1d, C\)\)",
        ),
        (number_for_array, r"test_part.py, line \d+\): .*getitem\(float64, "),
        (assigned_field, r"RowArrays\(.*\)\.lower = "),
    ],
)
def test_a_kernel_that_mixes_numbers_and_arrays_names_its_line(own, message):
    """The first tick says where the fault is and what it is, instead of a page of Numba."""
    plan = Stack([[OwnTask(kernel=own)]]).compile(planar_arm((1.0, 1.0)), 1e-3)
    with pytest.raises(InvalidValue, match=rf"a kernel cannot be compiled.*{message}"):
        plan.at(np.zeros(2), 0.0)
