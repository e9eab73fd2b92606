"""Limits: what holds whatever the tasks want."""

from taskopt.limit.base import BoundLimit as BoundLimit
from taskopt.limit.base import Limit as Limit
from taskopt.limit.base import RateLimit as RateLimit
from taskopt.limit.base import RowLimit as RowLimit
from taskopt.limit.joint_acceleration import JointAccelerationLimit as JointAccelerationLimit
from taskopt.limit.joint_position import JointPositionLimit as JointPositionLimit
from taskopt.limit.joint_velocity import JointVelocityLimit as JointVelocityLimit
from taskopt.limit.obstacle import ObstacleLimit as ObstacleLimit
from taskopt.limit.self_collision import SelfCollisionLimit as SelfCollisionLimit
