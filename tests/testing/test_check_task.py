"""Every task that we ship keeps the contract of a task, and the check catches each planted lie."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from taskopt import (
    BoxTask,
    CentreOfMassTask,
    Configuration,
    DampingTask,
    During,
    FrameTask,
    GazeTask,
    GradientTask,
    InvalidValue,
    JointRange,
    JointTask,
    ObjectiveTask,
    OrientationTask,
    PositionTask,
    Stack,
)
from taskopt.jit import kernel_apart
from taskopt.kinematics.task import BoundTask, Task
from taskopt.testing import check_task
from tests.helpers.moving import tumbling
from tests.helpers.robots import FRAMES, robot

ROBOTS = ("planar", "panda", "tiago", "talos_reduced")


def moving(name: str) -> object:
    """A target that turns and moves near the frame."""
    of = robot(name)
    return tumbling(Configuration(of, of.posture("middle")).pose(FRAMES[name]), 1)


TASKS: dict[str, Callable[[str], Task]] = {
    "frame": lambda r: FrameTask(FRAMES[r], target=moving(r), gain=5.0, weight=(1.0, 0.1)),
    "frame, world": lambda r: FrameTask(
        FRAMES[r], target=moving(r), gain=5.0, expressed="world", axes="xz y"
    ),
    "position": lambda r: PositionTask(FRAMES[r], target=moving(r), gain=(1.0, 2.0, 3.0)),
    "position, own": lambda r: PositionTask(FRAMES[r], target=moving(r), gain=5.0, expressed="own"),
    "orientation": lambda r: OrientationTask(FRAMES[r], target=moving(r), gain=5.0),
    "orientation, world": lambda r: OrientationTask(FRAMES[r], target=moving(r), gain=5.0, expressed="world"),
    "joint": lambda r: JointTask(gain=3.0, weight=1e-3),
    "damping": lambda r: DampingTask(2.0),
    "gradient": lambda r: GradientTask(JointRange(), gain=2.0),
    "objective": lambda r: ObjectiveTask(JointRange(), at_least=1.0, gain=5.0),
    "box": lambda r: BoxTask(FRAMES[r], [9.0, -np.inf, 7.0], [9.5, -9.0, np.inf], gain=2.0),
    "gaze": lambda r: GazeTask(FRAMES[r], [0.3, 0.4, 5.0], half_angle=0.01, axis=(0.0, 1.0, 0.2), gain=2.0),
    "during": lambda r: During(FrameTask(FRAMES[r], gain=5.0), begin=-1.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("task", TASKS)
def test_every_task_keeps_the_contract(task, name):
    """Rows are derivatives, compiled and Python rows agree, promises of constancy hold."""
    check_task(TASKS[task](name), robot(name), count=6)


@pytest.mark.parametrize("name", ["panda", "talos_reduced"])
def test_the_centre_of_mass_keeps_the_contract(name):
    """The same for the centre of mass, of robots that have one."""
    check_task(CentreOfMassTask([0.1, 0.2, 0.3], gain=4.0), robot(name), count=6)


@dataclass(frozen=True, eq=False)
class Height(Task):
    """The height of a frame above the ground: what a user would write, with room for one lie."""

    frame: str
    gain: float = 4.0
    weight: float = 1.0
    lie: str = ""

    def bind(self, robot, name):
        return BoundHeight(name, self)


class BoundHeight(BoundTask):
    """One row."""

    def __init__(self, name, task):
        super().__init__(name, ("z",), ("m/s",), task.gain, task.weight)
        self._task, self._calls, self._memory = task, 0, np.zeros(1)
        if task.lie == "unit":
            self.row_units = ("m",)
        if task.lie == "unit of nothing":
            self.row_units = ("metres/s",)
        if task.lie == "weight":
            self.weight = np.ones(1)
        if task.lie == "gain":
            self.gain = np.full(1, 4.0)
        if task.lie == "column":
            self.column = (0,)
        if task.lie == "names":
            self.row_names, self.row_units, self.column = ("z", "z"), ("m/s", "m/s"), (-1, -1)
            self.gain, self.weight, self.error = np.ones(2), np.ones(2), np.zeros(2)
        if task.lie == "constant":
            self.constant = True

    def fill(self, configuration, t, rows):
        lie, self._calls = self._task.lie, self._calls + 1
        error = 0.5 - configuration.pose(self._task.frame)[2, 3]
        J = configuration.jacobian(self._task.frame)
        rows.A[0] = J[2] * (1.01 if lie == "derivative" else 1.0)
        if lie == "sign":
            rows.A[0] *= -1.0
        rows.lower[0] = rows.upper[0] = self.gain[0] * error + (0.1 if lie == "feedforward" else 0.0)
        if lie == "memory":
            rows.lower[0] = rows.upper[0] = rows.lower[0] + 1e-6 * self._calls
        if lie == "nan" and self._calls > 3:
            rows.A[0, 0] = np.nan
        if lie == "crossed":
            rows.lower[0] = rows.upper[0] + 1.0
        if lie == "moves":
            configuration.q[0] += 1e-3
        if lie == "kept":
            self.error = configuration.q[:1]
        else:
            self.error[0] = error


LIES = {
    "unit": "no unit of a rate",
    "unit of nothing": "unit 'metres/s' of 'height' is no unit of a rate; such are rad/s",
    "moves": "moves the robot that it is handed, by 0.001",
    "weight": "times the weight",
    "gain": "times the gain",
    "column": "differs from unit vector 0",
    "names": "not unique",
    "constant": "said to be constant",
    "derivative": "not the derivative of its error",
    "sign": "not the derivative of its error",
    "feedforward": "not the derivative of its error",
    "memory": "differ by",
    "nan": "not finite",
    "crossed": "exceeds its upper bound",
    "kept": "with the configuration",
}


def test_a_task_of_a_user_passes():
    """The honest one keeps the contract."""
    check_task(Height("panda_hand"), robot("panda"))


@pytest.mark.parametrize("lie", LIES)
def test_each_lie_is_caught(lie):
    """One lie at a time fails with a sentence that names it; a NaN may stop the plan before."""
    with pytest.raises((AssertionError, InvalidValue), match="not finite" if lie == "nan" else LIES[lie]):
        check_task(Height("panda_hand", lie=lie), robot("panda"))


@kernel_apart
def height_rows(parameters, memory, state, rows):
    """z of a joint: A from the spatial Jacobian, v_z + (ω × p)_z; memory is goal, gain, error."""
    J, place = state.jacobians, state.placements[parameters[0]]
    x, y, z = place[9], place[10], place[11]
    for k in range(rows.A.shape[1]):
        rows.A[0, k] = 0.0
    for i in range(1, parameters.size):
        k = parameters[i]
        rows.A[0, k] = J[2, k] + J[3, k] * y - J[4, k] * x
    memory[2] = memory[0] - z
    rows.lower[0] = rows.upper[0] = memory[1] * memory[2]


class KernelHeight(Task):
    """A compiled task from outside the package."""

    def bind(self, robot, name):
        return BoundKernelHeight(robot, name)


class BoundKernelHeight(BoundTask):
    """Its rows: kernel, parameters and memory are all that it hands over."""

    fixed_target = True

    def __init__(self, robot, name):
        super().__init__(name, ("z",), ("m/s",), gain=3.0)
        self.kernel = height_rows
        self.parameters = np.array([robot.frame_joint("panda_hand"), *robot.support("panda_hand")])
        self.use(np.array([0.5, 3.0, 0.0]))

    def use(self, memory):
        self.memory, self.error = memory, memory[2:]


def test_a_compiled_task_of_a_user_joins_the_compiled_call():
    """With its own kernel it keeps the contract, and the stack is still filled in one call."""
    check_task(KernelHeight(), robot("panda"))
    plan = Stack([[KernelHeight()], [JointTask()]]).compile(robot("panda"), 1e-3)
    assert plan.in_one_call
    assert not plan._fills


class Incomplete(Task):
    """A task whose bound form lacks something."""

    def __init__(self, bound):
        self._bound = bound

    def bind(self, robot, name):
        return self._bound(name)


class NoInit(BoundTask):
    """It does not call __init__ of its base."""

    def __init__(self, name):
        self.name = name


class NoFill(BoundTask):
    """It has no fill and no kernel."""

    def __init__(self, name):
        super().__init__(name, ("x",), ("m/s",))


class Uneven(BoundTask):
    """It has two names for one unit."""

    def __init__(self, name):
        super().__init__(name, ("x", "y"), ("m/s",))

    def fill(self, configuration, t, rows):
        pass


class MethodKernel(BoundTask):
    """Its kernel stands in the body of the class."""

    def kernel(self, memory, state, rows):
        pass

    def __init__(self, name):
        super().__init__(name, ("x",), ("m/s",))


@pytest.mark.parametrize(
    ("bound", "sentence"),
    [
        (NoInit, r"NoInit.* lacks row_names, .* of BoundTask"),
        (NoFill, r"NoFill.* lacks fill\(\) or a kernel"),
        (Uneven, r"Uneven.* has 2 row_names and 1 row_units"),
        (MethodKernel, r"MethodKernel.kernel is a method"),
        (lambda name: object(), r"must return a BoundTask"),
    ],
)
def test_an_incomplete_task_is_refused_when_the_stack_is_compiled(bound, sentence):
    """The message names the class, what it lacks, and the base class that has it."""
    with pytest.raises(InvalidValue, match=sentence):
        Stack([[Incomplete(bound)]]).compile(robot("planar"), 1e-3)


class NoBind(Task):
    """A declaration that cannot be bound."""


def test_a_declaration_without_bind_is_refused_by_the_stack():
    """The message names the class and what it lacks; what is no task at all is refused, too."""
    with pytest.raises(InvalidValue, match=r"NoBind lacks bind\(\) of Task"):
        Stack([[NoBind()]])
    with pytest.raises(InvalidValue, match="own tasks derive from Task"):
        Stack([[object()]])
