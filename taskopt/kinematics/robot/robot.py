"""A robot: names, limits, kinematic tree, shapes. It holds no state; a `Configuration` does."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, IntArray, finite
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.robot.dh import DHRow, build_dh
from taskopt.kinematics.robot.joints import coordinates
from taskopt.kinematics.robot.named import load_named
from taskopt.kinematics.robot.parts import Parts, Shapes, loaded
from taskopt.kinematics.robot.urdf import read_urdf

_ALWAYS = ("neutral", "middle")  # postures that every robot has


class Robot:
    """A kinematic tree (pin.Model) with named joints, frames, limits and postures.

    `geometry` holds the collision shapes and `visual` what a viewer draws; either may be a function
    that is called on first use, since meshes take seconds to load. Limits are what the joint's type
    allows: a continuous joint or a free-flyer has no position limit, 0 in the file is no velocity
    limit. Units: m, rad, s; velocities are those of Pinocchio, in the joint's own frame.
    """

    def __init__(
        self,
        model: Any,
        geometry: Shapes = None,
        visual: Shapes = None,
        *,
        name: str | None = None,
        postures: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        if not isinstance(model, pin.Model):
            raise InvalidValue(
                f"a robot is made from a pin.Model, got {model!r}; for a name use Robot.load, for a file "
                "Robot.from_urdf"
            )
        self.model = model
        self.name: str = name or model.name or "robot"
        self.nq: int = model.nq
        self.nv: int = model.nv
        self.joints: tuple[str, ...] = tuple(model.names)[1:]
        known = coordinates(model)
        self.velocity_names: tuple[str, ...] = tuple(known.names)
        self.coordinate_units: tuple[str, ...] = tuple(known.units)
        self.position_index: IntArray = _frozen(known.position_index)
        self.position_lower: Array = _frozen(known.position_lower)
        self.position_upper: Array = _frozen(known.position_upper)
        self.velocity_limit: Array = _frozen(known.velocity_limit)
        self._unit_norm = tuple(known.unit_norm)
        self._geometry, self._visual = geometry, visual
        self.neutral: Array = _frozen(pin.neutral(model))
        given = {key: self.checked_q(q) for key, q in (postures or {}).items()}
        self.postures: dict[str, Array] = {"neutral": self.neutral, "middle": self._middle(), **given}

    @staticmethod
    def load(name: str, lock: Iterable[str] = (), floating: bool | None = None) -> "Robot":
        """A robot of the extra taskopt[robots] by name, as `taskopt list` shows them.

        It gets a floating base if it walks or flies, unless `floating` says otherwise. Raises
        `UnknownName`, or `NotInstalled` without the extra.
        """
        return Robot._of(load_named(name, floating)).lock(lock)

    @staticmethod
    def from_urdf(
        path: str | Path,
        package_dirs: Iterable[str | Path] | None = None,
        lock: Iterable[str] = (),
        floating: bool = False,
        srdf: str | Path | None = None,
        meshes: bool = True,
    ) -> "Robot":
        """A robot from a URDF file, with the postures of an SRDF file if one is given.

        `package_dirs` is where package:// is looked for; default: the folders above the file.
        Raises `MissingFile` for the file, its SRDF, or a mesh; `meshes=False` does without shapes.
        """
        return Robot._of(read_urdf(path, package_dirs, floating, srdf, meshes)).lock(lock)

    @staticmethod
    def from_dh(
        rows: Sequence[DHRow],
        name: str = "dh_arm",
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
        radius: float | None = None,
    ) -> "Robot":
        """A chain from Denavit–Hartenberg rows (2.52), with capsules of `radius` [m] as links.

        Joints are joint1, joint2, …; frame link i is the Denavit–Hartenberg frame i, and "tip" stands
        at `tool` (4, 4) in the last of them. `base` (4, 4) places frame 0 in the world.
        """
        return Robot._of(build_dh(tuple(rows), name, base, tool, radius))

    @staticmethod
    def _of(parts: Parts) -> "Robot":
        return Robot(parts.model, parts.geometry, parts.visual, name=parts.name, postures=parts.postures)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, nq={self.nq}, nv={self.nv})"

    @cached_property
    def geometry(self) -> Any:
        """Collision shapes (pin.GeometryModel); raise `MissingFile` if a mesh is not there."""
        return loaded(self._geometry)

    @cached_property
    def visual(self) -> Any:
        """What a viewer draws (pin.GeometryModel); the collision shapes where there is nothing else."""
        return self.geometry if self._visual is None else loaded(self._visual)

    @cached_property
    def _frame_ids(self) -> dict[str, int]:
        """One id a name; where a joint and a body share it, the body's, which stands at the same place."""
        ids = {frame.name: i for i, frame in enumerate(self.model.frames) if i > 0}
        bodies = {
            f.name: i for i, f in enumerate(self.model.frames) if i > 0 and f.type == pin.FrameType.BODY
        }
        return ids | bodies

    @cached_property
    def frames(self) -> tuple[str, ...]:
        """Names of all frames but the world's."""
        return tuple(self._frame_ids)

    @cached_property
    def column_joint(self) -> IntArray:
        """(nv,) index of the joint that each velocity belongs to; along a chain it never decreases."""
        ids = [i for i, joint in enumerate(self.model.joints) if i > 0 for _ in range(joint.nv)]
        return _frozen(np.array(ids, dtype=np.int64))

    def frame_id(self, name: str) -> int:
        """Pinocchio's index of a frame; raise `UnknownName`."""
        if name not in self._frame_ids:
            raise UnknownName("frame", name, self.frames)
        return self._frame_ids[name]

    def frame_joint(self, name: str) -> int:
        """Pinocchio's index of the joint that a frame is fixed to, 0 for the world; raise `UnknownName`."""
        return self.model.frames[self.frame_id(name)].parentJoint

    def joint_id(self, name: str) -> int:
        """Pinocchio's index of a movable joint; raise `UnknownName`."""
        if name not in self.joints:
            raise UnknownName("joint", name, self.joints)
        return self.joints.index(name) + 1

    def velocity_index(self, joint: str) -> slice:
        """Where the velocities of a joint stand in v; raise `UnknownName`."""
        found = self.model.joints[self.joint_id(joint)]
        return slice(found.idx_v, found.idx_v + found.nv)

    def support(self, frame: str) -> IntArray:
        """Columns of the Jacobian that move a frame, in increasing order."""
        joint = self.model.frames[self.frame_id(frame)].parentJoint
        chain = [self.model.joints[i] for i in self.model.supports[joint] if i > 0]
        return np.array([c for j in chain for c in range(j.idx_v, j.idx_v + j.nv)], dtype=np.int64)

    def posture(self, name: str) -> Array:
        """A copy of a named posture (nq,); raise `UnknownName`."""
        if name not in self.postures:
            raise UnknownName("posture", name, self.postures)
        return self.postures[name].copy()

    def lock(self, names: Iterable[str], q: ArrayLike | None = None) -> "Robot":
        """The robot with joints held where q has them; default: neutral, moved into the limits."""
        ids = [self.joint_id(name) for name in ([names] if isinstance(names, str) else names)]
        if not ids:
            return self
        postures = {key: posture for key, posture in self.postures.items() if key not in _ALWAYS}
        parts = Parts(self.model, lambda: self.geometry, lambda: self.visual, self.name, postures)
        return Robot._of(parts.locked(ids, self._inside(self.neutral) if q is None else self.checked_q(q)))

    def checked_q(self, q: ArrayLike) -> Array:
        """A copy of q; raise `InvalidValue` for its size, NaN, inf, or a quaternion off norm 1 by 1e-6."""
        out = finite(f"q of {self.name}", q, (self.nq,))
        for joint, part in self._unit_norm:
            norm = float(np.linalg.norm(out[part]))
            if abs(norm - 1.0) > 1e-6:
                what = "a unit quaternion" if part.stop - part.start == 4 else "cosine and sine"
                raise InvalidValue(
                    f"q[{part.start}:{part.stop}] of {joint} must be {what}, got norm {norm:g}; normalise it"
                )
            out[part] /= norm
        return out

    @cached_property
    def mass(self) -> float:
        """Mass of all links [kg]; 0 for a robot whose links have no inertia."""
        return float(pin.computeTotalMass(self.model))

    def carried(self) -> tuple[IntArray, Array]:
        """For each joint, the world first: its parent; and (joints + 1, 4) the mass of the body that it
        carries [kg], with the place of its centre in the joint's frame [m]."""
        bodies = np.array([[body.mass, *body.lever] for body in self.model.inertias])
        bodies[0] = 0.0  # what is fixed to the world moves no centre of mass
        return np.array(self.model.parents, dtype=np.int64), bodies

    def integrate(self, q: Array, v: Array, dt: float) -> Array:
        """q ⊕ v dt, one Euler step on the manifold (3.48)."""
        return pin.integrate(self.model, q, v * dt)

    def difference(self, q0: Array, q1: Array) -> Array:
        """The velocity (nv,) that leads from q0 to q1 in unit time: q0 ⊕ difference(q0, q1) = q1."""
        return pin.difference(self.model, q0, q1)

    def difference_rates(self, q0: Array, q1: Array) -> tuple[Array, Array]:
        """(nv, nv) each: the derivative of difference(q0, q1) along the tangent at q0, and at q1."""
        from_q0, from_q1 = pin.dDifference(self.model, q0, q1)
        return from_q0, from_q1

    def outside(self, q: Array, tolerance: float = 1e-9) -> tuple[str, ...]:
        """One sentence for each joint that is outside its position limits by more than `tolerance`."""
        has = self.position_index >= 0
        at = np.where(has, q[self.position_index], 0.0)
        wrong = has & ((at < self.position_lower - tolerance) | (at > self.position_upper + tolerance))
        return tuple(
            f"{self.velocity_names[i]} at {at[i]:.6g} {self.coordinate_units[i]}, "
            f"allowed {self.position_lower[i]:.6g} to {self.position_upper[i]:.6g}"
            for i in np.flatnonzero(wrong)
        )

    def _inside(self, q: Array) -> Array:
        out, has = q.copy(), self.position_index >= 0
        places = self.position_index[has]
        out[places] = np.clip(out[places], self.position_lower[has], self.position_upper[has])
        return out

    def _middle(self) -> Array:
        """The middle of each bounded range; elsewhere neutral, moved into what one-sided limit there is."""
        out = self._inside(self.neutral)
        two_sided = np.isfinite(self.position_lower) & np.isfinite(self.position_upper)
        middle = 0.5 * (self.position_lower[two_sided] + self.position_upper[two_sided])
        out[self.position_index[two_sided]] = middle
        return _frozen(out)


def _frozen(array: Any) -> Any:
    array.setflags(write=False)
    return array
