"""Spaces of the values of targets: poses of a frame, and postures of a robot.

A space converts a user's value to one kind of array, and has the two operations that a path needs:
`difference(a, b)`, the constant rate that leads from a to b in unit time, and `move(a, delta, out)`, its
inverse. Every target is written with these operations only, and so works in both spaces. `chosen_rows` reads
the choice of rows in a task.
"""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from typing_extensions import TypeAliasType

from taskopt.arrays import Array, ArrayLike, IntArray, finite
from taskopt.errors import InvalidValue, UnknownName
from taskopt.jit import kernel
from taskopt.kinematics.lie import exp3_into, log3_into
from taskopt.kinematics.orientation.pose_forms import Homogeneous, as_pose, is_pair
from taskopt.kinematics.robot import Robot

ROW_NAMES = ("x", "y", "z", "rx", "ry", "rz")
ROW_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")
SCALAR, CIRCLE, OTHER = 0, 1, -1  # kinds of coordinate: one number; (cos, sin); part of a larger joint

_FLOAT64 = np.dtype(np.float64)  # there is but one, and `is` is faster than ==


Value = TypeAliasType("Value", ArrayLike | Homogeneous | Mapping[str, float])
"""The forms in which a user may write a pose or a posture; each space says which it accepts."""


def plain(value: Value) -> ArrayLike | Mapping[str, float]:
    """Replace a pose object, or a pair of position and quaternion, by its homogeneous matrix.

    Args:
        value: An array, numbers, a mapping from joint to number, an object such as `pin.SE3`, or a pair.

    Returns:
        The matrix (4, 4) of a pose object or a pair; anything else as it is.

    Raises:
        InvalidValue: The quaternion of a pair does not have norm 1.
    """
    if isinstance(value, np.ndarray):  # first, because the check of a protocol is slow
        return value
    if is_pair(value):
        return as_pose("the pose", value, np.eye(4))
    return value.homogeneous if isinstance(value, Homogeneous) else value


class Space(Protocol):
    """A space of values of one kind, such as poses or postures.

    Attributes:
        tangent: Number of entries of a rate.
    """

    tangent: int

    def convert(self, value: Value, start: Array) -> Array:
        """Convert a user's value to a checked array of this space.

        Args:
            value: The value; the classes say which forms they take.
            start: Value at the start of the run, which supplies the parts that `value` does not state.

        Returns:
            A new array.

        Raises:
            InvalidValue: The value is of no accepted form, or not finite.
        """
        ...

    def take(self, value: Value, start: Array, out: Array) -> None:
        """Convert a value and write it into an existing array, as each tick does.

        An array that already has the form of this space may be copied without checks, which would cost more
        than the copy; every other form goes through `convert`.

        Args:
            value: The value. Where it is copied without checks, the plan checks the pose later.
            start: Value at the start of the run.
            out: Receives the value.

        Raises:
            InvalidValue: The value is of no accepted form.
        """
        ...

    def convert_rate(self, rate: Value) -> Array:
        """Convert a user's rate to a checked tangent vector.

        Args:
            rate: The rate; the classes say which forms they take.

        Returns:
            (tangent,) new array.

        Raises:
            InvalidValue: The rate is of no accepted form, or not finite.
        """
        ...

    def take_rate(self, rate: Value, out: Array) -> None:
        """Convert a rate and write it into an existing array, as each tick does.

        An array (tangent,) is copied as it is, since checking it would cost more than the copy; every other
        form goes through `convert_rate`.

        Args:
            rate: The rate. Where it is copied without checks, the plan checks later that it is finite.
            out: (tangent,) receives the rate.

        Raises:
            InvalidValue: The rate is of no accepted form.
        """
        ...

    def difference(self, a: Array, b: Array) -> Array:
        """Compute the constant rate that leads from one value to another in unit time.

        Args:
            a: Value to begin at.
            b: Value to end at.

        Returns:
            (tangent,) new array.
        """
        ...

    def move(self, a: Array, delta: Array, out: Array) -> None:
        """Write the value to which a constant rate leads in unit time.

        Args:
            a: Value to begin at.
            delta: (tangent,) rate.
            out: Receives the value at the end.
        """
        ...


