"""Compilation of all kernels at once, for images and robots that must start quickly later.

Kernels are compiled for the types of their arguments, which do not depend on the robot. It is therefore
enough to resolve one tick of a small arm for every task and limit that has a kernel. Kernels that both
compiled code and Python call have two forms, so the Python code of other resolvers is run, too.
"""

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from taskopt.hierarchy.damping import RestDamping
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import judge
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry import Sphere
from taskopt.kinematics.limit import (
    FrameDistanceLimit,
    JointAccelerationLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    ObstacleLimit,
    SelfCollisionLimit,
)
from taskopt.kinematics.objective import Manipulability
from taskopt.kinematics.pose import exp3, exp6, jlog3, jlog6, log3, log6
from taskopt.kinematics.robot import Robot, planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Function, Line
from taskopt.kinematics.task import (
    CentreOfMassTask,
    FrameTask,
    GazeTask,
    GradientTask,
    JointTask,
    LookAtTask,
    OrientationTask,
    PositionTask,
    RelativeFrameTask,
    Task,
)
from taskopt.log.quick import compile_copy
from taskopt.loop.batch.controller import BatchController
from taskopt.loop.controller import Controller
from taskopt.loop.pose.solver import PoseSolver
from taskopt.resolver.active_set.resolver import ActiveSet, search_further

_CLOSED_FORMS = "pinv", "dls/chiaverini"
_LENGTHS = (0.4, 0.4, 0.4, 0.4)  # [m]
_START = np.array([0.3, 0.4, 0.5, 0.4])  # [rad]


def warm_up() -> None:
    """Compile all kernels of tasks, limits, resolvers, the certificate and the proof.

    Their machine code is kept in the folder that `taskopt.jit.store` defines, for every later process of the
    user. Progress is shown on stderr, unless everything is compiled already.
    """
    for robot, stack in _stacks():
        for fast_path in (True, False):
            control = Controller(robot, stack, ActiveSet(fast_path=fast_path))
            control.start(_START)
            control.step(_START, 0.001)
    PoseSolver(_bare_arm(), {"tip": Configuration(_bare_arm(), _START).pose("tip")}).solve()
    Configuration(_bare_arm(), _START).hessian("tip")
    far = PositionTask("tip", target=(9.0, 0.0, 0.0), axes="xy", gain=5.0)
    stretched = Stack([[far], [JointTask()]], [JointVelocityLimit()], damping=RestDamping())
    rests = Controller(_bare_arm(), stretched)
    for _ in range(2):  # the second tick after a damped one
        rests.step(np.zeros(4), 0.0)
    solvers = "hqp/daqp", "wqp/daqp", *(["hqp/quadprog"] if find_spec("quadprog") else [])
    problem = Hierarchy([Level([[1.0], [1.0]], [0.0, 1.0])])
    size, width = problem.layout.answer_size, problem.layout.width
    for robot, stack in islice(_stacks(), 1):
        search_further(problem, np.empty(size), np.empty(width, np.int8))  # seldom, and then within a tick
        for resolver in (*solvers, *_CLOSED_FORMS):
            resolution = Controller(robot, stack, resolver).step(_START, 0.001)
            resolution.kkt_met()  # its multipliers are found when they are asked for
    for resolver in solvers:  # with bounds in the way, without which no solver is asked
        Controller(_bare_arm(), _bounded(), resolver).step(_START, 0.0)
    judge(problem, [0.5])
    batch = BatchController(_bare_arm(), Stack([[PositionTask("tip", axes="xy")], [JointTask()]]))
    batch.start(_START[None])
    batch.set({"tip position.target": np.eye(4)[None]})
    batch.step(_START[None])
    pose = np.eye(4)
    for of_rotation in (log3, jlog3):
        of_rotation(pose[:3, :3].copy())
    for of_pose in (log6, jlog6):
        of_pose(pose)
    exp3(np.zeros(3))
    exp6(np.zeros(6))
    compile_copy()


def _stacks() -> Iterator[tuple[Robot, Stack]]:
    """Yield arms with stacks that together call every kernel of tasks and limits."""
    line = Line(by=(0.1, 0.0, 0.0), duration=1.0)
    tip: list[Task] = [PositionTask("tip", target=line, axes="xy")]
    rates: list[Limit] = [JointPositionLimit(), JointVelocityLimit(), JointAccelerationLimit(50.0)]
    arm, turn = _bare_arm(), Function(lambda t: exp6(np.array([0.0, 0.0, 0.0, 0.0, 0.0, t])))
    yield _with_masses(), Stack([[CentreOfMassTask(axes="xy")], [JointTask()]], damping=RestDamping())
    yield (
        arm,
        Stack(
            [[FrameTask("tip", target=turn)], [OrientationTask("tip", axes="y")], [JointTask()]], limits=rates
        ),
    )
    seen: list[Task] = [LookAtTask("tip", (2.0, 1.0, 0.0), axis=(1.0, 0.0, 0.0))]
    near: list[Limit] = [FrameDistanceLimit("tip", "link1", lower=0.1)]
    yield arm, Stack([[RelativeFrameTask("tip", root="link1", axes="xy")], seen, [JointTask()]], limits=near)
    # More pairs than rows call the broad phase; the margin is so large that some pairs are near and measured.
    yield arm, Stack([tip], limits=[SelfCollisionLimit(margin=0.35, influence=0.5, rows=1)])
    # At second order the limits have rows, so that the robot half a step ahead is filled, too.
    ahead: list[Limit] = [JointAccelerationLimit(50.0), FrameDistanceLimit("tip", "link1", lower=0.1)]
    yield arm, Stack([[FrameTask("tip", target=turn)], [JointTask()]], limits=ahead, order=2)
    yield _with_masses(), Stack([[JointTask()]], norm="inertia", order=2)
    apart: list[Limit] = [ObstacleLimit(Sphere((0.0, 1.5, 0.0), 0.1)), SelfCollisionLimit()]
    gaze = GazeTask("tip", (1.0, 1.0, 0.0), 0.5, axis=(1.0, 0.0, 0.0))
    yield arm, Stack([tip, [gaze], [GradientTask(Manipulability("tip", axes="xy"))]], limits=apart)


def _bounded() -> Stack:
    """Return a stack whose first level is met at limits on velocities, and whose last one cannot be met."""
    near = Configuration(_bare_arm(), _START).pose("tip")[:3, 3] + [0.14, 0.14, 0.0]
    hand = PositionTask("tip", target=near, axes="xy", gain=10.0)
    return Stack([[hand], [JointTask(np.full(4, 2.0), gain=100.0)]], [JointVelocityLimit()], damping=None)


def _bare_arm() -> Robot:
    """Return an arm of four links with limits and shapes."""
    return planar_arm(_LENGTHS, lower=-3.0, upper=3.0, velocity=3.0, radius=0.02)


def _with_masses() -> Robot:
    """Return an arm of four links with masses, which a description by lengths does not have."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    limit = '<limit effort="1" velocity="3" lower="-3" upper="3"/>'
    text = '<robot name="arm"><link name="link0"/>'
    for i, length in enumerate(_LENGTHS):
        text += f'<link name="link{i + 1}"><inertial><mass value="1"/>{inertia}</inertial></link>'
        text += f'<joint name="joint{i}" type="revolute"><parent link="link{i}"/><child link="link{i + 1}"/>'
        text += f'<origin xyz="{length} 0 0"/><axis xyz="0 0 1"/>{limit}</joint>'
    with TemporaryDirectory() as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(text + "</robot>", encoding="utf-8")
        return Robot.from_urdf(file)
