"""Robots from URDF files, by name, from Denavit–Hartenberg rows, or from a `pin.Model`."""

from taskopt.kinematics.robot.dh import DHRow as DHRow
from taskopt.kinematics.robot.named import robot_names as robot_names
from taskopt.kinematics.robot.robot import Robot as Robot
from taskopt.kinematics.robot.textbook import planar_arm as planar_arm