class PoseSpace:
    """Poses (4, 4) of a frame in the world, translation in [m].

    Rates are (6,): linear velocity of the origin [m/s], then angular velocity [rad/s], both along the axes
    of the WORLD. A value may be a pose (a `pin.SE3`, an array (4, 4), a pair of position and quaternion, or
    their seven numbers), a position (3,), or a rotation (3, 3), see `as_pose`; the part that is not given
    stays that of the start. A rate may be (6,), or (3,): linear, or
    angular if the space was made with `angular`.
    """

    tangent = 6

    def __init__(self, name: str, *, angular: bool = False) -> None:
        """Make the space of a frame.

        Args:
            name: Name of a value in error messages.
            angular: True if rates (3,) are angular velocities, False if they are linear velocities.
        """
        self._name, self._angular = name, angular

    def convert(self, value: Value, start: Array) -> Array:
        """Turn a pose, a position or a rotation into a checked pose (4, 4), see `Space.convert`.

        Raises:
            InvalidValue: The value has another shape, is not finite, or its rotation is not a rotation
                matrix.
        """
        return as_pose(self._name, value, start)

    def take(self, value: Value, start: Array, out: Array) -> None:
        """Write a value into `out` (4, 4); an array (4, 4) of floats is not checked. See `Space.take`."""
        if isinstance(value, np.ndarray) and value.shape == (4, 4) and value.dtype is _FLOAT64:
            out[...] = value
        else:
            out[...] = self.convert(value, start)

    def convert_rate(self, rate: Value) -> Array:
        """Convert a rate (6,) or (3,) to a checked rate (6,) along the axes of the world."""
        array = np.asarray(rate)
        if array.shape == (6,):
            return finite(f"rate of {self._name}", array, (6,))
        part = finite(f"rate of {self._name}", array, (3,))
        return np.concatenate([np.zeros(3), part] if self._angular else [part, np.zeros(3)])

    def take_rate(self, rate: Value, out: Array) -> None:
        """Write a rate (6,) or (3,) into `out` (6,); an array (6,) is not checked. See `Space.take_rate`."""
        if isinstance(rate, np.ndarray) and rate.shape == (6,):
            out[...] = rate
        else:
            out[...] = self.convert_rate(rate)

    def difference(self, a: Array, b: Array) -> Array:
        """Compute [p_b − p_a; log(R_b R_aᵀ)] (6,) from two poses, along the axes of the world."""
        out = np.empty(6)
        _difference_into(a, b, out)
        return out

    def move(self, a: Array, delta: Array, out: Array) -> None:
        """Write the pose (4, 4) with p + δp and exp(δω) R, for a rate (δp, δω) in the axes of the world."""
        _move_into(a, delta, out)


class PostureSpace:
    """Postures (nq,) [rad, m] of a robot; rates are joint velocities (nv,) [rad/s, m/s].

    A value may be a whole posture (nq,), one number for each of `joints`, or a mapping from joint to number;
    joints that are not named stay where they are at the start. A rate may be (nv,), one number for each of
    `joints`, or a mapping; joints that are not named have rate zero. Differences and moves are those of the
    configuration manifold.

    Attributes:
        joints: Names of the joints of the task, in the order in which numbers are given.
    """

    def __init__(self, name: str, robot: Robot, joints: Sequence[str]) -> None:
        """Make the space of some joints of a robot.

        Args:
            name: Name of a value in error messages.
            robot: The robot.
            joints: Names of the joints.
        """
        self._name, self._robot, self.joints = name, robot, tuple(joints)
        self.tangent = robot.nv
        self._table = coordinate_table(robot)

    def convert(self, value: Value, start: Array) -> Array:
        """Convert a posture, or numbers of joints, to a checked posture (nq,); see `Space.convert`."""
        value = plain(value)
        whole = self._whole(value, self._robot.nq)
        if whole is not None:
            return self._robot.checked_q(whole)
        q = start.copy()
        for joint, number in self._by_joint(value, self._robot.nq).items():
            kind, iq = self._table[self._column(joint)]
            if kind == SCALAR:
                q[iq] = number
            else:
                q[iq : iq + 2] = np.cos(number), np.sin(number)
        return q

    def take(self, value: Value, start: Array, out: Array) -> None:
        """Write a posture, or numbers of joints, into `out` (nq,), always checked. See `Space.take`."""
        out[...] = self.convert(value, start)

    def convert_rate(self, rate: Value) -> Array:
        """Convert joint velocities to a checked rate (nv,); see `Space.convert_rate`."""
        rate = plain(rate)
        whole = self._whole(rate, self._robot.nv)
        if whole is not None:
            return finite(f"rate of {self._name}", whole, (self._robot.nv,))
        v = np.zeros(self._robot.nv)
        for joint, number in self._by_joint(rate, self._robot.nv).items():
            v[self._column(joint)] = number
        return v

    def take_rate(self, rate: Value, out: Array) -> None:
        """Write joint velocities into `out` (nv,), always checked. See `Space.take_rate`."""
        out[...] = self.convert_rate(rate)

    def difference(self, a: Array, b: Array) -> Array:
        """Compute the velocity (nv,) that leads from posture a to posture b in unit time."""
        return self._robot.difference(a, b)

    def move(self, a: Array, delta: Array, out: Array) -> None:
        """Write the posture (nq,) to which the velocity `delta` (nv,) leads from a in unit time."""
        out[:] = self._robot.integrate(a, delta, 1.0)

    def _whole(self, value: ArrayLike | Mapping[str, float], size: int) -> ArrayLike | None:
        """Return a value that has one number for each coordinate of the robot; return None for any other.

        If the task has as many joints as the value has entries, the entries are those of the joints.
        """
        if isinstance(value, Mapping) or np.shape(value) != (size,) or size == len(self.joints):
            return None
        return value

    def _by_joint(self, value: ArrayLike | Mapping[str, float], whole: int) -> dict[str, float]:
        """Return the checked number of each joint that is named; `whole` is for the error message."""
        if isinstance(value, Mapping):
            names, numbers = tuple(value), list(value.values())
            for name in names:
                if name not in self.joints:
                    raise UnknownName("joint", name, self.joints, f"(in {self._name})")
        else:
            names, numbers = self.joints, value
            if np.shape(numbers) != (len(names),):
                raise InvalidValue(
                    f"{self._name} must have {len(names)} numbers, one a joint of the task, or {whole} "
                    f"for the whole robot, got {_shape(numbers)}"
                )
        return dict(zip(names, finite(self._name, numbers, (len(names),)).tolist(), strict=True))

    def _column(self, joint: str) -> int:
        """Return the index in v of a joint's velocity; raise `InvalidValue` if it has several."""
        columns = self._robot.velocity_index(joint)
        if columns.stop - columns.start != 1:
            raise InvalidValue(
                f"{self._name}: joint '{joint}' is not one number; give a whole posture ({self._robot.nq})"
            )
        return columns.start


