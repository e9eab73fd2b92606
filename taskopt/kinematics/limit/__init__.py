"""Limits: bounds that hold at every tick, whatever the tasks ask for."""

from taskopt.kinematics.limit.acceleration import JointAccelerationLimit as JointAccelerationLimit
from taskopt.kinematics.limit.base import BoundLimit as BoundLimit
from taskopt.kinematics.limit.base import Limit as Limit
from taskopt.kinematics.limit.base import RateLimit as RateLimit
from taskopt.kinematics.limit.base import RowLimit as RowLimit
from taskopt.kinematics.limit.distance import ObstacleLimit as ObstacleLimit
from taskopt.kinematics.limit.distance import SelfCollisionLimit as SelfCollisionLimit
from taskopt.kinematics.limit.frame_distance import FrameDistanceLimit as FrameDistanceLimit
from taskopt.kinematics.limit.frame_velocity import FloatingBaseVelocityLimit as FloatingBaseVelocityLimit
from taskopt.kinematics.limit.frame_velocity import FrameVelocityLimit as FrameVelocityLimit
from taskopt.kinematics.limit.joint import JointPositionLimit as JointPositionLimit
from taskopt.kinematics.limit.joint import JointVelocityLimit as JointVelocityLimit
from taskopt.kinematics.limit.support import SupportPolygonLimit as SupportPolygonLimit
