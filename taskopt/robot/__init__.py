"""Robots from URDF, by name, from Denavit–Hartenberg rows, from a pin.Model; obstacles in their way."""

from taskopt.robot.dh import DHRow as DHRow
from taskopt.robot.named import robot_names as robot_names
from taskopt.robot.robot import Robot as Robot
from taskopt.robot.shapes import Box as Box
from taskopt.robot.shapes import Capsule as Capsule
from taskopt.robot.shapes import HalfSpace as HalfSpace
from taskopt.robot.shapes import Sphere as Sphere
from taskopt.robot.textbook import planar_arm as planar_arm
