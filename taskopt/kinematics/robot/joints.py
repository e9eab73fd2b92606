"""Names, units and limits of the coordinates of joints, which follow from the type of each joint.

The type decides, and not the number in the file, because files and loaders write "no limit" in many ways: 0
for a velocity, ±1.01 for the cosine and sine of a continuous joint, 1.8e308 for a free-flyer. Only a
coordinate that is the integral of its own velocity can have a position limit.
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import NO_BOUND, Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.kinematics.engine import JointModel, Model

_LINEAR = ("vx", "vy", "vz")
_ANGULAR = ("wx", "wy", "wz")
_SUFFIXES = {
    "JointModelFreeFlyer": _LINEAR + _ANGULAR,
    "JointModelPlanar": ("vx", "vy", "wz"),
    "JointModelSpherical": _ANGULAR,
    "JointModelTranslation": _LINEAR,
}
_UNIT_NORM = {  # the part of the joint's q that has norm 1
    "JointModelFreeFlyer": slice(3, 7),
    "JointModelPlanar": slice(2, 4),
    "JointModelSpherical": slice(0, 4),
}


_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_ALIGNED = {"R": "revolute", "RUB": "continuous", "P": "prismatic"}
_UNALIGNED = {"RevoluteUnaligned": "revolute", "PrismaticUnaligned": "prismatic"}


def kind_and_axis(joint: JointModel) -> tuple[str, Array] | None:
    """Return the kind of a joint with one axis, and that axis.

    Args:
        joint: The joint.

    Returns:
        "revolute", "continuous" (turns, and has cosine and sine in q) or "prismatic", and the axis in the
        frame of the joint (3,); None for a joint of another kind.
    """
    name = joint.shortname().removeprefix("JointModel")
    if name in _UNALIGNED:
        return _UNALIGNED[name], np.array(joint.extract().axis)
    kind, axis = _ALIGNED.get(name[:-1]), _AXES.get(name[-1:])
    return None if kind is None or axis is None else (kind, np.array(axis))


@dataclass(frozen=True, eq=False)
class JointTable:
    """Names, units and limits of all velocities of a robot, in Pinocchio's order.

    Attributes:
        names: (nv,) name of each velocity: that of its joint, with a suffix if the joint has several
            velocities.
        units: (nv,) "rad" or "m", the unit of the coordinate whose rate the velocity is.
        position_index: (nv,) index in q of the coordinate whose rate the velocity is; −1 if there is no such
            coordinate.
        position_lower: (nv,) [rad, m]; −inf where there is no limit.
        position_upper: (nv,) [rad, m]; +inf where there is no limit.
        velocity_limit: (nv,) [rad/s, m/s]; +inf where there is no limit.
        unit_norm: For each joint with a quaternion or (cos, sin) its name, and the slice of q that holds
            them.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    position_index: IntArray
    position_lower: Array
    position_upper: Array
    velocity_limit: Array
    unit_norm: tuple[tuple[str, slice], ...]


NUMBERS = ("lowerPositionLimit", "upperPositionLimit", "upperVelocityLimit", "jointPlacements", "inertias")
"""Names of the arrays of a model that a robot, or a part of a plan, reads once."""


def numbers_of(model: Model) -> tuple[Array, ...]:
    """Copy those numbers of a model that are read only once, when a robot is made.

    Args:
        model: The kinematic tree.

    Returns:
        The arrays of `NUMBERS`: limits, placements of joints as (joints + 1, 4, 4), and mass and first moment
        of bodies as (joints + 1, 4).
    """
    placements = np.array([place.homogeneous for place in model.jointPlacements])
    bodies = np.array([[body.mass, *(body.mass * body.lever)] for body in model.inertias])
    limits = (getattr(model, name).copy() for name in NUMBERS[:3])
    return (*limits, placements, bodies)


def joint_table(model: Model) -> JointTable:
    """Read names, units and limits of the velocities of a model.

    Args:
        model: The kinematic tree.

    Returns:
        The table; its arrays are read-only.

    Raises:
        InvalidValue: a joint has a lower limit above its upper one, or mimics another joint.
    """
    names: list[str] = []
    units: list[str] = []
    unit_norm: list[tuple[str, slice]] = []
    index = np.full(model.nv, -1, dtype=np.int64)
    lower, upper = np.full(model.nv, -np.inf), np.full(model.nv, np.inf)
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        kind = joint.shortname()
        if kind == "JointModelMimic":
            raise InvalidValue(f"joint {name} mimics another; load the model with mimic=False")
        names += _velocity_names(name, kind, joint.nv)
        units += _units(kind, joint.nv)
        if part := _unit_part(kind, joint.nq):
            unit_norm.append((name, slice(joint.idx_q + part.start, joint.idx_q + part.stop)))
        elif joint.nq == joint.nv:
            columns = velocity_slice(joint)
            index[columns] = np.arange(joint.idx_q, joint.idx_q + joint.nq)
            lower[columns], upper[columns] = _position_limits(model, name, joint)
    velocity = _no_limit_is_inf(np.array(model.upperVelocityLimit))
    for array in (index, lower, upper, velocity):
        array.setflags(write=False)
    return JointTable(tuple(names), tuple(units), index, lower, upper, velocity, tuple(unit_norm))


def velocity_slice(joint: JointModel) -> slice:
    """Find the velocities of a joint.

    Args:
        joint: The joint, as a `pin.Model` lists it.

    Returns:
        The slice of v that holds them; an empty one for the world.
    """
    return slice(joint.idx_v, joint.idx_v + joint.nv) if joint.nv else slice(0)


def _position_limits(model: Model, name: str, joint: JointModel) -> tuple[Array, Array]:
    """Return the position limits (nv of the joint,) of a joint, with ±inf where there is none."""
    places = slice(joint.idx_q, joint.idx_q + joint.nq)
    lower = np.array(model.lowerPositionLimit[places])
    upper = np.array(model.upperPositionLimit[places])
    if (lower > upper).any():
        raise InvalidValue(f"joint {name} has position limits {lower} to {upper}; lower must be ≤ upper")
    lower[lower <= -NO_BOUND] = -np.inf
    upper[upper >= NO_BOUND] = np.inf
    return lower, upper


def _no_limit_is_inf(velocity: Array) -> Array:
    """Replace every number that means "no velocity limit" by inf."""
    return np.where((velocity > 0.0) & (velocity < NO_BOUND), velocity, np.inf)


def _velocity_names(name: str, kind: str, nv: int) -> list[str]:
    """Name the velocities of a joint, as in "elbow" or "root_joint.vx"."""
    if nv == 1:
        return [name]
    return [f"{name}.{suffix}" for suffix in _SUFFIXES.get(kind, tuple(map(str, range(nv))))]


def _units(kind: str, nv: int) -> list[str]:
    """Return the unit of each coordinate of a joint, "m" or "rad"."""
    if nv > 1:
        return ["m" if suffix in _LINEAR else "rad" for suffix in _SUFFIXES.get(kind, ("",) * nv)]
    prismatic = kind.startswith("JointModelP")
    return ["m" if prismatic else "rad"] * nv


def _unit_part(kind: str, nq: int) -> slice | None:
    """Return the part of a joint's q that must have norm 1, or None."""
    if kind.startswith(("JointModelRUB", "JointModelRevoluteUnbounded")):
        return slice(0, nq)
    return _UNIT_NORM.get(kind)
