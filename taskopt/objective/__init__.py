"""Objectives: what a secondary goal climbs, with value and gradient."""

from taskopt.objective.base import Objective as Objective
from taskopt.objective.function import UserFunction as UserFunction
from taskopt.objective.joint_range import JointRange as JointRange
from taskopt.objective.manipulability import Manipulability as Manipulability
from taskopt.objective.obstacle_distance import ObstacleDistance as ObstacleDistance
from taskopt.objective.self_distance import SelfDistance as SelfDistance
