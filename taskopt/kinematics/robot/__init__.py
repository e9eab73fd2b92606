"""Robots from URDF, by name, from Denavit–Hartenberg rows, from a pin.Model; obstacles in their way."""

from taskopt.kinematics.collision.shapes import Box as Box
from taskopt.kinematics.collision.shapes import Capsule as Capsule
from taskopt.kinematics.collision.shapes import HalfSpace as HalfSpace
from taskopt.kinematics.collision.shapes import Sphere as Sphere
from taskopt.kinematics.robot.dh import DHRow as DHRow
from taskopt.kinematics.robot.named import robot_names as robot_names
from taskopt.kinematics.robot.robot import Robot as Robot
from taskopt.kinematics.robot.textbook import planar_arm as planar_arm