def coordinate_table(robot: Robot) -> IntArray:
    """Find the kind of coordinate that belongs to each velocity, and its index in q.

    The index of (cos, sin) of a continuous joint is found by turning the joint a little from neutral.

    Args:
        robot: The robot.

    Returns:
        (nv, 2): SCALAR, CIRCLE or OTHER, and the index in q at which the coordinate begins (−1 for OTHER).
    """
    table = np.full((robot.nv, 2), OTHER, dtype=np.int64)
    scalar = robot.position_index >= 0
    table[scalar, 0], table[scalar, 1] = SCALAR, robot.position_index[scalar]
    for joint in robot.joints:
        columns = robot.velocity_index(joint)
        if columns.stop - columns.start == 1 and not scalar[columns.start]:
            step = np.zeros(robot.nv)
            step[columns.start] = 0.5
            moved = robot.integrate(robot.neutral, step, 1.0) != robot.neutral
            table[columns.start] = CIRCLE, np.flatnonzero(moved)[0]
    return table


def chosen_rows(axes: str | Sequence[bool], letters: str, first: int = 0) -> IntArray:
    """Find the indices of those of the six rows of a frame that a task takes.

    In a text the chosen letters must have the order of `letters`. A blank separates position from
    orientation, so that "xy y" is the position in the x-y plane and the yaw angle.

    Args:
        axes: Letters, or one truth value for each of `letters`.
        letters: The letters to choose from, such as "xyzrpy".
        first: Index of the row that the first of `letters` denotes.

    Returns:
        (k,) indices into the six rows, in increasing order.

    Raises:
        InvalidValue: Nothing is chosen, or the choice is not made of `letters` in their order.
    """
    chosen: list[int] = []
    if isinstance(axes, str):
        place = 0
        for letter in axes:
            if letter == " ":
                place = max(place, letters.find("rpy"))
                continue
            place = letters.find(letter, place)
            if place < 0:
                raise InvalidValue(f"axes must be letters of '{letters}' in this order, got '{axes}'")
            chosen.append(place)
            place += 1
    else:
        mask = np.asarray(axes)
        if mask.shape != (len(letters),) or not np.isin(mask, (0, 1)).all():
            raise InvalidValue(
                f"axes must be {len(letters)} truth values, one for each of '{letters}', got {axes}"
            )
        chosen = np.flatnonzero(mask).tolist()
    if not chosen:
        raise InvalidValue(f"axes chooses no row; name some of '{letters}'")
    return np.array(chosen, dtype=np.int64) + first


def _shape(value: ArrayLike) -> str:
    """Describe the shape of a value for an error message, as in "3×3"."""
    return "×".join(map(str, np.shape(value))) or "a single number"


@kernel
def _difference_into(a, b, out):
    """Write [p_b − p_a; log(R_b R_aᵀ)] of two poses (4, 4) into `out` (6,), along the axes of the world."""
    turn = a.copy()
    for i in range(3):
        for j in range(3):
            turn[i, j] = b[i, 0] * a[j, 0] + b[i, 1] * a[j, 1] + b[i, 2] * a[j, 2]
    log3_into(turn, out[3:])
    for i in range(3):
        out[i] = b[i, 3] - a[i, 3]


@kernel
def _move_into(a, delta, out):
    """Write the pose with p + δp and exp(δω) R into `out` (4, 4), with `a` (4, 4) and `delta` (6,)."""
    turn = out.copy()
    exp3_into(delta[3:], turn)
    for i in range(3):
        for j in range(3):
            out[i, j] = turn[i, 0] * a[0, j] + turn[i, 1] * a[1, j] + turn[i, 2] * a[2, j]
        out[i, 3] = a[i, 3] + delta[i]
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0
