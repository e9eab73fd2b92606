"""The forms in which a pose may be written: a matrix, a pose object, or a position with a quaternion."""

from typing import Protocol, runtime_checkable

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import UNIT_NORM
from taskopt.kinematics.orientation.quaternion import rotation_of
from taskopt.kinematics.pose import checked_pose

FORMS = (
    "a pose (4×4 or pin.SE3), a position (3), a rotation (3×3), a pair (position, quaternion x y z w), "
    "or its seven numbers (x, y, z, qx, qy, qz, qw)"
)


@runtime_checkable
class Homogeneous(Protocol):
    """A pose object that has its homogeneous matrix, such as `pin.SE3`."""

    @property
    def homogeneous(self) -> Array:
        """The pose (4, 4), translation in [m]."""
        ...


def is_pair(value: object) -> bool:
    """Return True if a value is a pair of a position and a quaternion.

    Args:
        value: The value that a user gave.

    Returns:
        True for a tuple or list of three numbers and four numbers.
    """
    return isinstance(value, tuple | list) and [np.size(part) for part in value] == [3, 4]


def as_pose(name: str, value: object, start: Array) -> Array:
    """Read a pose in any of its forms.

    A quaternion is (x, y, z, w), with the real part last, as in ROS and Pinocchio.

    Args:
        name: Name of the value in messages.
        value: A pose (4, 4), an object with such a matrix, a position (3,) [m], a rotation (3, 3), a pair of
            position (3,) and quaternion (4,), or both in one array (7,).
        start: Pose (4, 4) from which the position or rotation is taken if the value does not state it.

    Returns:
        A new pose (4, 4).

    Raises:
        InvalidValue: The value has none of these forms, or its rotation or quaternion is invalid.
    """
    if isinstance(value, Homogeneous):
        return checked_pose(name, value.homogeneous)
    if isinstance(value, tuple | list) and is_pair(value):
        value = np.concatenate([np.ravel(part) for part in value])
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValue(f"{name} must be {FORMS}, got {value!r}") from None
    pose = start.copy()
    if array.shape == (4, 4):
        pose[:] = array
    elif array.shape == (3, 3):
        pose[:3, :3] = array
    elif array.shape == (3,):
        pose[:3, 3] = array
    elif array.shape == (7,):
        pose[:3, 3], pose[:3, :3] = array[:3], _rotation(name, array[3:])
    else:
        shape = "×".join(map(str, array.shape)) or repr(value)
        raise InvalidValue(f"{name} must be {FORMS}, got {shape}")
    return checked_pose(name, pose)


def _rotation(name: str, xyzw: ArrayLike) -> Array:
    """Return the rotation of a quaternion (x, y, z, w); raise `InvalidValue` if its norm is not 1."""
    x, y, z, w = finite(f"quaternion of {name}", xyzw, (4,))
    norm = float(np.sqrt(x * x + y * y + z * z + w * w))
    if abs(norm - 1.0) > UNIT_NORM:
        raise InvalidValue(
            f"the quaternion (x, y, z, w) of {name} must have norm 1, got {norm:g}; normalise it"
        )
    return rotation_of(np.array([w, x, y, z]) / norm)
