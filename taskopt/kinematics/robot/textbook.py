"""The arms of the textbook as robots; `taskopt.kinematics.robot.arms` describes each with its arguments."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

from taskopt.kinematics.robot import arms
from taskopt.kinematics.robot.parts import Parts
from taskopt.kinematics.robot.robot import Robot

_Arguments = ParamSpec("_Arguments")


def _robot(build: Callable[_Arguments, Parts]) -> Callable[_Arguments, Robot]:
    """Return a function with the same arguments that makes a robot of the parts."""

    @wraps(build)
    def made(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> Robot:
        return Robot.from_parts(build(*arguments, **named))

    return made


planar_arm = _robot(arms.planar_arm)
parallelogram_arm = _robot(arms.parallelogram_arm)
four_bar = _robot(arms.four_bar)
spherical_arm = _robot(arms.spherical_arm)
cylindrical_arm = _robot(arms.cylindrical_arm)
scara = _robot(arms.scara)
anthropomorphic_arm = _robot(arms.anthropomorphic_arm)
spherical_wrist = _robot(arms.spherical_wrist)
stanford_manipulator = _robot(arms.stanford_manipulator)
anthropomorphic_with_wrist = _robot(arms.anthropomorphic_with_wrist)
seven_joint_arm = _robot(arms.seven_joint_arm)
