"""Objectives: what a secondary goal climbs, with value and gradient."""

from taskopt.kinematics.objective.base import Objective as Objective
from taskopt.kinematics.objective.function import UserFunction as UserFunction
from taskopt.kinematics.objective.joint_range import JointRange as JointRange
from taskopt.kinematics.objective.manipulability import Manipulability as Manipulability
from taskopt.kinematics.objective.obstacle_distance import ObstacleDistance as ObstacleDistance
from taskopt.kinematics.objective.self_distance import SelfDistance as SelfDistance
