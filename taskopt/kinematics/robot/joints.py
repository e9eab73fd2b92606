"""What the coordinates of a joint mean, decided by the joint's type and never by a number.

Files write "no limit" in many ways: 0 for a velocity, ±1.01 on the cosine and sine of a continuous
joint, 1.8e308 on a free-flyer. Only a coordinate that is its own velocity's integral can have a
position limit.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue

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
_BEYOND_ANY_ROBOT = 1e300  # Pinocchio's own "no limit" is the largest float


@dataclass
class Coordinates:
    """Per velocity: name, unit, limits, and where in q its coordinate stands (−1: nowhere)."""

    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    position_index: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    position_lower: Array = field(default_factory=lambda: np.empty(0))
    position_upper: Array = field(default_factory=lambda: np.empty(0))
    velocity_limit: Array = field(default_factory=lambda: np.empty(0))
    unit_norm: list[tuple[str, slice]] = field(default_factory=list)  # joint, its unit part of q


def coordinates(model: Any) -> Coordinates:
    """Read a pin.Model; raise `InvalidValue` where lower > upper, or for mimic joints."""
    out = Coordinates(
        position_index=np.full(model.nv, -1, dtype=np.int64),
        position_lower=np.full(model.nv, -np.inf),
        position_upper=np.full(model.nv, np.inf),
        velocity_limit=_no_limit_is_inf(np.array(model.upperVelocityLimit)),
    )
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        kind = joint.shortname()
        if kind == "JointModelMimic":
            raise InvalidValue(f"joint {name} mimics another; load the model with mimic=False")
        out.names += _velocity_names(name, kind, joint.nv)
        out.units += _units(kind, joint.nv)
        if part := _unit_part(kind, joint.nq):
            out.unit_norm.append((name, slice(joint.idx_q + part.start, joint.idx_q + part.stop)))
        elif joint.nq == joint.nv:
            _take_limits(out, model, name, joint)
    return out


def _take_limits(out: Coordinates, model: Any, name: str, joint: Any) -> None:
    columns, places = slice(joint.idx_v, joint.idx_v + joint.nv), slice(joint.idx_q, joint.idx_q + joint.nq)
    lower = np.array(model.lowerPositionLimit[places])
    upper = np.array(model.upperPositionLimit[places])
    if (lower > upper).any():
        raise InvalidValue(f"joint {name} has position limits {lower} to {upper}; lower must be ≤ upper")
    out.position_index[columns] = np.arange(places.start, places.stop)
    out.position_lower[columns] = np.where(lower <= -_BEYOND_ANY_ROBOT, -np.inf, lower)
    out.position_upper[columns] = np.where(upper >= _BEYOND_ANY_ROBOT, np.inf, upper)


def _no_limit_is_inf(velocity: Array) -> Array:
    return np.where((velocity > 0.0) & (velocity < _BEYOND_ANY_ROBOT), velocity, np.inf)


def _velocity_names(name: str, kind: str, nv: int) -> list[str]:
    if nv == 1:
        return [name]
    return [f"{name}.{suffix}" for suffix in _SUFFIXES.get(kind, tuple(map(str, range(nv))))]


def _units(kind: str, nv: int) -> list[str]:
    if nv > 1:
        return ["m" if suffix in _LINEAR else "rad" for suffix in _SUFFIXES.get(kind, ("",) * nv)]
    prismatic = kind.startswith("JointModelP")
    return ["m" if prismatic else "rad"] * nv


def _unit_part(kind: str, nq: int) -> slice | None:
    if kind.startswith(("JointModelRUB", "JointModelRevoluteUnbounded")):
        return slice(0, nq)
    return _UNIT_NORM.get(kind)
