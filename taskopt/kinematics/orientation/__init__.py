"""Orientation: the operator S(ω), Euler angles, angle and axis, unit quaternions, and their errors.

Rotation matrices R = [n s a] are (3, 3) and map coordinates in the frame to coordinates in the world. Angular
velocities are in [rad/s] along the axes of the world. The rotation vector, which the tasks of a frame use, is
in `taskopt.kinematics.pose`.
"""

from taskopt.kinematics.orientation.angle_axis import angle_axis as angle_axis
from taskopt.kinematics.orientation.angle_axis import angle_axis_error as angle_axis_error
from taskopt.kinematics.orientation.angle_axis import error_rate_matrix as error_rate_matrix
from taskopt.kinematics.orientation.euler import RPY as RPY
from taskopt.kinematics.orientation.euler import XYZ as XYZ
from taskopt.kinematics.orientation.euler import ZYZ as ZYZ
from taskopt.kinematics.orientation.euler import EulerAngles as EulerAngles
from taskopt.kinematics.orientation.quaternion import quaternion as quaternion
from taskopt.kinematics.orientation.quaternion import quaternion_error as quaternion_error
from taskopt.kinematics.orientation.quaternion import quaternion_product as quaternion_product
from taskopt.kinematics.orientation.quaternion import quaternion_rate as quaternion_rate
from taskopt.kinematics.orientation.skew import skew as skew
from taskopt.kinematics.orientation.skew import unskew as unskew
