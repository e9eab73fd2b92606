"""Redundancy resolution of robots by optimisation: strict task stacks, certified and recorded.

Every name that a user needs is here. Each is imported at its first use, so that `taskopt --help` does not
import Pinocchio and Numba, and a program that only uses hierarchies of plain arrays does not import robots.
Type checkers read the names in `__init__.pyi`.
"""

import sys
from importlib import import_module

from taskopt.synonyms import is_module, way_out

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
    "taskopt.log.own_loop": "HierarchyLog record",
    "taskopt.log.reading": "Log LogEnd open_log",
    "taskopt.log.ticks": "LoggedTick",
    "taskopt.loop.batch.controller": "BatchController",
    "taskopt.loop.batch.reach": "reach_map ReachMap",
    "taskopt.loop.batch.step": "BatchStep",
    "taskopt.loop.controller": "Controller",
    "taskopt.loop.onward": "LogStart",
    "taskopt.loop.pose.solution": "GoalError PoseSolution Verdict",
    "taskopt.loop.pose.solver": "PoseSolver solve_pose",
    "taskopt.loop.run": "run Step",
    "taskopt.loop.scenario": "load_scenario Scenario",
    "taskopt.recording.viewer.reach": "record_reach_map",
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


__getattr__ = _imported


def __dir__() -> list[str]:
    """Return the public names in alphabetical order."""
    return sorted(__all__)


def _is_import_statement() -> bool:
    """Return True if the name is used in `from taskopt import`, which hides an `AttributeError`."""
    return sys._getframe(2).f_code.co_name == "_handle_fromlist"
