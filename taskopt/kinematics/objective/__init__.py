"""Objectives: functions w(q) with value and gradient, which secondary goals climb."""

from taskopt.kinematics.objective.base import Objective as Objective
from taskopt.kinematics.objective.distance import ObstacleDistance as ObstacleDistance
from taskopt.kinematics.objective.distance import SelfDistance as SelfDistance
from taskopt.kinematics.objective.function import UserFunction as UserFunction
from taskopt.kinematics.objective.joint_range import JointRange as JointRange
from taskopt.kinematics.objective.manipulability import Manipulability as Manipulability
from taskopt.kinematics.objective.ratio import ForceRatio as ForceRatio
from taskopt.kinematics.objective.ratio import VelocityRatio as VelocityRatio
