"""Robots: from URDF files, by name, from Denavit–Hartenberg rows, or from an existing pin.Model."""

from taskopt.robot.dh import DHRow as DHRow
from taskopt.robot.named import robot_names as robot_names
from taskopt.robot.robot import Robot as Robot
from taskopt.robot.textbook import planar_arm as planar_arm
