"""Redundancy resolution of robots by optimisation: strict task stacks, certified and recorded.

The names below are imported when they are first asked for, so that `taskopt --help` does not wait for
Pinocchio and Numba, nor a hierarchy of plain arrays for any robot.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taskopt.errors import TaskoptError as TaskoptError
    from taskopt.hierarchy.problem import Hierarchy as Hierarchy
    from taskopt.hierarchy.problem import Level as Level
    from taskopt.kinematics.configuration import Configuration as Configuration
    from taskopt.kinematics.limit import JointPositionLimit as JointPositionLimit
    from taskopt.kinematics.limit import JointVelocityLimit as JointVelocityLimit
    from taskopt.kinematics.objective import JointRange as JointRange
    from taskopt.kinematics.objective import Manipulability as Manipulability
    from taskopt.kinematics.objective import UserFunction as UserFunction
    from taskopt.kinematics.robot import Robot as Robot
    from taskopt.kinematics.stack import Stack as Stack
    from taskopt.kinematics.target import Circle as Circle
    from taskopt.kinematics.target import Function as Function
    from taskopt.kinematics.target import Hold as Hold
    from taskopt.kinematics.target import Latest as Latest
    from taskopt.kinematics.target import Line as Line
    from taskopt.kinematics.task import DampingTask as DampingTask
    from taskopt.kinematics.task import FrameTask as FrameTask
    from taskopt.kinematics.task import GradientTask as GradientTask
    from taskopt.kinematics.task import JointTask as JointTask
    from taskopt.kinematics.task import OrientationTask as OrientationTask
    from taskopt.kinematics.task import PositionTask as PositionTask
    from taskopt.loop.controller import Controller as Controller
    from taskopt.loop.scenario import Scenario as Scenario
    from taskopt.resolver.registry import resolve as resolve

_HOME = {
    "Configuration": "taskopt.kinematics.configuration",
    "Controller": "taskopt.loop.controller",
    "TaskoptError": "taskopt.errors",
    "JointPositionLimit": "taskopt.kinematics.limit",
    "JointVelocityLimit": "taskopt.kinematics.limit",
    "JointRange": "taskopt.kinematics.objective",
    "Manipulability": "taskopt.kinematics.objective",
    "UserFunction": "taskopt.kinematics.objective",
    "Hierarchy": "taskopt.hierarchy.problem",
    "Level": "taskopt.hierarchy.problem",
    "Circle": "taskopt.kinematics.target",
    "Function": "taskopt.kinematics.target",
    "Hold": "taskopt.kinematics.target",
    "Latest": "taskopt.kinematics.target",
    "Line": "taskopt.kinematics.target",
    "resolve": "taskopt.resolver.registry",
    "Robot": "taskopt.kinematics.robot",
    "Scenario": "taskopt.loop.scenario",
    "Stack": "taskopt.kinematics.stack",
    "DampingTask": "taskopt.kinematics.task",
    "FrameTask": "taskopt.kinematics.task",
    "GradientTask": "taskopt.kinematics.task",
    "JointTask": "taskopt.kinematics.task",
    "OrientationTask": "taskopt.kinematics.task",
    "PositionTask": "taskopt.kinematics.task",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'taskopt' has no attribute '{name}'; it has {', '.join(_HOME)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
