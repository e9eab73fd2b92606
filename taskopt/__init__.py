"""Redundancy resolution of robots by optimisation: strict task stacks, certified and recorded.

Every name that a user needs is here. Each is imported at its first use, so that `taskopt --help` does not
import Pinocchio and Numba, and a program that only uses hierarchies of plain arrays does not import robots.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from taskopt.synonyms import is_module, way_out

if TYPE_CHECKING:
    from taskopt.arrays import Array as Array
    from taskopt.compare import Comparison as Comparison
    from taskopt.errors import BadLog as BadLog
    from taskopt.errors import DroppedWarning as DroppedWarning
    from taskopt.errors import Infeasible as Infeasible
    from taskopt.errors import InvalidValue as InvalidValue
    from taskopt.errors import LogFailed as LogFailed
    from taskopt.errors import MissingFile as MissingFile
    from taskopt.errors import NotInstalled as NotInstalled
    from taskopt.errors import NotSolved as NotSolved
    from taskopt.errors import TaskoptError as TaskoptError
    from taskopt.errors import UnknownName as UnknownName
    from taskopt.hierarchy.active import Active as Active
    from taskopt.hierarchy.alternation import Alternation as Alternation
    from taskopt.hierarchy.alternation import alternations as alternations
    from taskopt.hierarchy.certificate import Certificate as Certificate
    from taskopt.hierarchy.certificate import certify as certify
    from taskopt.hierarchy.damping import Chiaverini as Chiaverini
    from taskopt.hierarchy.damping import ConstantDamping as ConstantDamping
    from taskopt.hierarchy.damping import Damping as Damping
    from taskopt.hierarchy.damping import NakamuraHanafusa as NakamuraHanafusa
    from taskopt.hierarchy.damping import NoDamping as NoDamping
    from taskopt.hierarchy.damping import NumericalFiltering as NumericalFiltering
    from taskopt.hierarchy.damping import RestDamping as RestDamping
    from taskopt.hierarchy.damping import Sugihara as Sugihara
    from taskopt.hierarchy.layout import Block as Block
    from taskopt.hierarchy.layout import Layout as Layout
    from taskopt.hierarchy.multipliers import certify_velocity as certify_velocity
    from taskopt.hierarchy.problem import Hierarchy as Hierarchy
    from taskopt.hierarchy.problem import Level as Level
    from taskopt.hierarchy.problem import LevelRows as LevelRows
    from taskopt.hierarchy.qp import QuadraticProgram as QuadraticProgram
    from taskopt.hierarchy.qp import Solution as Solution
    from taskopt.hierarchy.rank import RankRule as RankRule
    from taskopt.hierarchy.resolution import Resolution as Resolution
    from taskopt.hierarchy.review import Cause as Cause
    from taskopt.hierarchy.review import LevelAccount as LevelAccount
    from taskopt.hierarchy.review import Review as Review
    from taskopt.hierarchy.status import Status as Status
    from taskopt.kinematics.analysis.closed_chain import loop_jacobian as loop_jacobian
    from taskopt.kinematics.analysis.closed_chain import transmission as transmission
    from taskopt.kinematics.analysis.ellipsoid import Ellipsoid as Ellipsoid
    from taskopt.kinematics.analysis.ellipsoid import force_ellipsoid as force_ellipsoid
    from taskopt.kinematics.analysis.ellipsoid import velocity_ellipsoid as velocity_ellipsoid
    from taskopt.kinematics.analysis.jacobians import analytical_jacobian as analytical_jacobian
    from taskopt.kinematics.analysis.jacobians import analytical_jacobian_rate as analytical_jacobian_rate
    from taskopt.kinematics.analysis.jacobians import geometric_jacobian as geometric_jacobian
    from taskopt.kinematics.analysis.jacobians import geometric_jacobian_rate as geometric_jacobian_rate
    from taskopt.kinematics.analysis.redundancy import Subspaces as Subspaces
    from taskopt.kinematics.analysis.redundancy import internal_motion as internal_motion
    from taskopt.kinematics.analysis.redundancy import subspaces as subspaces
    from taskopt.kinematics.analysis.singularity import Singularity as Singularity
    from taskopt.kinematics.analysis.singularity import classify_singularity as classify_singularity
    from taskopt.kinematics.analysis.singularity import decouple as decouple
    from taskopt.kinematics.analysis.singularity import find_singularity as find_singularity
    from taskopt.kinematics.analysis.singularity import workspace_map as workspace_map
    from taskopt.kinematics.analysis.statics import force_transform as force_transform
    from taskopt.kinematics.analysis.statics import joint_torques as joint_torques
    from taskopt.kinematics.analysis.statics import velocity_transform as velocity_transform
    from taskopt.kinematics.configuration import Configuration as Configuration
    from taskopt.kinematics.geometry import Box as Box
    from taskopt.kinematics.geometry import Capsule as Capsule
    from taskopt.kinematics.geometry import HalfSpace as HalfSpace
    from taskopt.kinematics.geometry import Sphere as Sphere
    from taskopt.kinematics.limit import BoundLimit as BoundLimit
    from taskopt.kinematics.limit import FloatingBaseVelocityLimit as FloatingBaseVelocityLimit
    from taskopt.kinematics.limit import FrameDistanceLimit as FrameDistanceLimit
    from taskopt.kinematics.limit import FrameVelocityLimit as FrameVelocityLimit
    from taskopt.kinematics.limit import JointAccelerationLimit as JointAccelerationLimit
    from taskopt.kinematics.limit import JointPositionLimit as JointPositionLimit
    from taskopt.kinematics.limit import JointVelocityLimit as JointVelocityLimit
    from taskopt.kinematics.limit import Limit as Limit
    from taskopt.kinematics.limit import ObstacleLimit as ObstacleLimit
    from taskopt.kinematics.limit import RateLimit as RateLimit
    from taskopt.kinematics.limit import RowLimit as RowLimit
    from taskopt.kinematics.limit import SelfCollisionLimit as SelfCollisionLimit
    from taskopt.kinematics.limit import SupportPolygonLimit as SupportPolygonLimit
    from taskopt.kinematics.lockstep.frames import frame_jacobians as frame_jacobians
    from taskopt.kinematics.lockstep.frames import frame_poses as frame_poses
    from taskopt.kinematics.objective import ForceRatio as ForceRatio
    from taskopt.kinematics.objective import JointRange as JointRange
    from taskopt.kinematics.objective import Manipulability as Manipulability
    from taskopt.kinematics.objective import Objective as Objective
    from taskopt.kinematics.objective import ObstacleDistance as ObstacleDistance
    from taskopt.kinematics.objective import SelfDistance as SelfDistance
    from taskopt.kinematics.objective import UserFunction as UserFunction
    from taskopt.kinematics.objective import VelocityRatio as VelocityRatio
    from taskopt.kinematics.orientation import RPY as RPY
    from taskopt.kinematics.orientation import ZYZ as ZYZ
    from taskopt.kinematics.orientation import EulerAngles as EulerAngles
    from taskopt.kinematics.robot import Coupling as Coupling
    from taskopt.kinematics.robot import DHRow as DHRow
    from taskopt.kinematics.robot import Robot as Robot
    from taskopt.kinematics.robot import anthropomorphic_arm as anthropomorphic_arm
    from taskopt.kinematics.robot import anthropomorphic_with_wrist as anthropomorphic_with_wrist
    from taskopt.kinematics.robot import cylindrical_arm as cylindrical_arm
    from taskopt.kinematics.robot import four_bar as four_bar
    from taskopt.kinematics.robot import parallelogram_arm as parallelogram_arm
    from taskopt.kinematics.robot import planar_arm as planar_arm
    from taskopt.kinematics.robot import robot_names as robot_names
    from taskopt.kinematics.robot import scara as scara
    from taskopt.kinematics.robot import seven_joint_arm as seven_joint_arm
    from taskopt.kinematics.robot import spherical_arm as spherical_arm
    from taskopt.kinematics.robot import spherical_wrist as spherical_wrist
    from taskopt.kinematics.robot import stanford_manipulator as stanford_manipulator
    from taskopt.kinematics.stack import Plan as Plan
    from taskopt.kinematics.stack import Stack as Stack
    from taskopt.kinematics.target import Circle as Circle
    from taskopt.kinematics.target import Function as Function
    from taskopt.kinematics.target import Hold as Hold
    from taskopt.kinematics.target import Latest as Latest
    from taskopt.kinematics.target import Line as Line
    from taskopt.kinematics.target import Target as Target
    from taskopt.kinematics.target import WithoutRate as WithoutRate
    from taskopt.kinematics.task import AngleAxisTask as AngleAxisTask
    from taskopt.kinematics.task import AxisAlignmentTask as AxisAlignmentTask
    from taskopt.kinematics.task import BoundTask as BoundTask
    from taskopt.kinematics.task import BoxTask as BoxTask
    from taskopt.kinematics.task import CentreOfMassTask as CentreOfMassTask
    from taskopt.kinematics.task import DampedTask as DampedTask
    from taskopt.kinematics.task import DampingTask as DampingTask
    from taskopt.kinematics.task import During as During
    from taskopt.kinematics.task import EulerTask as EulerTask
    from taskopt.kinematics.task import FrameTask as FrameTask
    from taskopt.kinematics.task import GazeTask as GazeTask
    from taskopt.kinematics.task import GradientTask as GradientTask
    from taskopt.kinematics.task import JointCouplingTask as JointCouplingTask
    from taskopt.kinematics.task import JointTask as JointTask
    from taskopt.kinematics.task import JointVelocityTask as JointVelocityTask
    from taskopt.kinematics.task import KineticEnergyTask as KineticEnergyTask
    from taskopt.kinematics.task import LevelDamping as LevelDamping
    from taskopt.kinematics.task import LinearHolonomicTask as LinearHolonomicTask
    from taskopt.kinematics.task import LookAtTask as LookAtTask
    from taskopt.kinematics.task import LoopTask as LoopTask
    from taskopt.kinematics.task import LowAccelerationTask as LowAccelerationTask
    from taskopt.kinematics.task import ObjectiveTask as ObjectiveTask
    from taskopt.kinematics.task import OmniwheelTask as OmniwheelTask
    from taskopt.kinematics.task import OrientationTask as OrientationTask
    from taskopt.kinematics.task import PositionTask as PositionTask
    from taskopt.kinematics.task import QuaternionTask as QuaternionTask
    from taskopt.kinematics.task import RelativeFrameTask as RelativeFrameTask
    from taskopt.kinematics.task import RollingTask as RollingTask
    from taskopt.kinematics.task import SupportPolygonTask as SupportPolygonTask
    from taskopt.kinematics.task import Task as Task
    from taskopt.kinematics.task.transition import largest_jump as largest_jump
    from taskopt.kinematics.task.transition import swap as swap
    from taskopt.log.again import Again as Again
    from taskopt.log.again import solve_again as solve_again
    from taskopt.log.reading import Log as Log
    from taskopt.log.reading import LogEnd as LogEnd
    from taskopt.log.reading import open_log as open_log
    from taskopt.log.ticks import LoggedTick as LoggedTick
    from taskopt.loop.batch.controller import BatchController as BatchController
    from taskopt.loop.batch.step import BatchStep as BatchStep
    from taskopt.loop.controller import Controller as Controller
    from taskopt.loop.pose.solution import GoalError as GoalError
    from taskopt.loop.pose.solution import PoseSolution as PoseSolution
    from taskopt.loop.pose.solution import Verdict as Verdict
    from taskopt.loop.pose.solver import PoseSolver as PoseSolver
    from taskopt.loop.pose.solver import solve_pose as solve_pose
    from taskopt.loop.run import Step as Step
    from taskopt.loop.run import run as run
    from taskopt.loop.scenario import Scenario as Scenario
    from taskopt.loop.scenario import load_scenario as load_scenario
    from taskopt.resolver.active_set.resolver import ActiveSet as ActiveSet
    from taskopt.resolver.base import Memory as Memory
    from taskopt.resolver.base import Resolver as Resolver
    from taskopt.resolver.closed_form_resolvers import DampedLeastSquares as DampedLeastSquares
    from taskopt.resolver.closed_form_resolvers import PseudoInverse as PseudoInverse
    from taskopt.resolver.cvxpy_model import CvxpyModel as CvxpyModel
    from taskopt.resolver.fallback import ActiveSetWithFallback as ActiveSetWithFallback
    from taskopt.resolver.hqp import HierarchicalQP as HierarchicalQP
    from taskopt.resolver.infeasible import Conflict as Conflict
    from taskopt.resolver.infeasible import ConflictPolicy as ConflictPolicy
    from taskopt.resolver.infeasible import Side as Side
    from taskopt.resolver.infeasible import find_conflict as find_conflict
    from taskopt.resolver.registry import register_resolver as register_resolver
    from taskopt.resolver.registry import resolve as resolve
    from taskopt.resolver.registry import resolver_names as resolver_names
    from taskopt.resolver.regret import regret as regret
    from taskopt.resolver.transpose import Transpose as Transpose
    from taskopt.resolver.transpose import largest_gain as largest_gain
    from taskopt.resolver.weighted import WeightedQP as WeightedQP
    from taskopt.solver.base import Solve as Solve
    from taskopt.solver.registry import Solver as Solver
    from taskopt.solver.registry import register_solver as register_solver
    from taskopt.solver.registry import solvers as solvers

_NAMES = {  # module: the names that live there
    "taskopt.arrays": "Array",
    "taskopt.compare": "Comparison",
    "taskopt.errors": (
        "BadLog DroppedWarning Infeasible InvalidValue LogFailed MissingFile NotInstalled NotSolved "
        "TaskoptError UnknownName"
    ),
    "taskopt.hierarchy.active": "Active",
    "taskopt.hierarchy.alternation": "Alternation alternations",
    "taskopt.hierarchy.certificate": "Certificate certify",
    "taskopt.hierarchy.damping": (
        "Chiaverini ConstantDamping Damping NakamuraHanafusa NoDamping NumericalFiltering RestDamping "
        "Sugihara"
    ),
    "taskopt.hierarchy.layout": "Block Layout",
    "taskopt.hierarchy.multipliers": "certify_velocity",
    "taskopt.hierarchy.problem": "Hierarchy Level LevelRows",
    "taskopt.hierarchy.qp": "QuadraticProgram Solution",
    "taskopt.hierarchy.rank": "RankRule",
    "taskopt.hierarchy.resolution": "Resolution",
    "taskopt.hierarchy.review": "Cause LevelAccount Review",
    "taskopt.hierarchy.status": "Status",
    "taskopt.kinematics.analysis.closed_chain": "loop_jacobian transmission",
    "taskopt.kinematics.analysis.ellipsoid": "Ellipsoid force_ellipsoid velocity_ellipsoid",
    "taskopt.kinematics.analysis.jacobians": (
        "analytical_jacobian analytical_jacobian_rate geometric_jacobian geometric_jacobian_rate"
    ),
    "taskopt.kinematics.analysis.redundancy": "internal_motion Subspaces subspaces",
    "taskopt.kinematics.analysis.singularity": (
        "classify_singularity decouple find_singularity Singularity workspace_map"
    ),
    "taskopt.kinematics.analysis.statics": "force_transform joint_torques velocity_transform",
    "taskopt.kinematics.configuration": "Configuration",
    "taskopt.kinematics.geometry": "Box Capsule HalfSpace Sphere",
    "taskopt.kinematics.limit": (
        "BoundLimit FloatingBaseVelocityLimit FrameDistanceLimit FrameVelocityLimit JointAccelerationLimit "
        "JointPositionLimit JointVelocityLimit Limit ObstacleLimit RateLimit RowLimit SelfCollisionLimit "
        "SupportPolygonLimit"
    ),
    "taskopt.kinematics.lockstep.frames": "frame_jacobians frame_poses",
    "taskopt.kinematics.objective": (
        "ForceRatio JointRange Manipulability Objective ObstacleDistance SelfDistance UserFunction "
        "VelocityRatio"
    ),
    "taskopt.kinematics.orientation": "EulerAngles RPY ZYZ",
    "taskopt.kinematics.robot": (
        "anthropomorphic_arm anthropomorphic_with_wrist Coupling cylindrical_arm DHRow four_bar "
        "parallelogram_arm planar_arm Robot robot_names scara seven_joint_arm spherical_arm spherical_wrist "
        "stanford_manipulator"
    ),
    "taskopt.kinematics.stack": "Plan Stack",
    "taskopt.kinematics.target": "Circle Function Hold Latest Line Target WithoutRate",
    "taskopt.kinematics.task": (
        "AngleAxisTask AxisAlignmentTask BoundTask BoxTask CentreOfMassTask DampedTask DampingTask During "
        "EulerTask FrameTask GazeTask GradientTask JointCouplingTask JointTask JointVelocityTask "
        "KineticEnergyTask LevelDamping LinearHolonomicTask LookAtTask LoopTask LowAccelerationTask "
        "ObjectiveTask OmniwheelTask OrientationTask PositionTask QuaternionTask RelativeFrameTask "
        "RollingTask SupportPolygonTask Task"
    ),
    "taskopt.kinematics.task.transition": "largest_jump swap",
    "taskopt.log.again": "Again solve_again",
    "taskopt.log.reading": "Log LogEnd open_log",
    "taskopt.log.ticks": "LoggedTick",
    "taskopt.loop.batch.controller": "BatchController",
    "taskopt.loop.batch.step": "BatchStep",
    "taskopt.loop.controller": "Controller",
    "taskopt.loop.pose.solution": "GoalError PoseSolution Verdict",
    "taskopt.loop.pose.solver": "PoseSolver solve_pose",
    "taskopt.loop.run": "run Step",
    "taskopt.loop.scenario": "load_scenario Scenario",
    "taskopt.resolver.active_set.resolver": "ActiveSet",
    "taskopt.resolver.base": "Memory Resolver",
    "taskopt.resolver.closed_form_resolvers": "DampedLeastSquares PseudoInverse",
    "taskopt.resolver.cvxpy_model": "CvxpyModel",
    "taskopt.resolver.fallback": "ActiveSetWithFallback",
    "taskopt.resolver.hqp": "HierarchicalQP",
    "taskopt.resolver.infeasible": "Conflict ConflictPolicy find_conflict Side",
    "taskopt.resolver.registry": "register_resolver resolve resolver_names",
    "taskopt.resolver.regret": "regret",
    "taskopt.resolver.transpose": "largest_gain Transpose",
    "taskopt.resolver.weighted": "WeightedQP",
    "taskopt.solver.base": "Solve",
    "taskopt.solver.registry": "register_solver Solver solvers",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def _imported(name: str) -> object:
    """Import a public name at its first use.

    Raises:
        AttributeError: There is no such name; the message suggests a similar one, or names the module that
            defines it. A `from taskopt import` raises `ImportError` with the same message.
        ImportError: The module of the name cannot be imported.
    """
    if name.startswith("_"):
        raise AttributeError(f"module 'taskopt' has no attribute '{name}'")
    if name not in _HOME:
        refuse = ImportError if _is_import_statement() and not is_module(name) else AttributeError
        raise refuse(f"taskopt has no name '{name}'; {way_out(name, __all__)}")
    try:
        module = import_module(_HOME[name])
    except AttributeError as error:  # an AttributeError raised here would read as "there is no such name"
        raise ImportError(f"{_HOME[name]}, which has '{name}', cannot be imported: {error}") from error
    value = globals()[name] = getattr(module, name)
    return value


if not TYPE_CHECKING:  # checkers know the names from the imports above, and refuse others
    __getattr__ = _imported


def __dir__() -> list[str]:
    """Return the public names in alphabetical order."""
    return sorted(__all__)


def _is_import_statement() -> bool:
    """Return True if the name is used in `from taskopt import`, which hides an `AttributeError`."""
    return sys._getframe(2).f_code.co_name == "_handle_fromlist"
