"""Robots: read from URDF files or by name, or made of Denavit–Hartenberg rows or a `pin.Model`."""

from taskopt.kinematics.robot.couplings import Coupling as Coupling
from taskopt.kinematics.robot.dh import DHRow as DHRow
from taskopt.kinematics.robot.named import robot_names as robot_names
from taskopt.kinematics.robot.robot import Robot as Robot
from taskopt.kinematics.robot.textbook import anthropomorphic_arm as anthropomorphic_arm
from taskopt.kinematics.robot.textbook import anthropomorphic_with_wrist as anthropomorphic_with_wrist
from taskopt.kinematics.robot.textbook import cylindrical_arm as cylindrical_arm
from taskopt.kinematics.robot.textbook import four_bar as four_bar
from taskopt.kinematics.robot.textbook import parallelogram_arm as parallelogram_arm
from taskopt.kinematics.robot.textbook import planar_arm as planar_arm
from taskopt.kinematics.robot.textbook import scara as scara
from taskopt.kinematics.robot.textbook import seven_joint_arm as seven_joint_arm
from taskopt.kinematics.robot.textbook import spherical_arm as spherical_arm
from taskopt.kinematics.robot.textbook import spherical_wrist as spherical_wrist
from taskopt.kinematics.robot.textbook import stanford_manipulator as stanford_manipulator
