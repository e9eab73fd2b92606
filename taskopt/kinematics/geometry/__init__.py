"""Solid shapes: `shapes` declares obstacles by plain numbers, and `coal` makes shapes of Coal."""

from taskopt.kinematics.geometry.shapes import Box as Box
from taskopt.kinematics.geometry.shapes import Capsule as Capsule
from taskopt.kinematics.geometry.shapes import HalfSpace as HalfSpace
from taskopt.kinematics.geometry.shapes import Shape as Shape
from taskopt.kinematics.geometry.shapes import Sphere as Sphere
from taskopt.kinematics.geometry.shapes import obstacle_names as obstacle_names
