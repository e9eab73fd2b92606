"""Where the values of a reference live: poses of a frame, and postures of a robot.

A space turns what a user writes into one kind of array, and knows the two operations that a path
needs: `difference(a, b)`, the tangent vector that leads from a to b in unit time, and
`move(a, delta, out)`, its inverse. References are written once upon these.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from taskopt.arrays import Array, IntArray, finite
from taskopt.errors import InvalidValue, UnknownName
from taskopt.jit import kernel
from taskopt.kinematics.lie import exp3_into, log3_into
from taskopt.kinematics.pose import checked_pose, is_pose
from taskopt.kinematics.robot import Robot

ROW_NAMES = ("x", "y", "z", "rx", "ry", "rz")
ROW_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")
_FLOAT64 = np.dtype(np.float64)  # there is but one, and `is` is faster than ==
SCALAR, CIRCLE, OTHER = 0, 1, -1  # kinds of coordinate: one number; (cos, sin); part of a larger joint


class Space(Protocol):
    """Values of one kind, with `tangent` numbers in a rate."""

    tangent: int

    def convert(self, value: Any, start: Array) -> Array:
        """`value` as an array of this space, checked; what it leaves open is taken from `start`."""
        ...

    def take(self, value: Any, start: Array, out: Array) -> None:
        """`convert` into `out`, fast where the value is of the usual form; rows then check what it is."""
        ...

    def convert_rate(self, rate: Any) -> Array:
        """`rate` as a tangent vector (tangent,), checked."""
        ...

    def take_rate(self, rate: Any, out: Array) -> None:
        """`convert_rate` into `out`, fast where the rate is of the usual form; it may then have NaN."""
        ...

    def difference(self, a: Array, b: Array) -> Array:
        """The constant rate (tangent,) that leads from a to b in unit time."""
        ...

    def move(self, a: Array, delta: Array, out: Array) -> None:
        """Write into `out` where the constant rate `delta` leads from a in unit time."""
        ...


class PoseSpace:
    """Poses (4, 4) of a frame in the world; rates are (6,), linear of the origin [m/s], angular [rad/s],
    both along the axes of the world.

    A value may be a pose (a `pin.SE3`, or (4, 4)), a position (3,), or a rotation (3, 3); the part not
    given is that of the start. A rate may be (6,), or (3,): linear, or angular if `angular` is set.
    """

    tangent = 6

    def __init__(self, name: str, *, angular: bool = False) -> None:
        self._name, self._angular = name, angular

    def convert(self, value: Any, start: Array) -> Array:
        array = np.asarray(getattr(value, "homogeneous", value))
        if array.shape not in {(3,), (3, 3), (4, 4)}:
            raise InvalidValue(
                f"{self._name} must be a pose (4×4 or pin.SE3), a position (3) or a rotation (3×3), "
                f"got {_shape(array)}"
            )
        pose = start.copy()
        if array.shape == (4, 4):
            pose[:] = array
        elif array.shape == (3, 3):
            pose[:3, :3] = array
        else:
            pose[:3, 3] = array
        return pose if is_pose(pose) else checked_pose(self._name, pose)

    def take(self, value: Any, start: Array, out: Array) -> None:
        fast = value.__class__ is np.ndarray and value.shape == (4, 4) and value.dtype is _FLOAT64
        out[...] = value if fast else self.convert(value, start)

    def convert_rate(self, rate: Any) -> Array:
        array = np.asarray(rate)
        if array.shape == (6,):
            return finite(f"rate of {self._name}", array, (6,))
        part = finite(f"rate of {self._name}", array, (3,))
        return np.concatenate([np.zeros(3), part] if self._angular else [part, np.zeros(3)])

    def take_rate(self, rate: Any, out: Array) -> None:
        out[...] = rate if type(rate) is np.ndarray and rate.shape == (6,) else self.convert_rate(rate)

    def difference(self, a: Array, b: Array) -> Array:
        out = np.empty(6)
        _difference_into(a, b, out)
        return out

    def move(self, a: Array, delta: Array, out: Array) -> None:
        _move_into(a, delta, out)


class PostureSpace:
    """Postures (nq,) of a robot, its manifold included; rates are joint velocities (nv,).

    A value may be a whole posture (nq,), one number for each of `joints`, or a mapping from joint to
    number; joints not named keep what they have at the start. Rates likewise, with (nv,).
    """

    def __init__(self, name: str, robot: Robot, joints: Sequence[str]) -> None:
        self._name, self._robot, self.joints = name, robot, tuple(joints)
        self.tangent = robot.nv
        self._table = coordinates(robot)

    def convert(self, value: Any, start: Array) -> Array:
        if self._is_whole(value, self._robot.nq):
            return self._robot.checked_q(value)
        q = start.copy()
        for joint, number in self._by_joint(value, self._robot.nq).items():
            kind, iq = self._table[self._column(joint)]
            if kind == SCALAR:
                q[iq] = number
            else:
                q[iq : iq + 2] = np.cos(number), np.sin(number)
        return q

    def take(self, value: Any, start: Array, out: Array) -> None:
        out[...] = self.convert(value, start)

    def convert_rate(self, rate: Any) -> Array:
        if self._is_whole(rate, self._robot.nv):
            return finite(f"rate of {self._name}", rate, (self._robot.nv,))
        v = np.zeros(self._robot.nv)
        for joint, number in self._by_joint(rate, self._robot.nv).items():
            v[self._column(joint)] = number
        return v

    def take_rate(self, rate: Any, out: Array) -> None:
        out[...] = self.convert_rate(rate)

    def difference(self, a: Array, b: Array) -> Array:
        return self._robot.difference(a, b)

    def move(self, a: Array, delta: Array, out: Array) -> None:
        out[:] = self._robot.integrate(a, delta, 1.0)

    def _is_whole(self, value: Any, size: int) -> bool:
        """Whether `value` is for the whole robot; one number a joint of the task comes first."""
        return not isinstance(value, Mapping) and np.shape(value) == (size,) != (len(self.joints),)

    def _by_joint(self, value: Any, whole: int) -> dict[str, float]:
        """Joint to number, checked."""
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
        columns = self._robot.velocity_index(joint)
        if columns.stop - columns.start != 1:
            raise InvalidValue(
                f"{self._name}: joint '{joint}' is not one number; give a whole posture ({self._robot.nq})"
            )
        return columns.start


def coordinates(robot: Robot) -> IntArray:
    """(nv, 2): kind of each velocity's coordinate (SCALAR, CIRCLE, OTHER) and where it begins in q.

    Where (cos, sin) of a continuous joint stand is found by turning it a little from neutral.
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
    """Indices into the six rows that `axes` chooses among `letters`, the first of which is row `first`.

    Letters are read from left to right in the order of `letters`, and a blank goes on to the
    orientation: "xyz", "xy y" (position in the plane, and yaw), "rp". Or one truth value a letter.
    Raises `InvalidValue` if nothing, or something else, is chosen.
    """
    chosen: list[int] = []
    if isinstance(axes, str):
        at = 0
        for letter in axes:
            if letter == " ":
                at = max(at, letters.find("rpy"))
                continue
            at = letters.find(letter, at)
            if at < 0:
                raise InvalidValue(f"axes must be letters of '{letters}' in this order, got '{axes}'")
            chosen.append(at)
            at += 1
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


def _shape(value: Any) -> str:
    return "×".join(map(str, np.shape(value))) or "a single number"


@kernel
def _difference_into(a, b, out):
    """[p_b − p_a; log(R_b R_aᵀ)], along the axes of the world."""
    turn = a.copy()
    for i in range(3):
        for j in range(3):
            turn[i, j] = b[i, 0] * a[j, 0] + b[i, 1] * a[j, 1] + b[i, 2] * a[j, 2]
    log3_into(turn, out[3:])
    for i in range(3):
        out[i] = b[i, 3] - a[i, 3]


@kernel
def _move_into(a, delta, out):
    """p + δp and exp(δω) R."""
    turn = out.copy()
    exp3_into(delta[3:], turn)
    for i in range(3):
        for j in range(3):
            out[i, j] = turn[i, 0] * a[0, j] + turn[i, 1] * a[1, j] + turn[i, 2] * a[2, j]
        out[i, 3] = a[i, 3] + delta[i]
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0
