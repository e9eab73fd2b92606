"""Redundancy resolution of robots by optimisation: strict task stacks, certified and recorded.

The names below are imported when they are first asked for, so that `taskopt --help` does not wait for
Pinocchio and Numba, nor a hierarchy of plain arrays for any robot.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taskopt.configuration import Configuration as Configuration
    from taskopt.controller import Controller as Controller
    from taskopt.errors import TaskoptError as TaskoptError
    from taskopt.limit import JointPositionLimit as JointPositionLimit
    from taskopt.limit import JointVelocityLimit as JointVelocityLimit
    from taskopt.objective import JointRange as JointRange
    from taskopt.objective import Manipulability as Manipulability
    from taskopt.objective import UserFunction as UserFunction
    from taskopt.problem.hierarchy import Hierarchy as Hierarchy
    from taskopt.problem.hierarchy import Level as Level
    from taskopt.reference import Circle as Circle
    from taskopt.reference import Function as Function
    from taskopt.reference import Hold as Hold
    from taskopt.reference import Latest as Latest
    from taskopt.reference import Line as Line
    from taskopt.resolver.registry import resolve as resolve
    from taskopt.robot import Robot as Robot
    from taskopt.scenario import Scenario as Scenario
    from taskopt.stack import Stack as Stack
    from taskopt.task import DampingTask as DampingTask
    from taskopt.task import FrameTask as FrameTask
    from taskopt.task import GradientTask as GradientTask
    from taskopt.task import JointTask as JointTask
    from taskopt.task import OrientationTask as OrientationTask
    from taskopt.task import PositionTask as PositionTask

_HOME = {
    "Configuration": "taskopt.configuration",
    "Controller": "taskopt.controller",
    "TaskoptError": "taskopt.errors",
    "JointPositionLimit": "taskopt.limit",
    "JointVelocityLimit": "taskopt.limit",
    "JointRange": "taskopt.objective",
    "Manipulability": "taskopt.objective",
    "UserFunction": "taskopt.objective",
    "Hierarchy": "taskopt.problem.hierarchy",
    "Level": "taskopt.problem.hierarchy",
    "Circle": "taskopt.reference",
    "Function": "taskopt.reference",
    "Hold": "taskopt.reference",
    "Latest": "taskopt.reference",
    "Line": "taskopt.reference",
    "resolve": "taskopt.resolver.registry",
    "Robot": "taskopt.robot",
    "Scenario": "taskopt.scenario",
    "Stack": "taskopt.stack",
    "DampingTask": "taskopt.task",
    "FrameTask": "taskopt.task",
    "GradientTask": "taskopt.task",
    "JointTask": "taskopt.task",
    "OrientationTask": "taskopt.task",
    "PositionTask": "taskopt.task",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'taskopt' has no attribute '{name}'; it has {', '.join(_HOME)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
