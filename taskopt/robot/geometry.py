"""Shapes of links made in code. The one door to Coal."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from taskopt.arrays import Array
from taskopt.pose import homogeneous

_LINK_COLOUR = np.array([0.35, 0.55, 0.85, 1.0])


def add_capsule(
    shapes: Any,
    name: str,
    joint: int,
    start: Sequence[float] | Array,
    stop: Sequence[float] | Array,
    radius: float,
) -> None:
    """Add a capsule around the segment from `start` to `stop` [m] in the frame of a joint."""
    a, b = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    length = float(np.linalg.norm(b - a))
    placement = homogeneous(_turning_z_to(b - a, length), 0.5 * (a + b))
    shape = pin.GeometryObject(name, joint, pin.SE3(placement), coal.Capsule(radius, length))
    shape.meshColor = _LINK_COLOUR
    shapes.addGeometryObject(shape)


def _turning_z_to(direction: Array, length: float) -> Array:
    """A rotation (3, 3) whose third column is the direction; a capsule lies along its own z."""
    if length == 0.0:
        return np.eye(3)
    z = direction / length
    out = np.empty((3, 3))
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    out[:, 0] = x / np.linalg.norm(x)
    out[:, 1] = np.cross(z, out[:, 0])
    out[:, 2] = z
    return out
