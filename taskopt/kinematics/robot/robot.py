"""Robots: names, limits, kinematic tree and shapes. The state of a robot is in a `Configuration`."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, IntArray, finite, names_in
from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.tolerances import JOINT_RANGE, MODEL_UNCHANGED, UNIT_NORM
from taskopt.kinematics.engine import GeometryModel, Model
from taskopt.kinematics.orientation.pose_forms import Homogeneous, as_pose
from taskopt.kinematics.robot.couplings import Coupling, checked_couplings, coupled
from taskopt.kinematics.robot.dh import DHRow, build_dh
from taskopt.kinematics.robot.joints import NUMBERS, joint_table, numbers_of, velocity_slice
from taskopt.kinematics.robot.mjcf import read_mjcf
from taskopt.kinematics.robot.named import load_named
from taskopt.kinematics.robot.parts import ALWAYS, Parts, Shapes, loaded
from taskopt.kinematics.robot.unheld_limits import unheld_limits
from taskopt.kinematics.robot.urdf import read_checked, read_urdf
from taskopt.kinematics.robot.variants import TighterLimits, with_frame, with_limits, without_collision
from taskopt.kinematics.robot.xacro_file import Argument, expanded_xacro


class Robot:
    """A kinematic tree (`pin.Model`) with named joints, frames, limits and postures.

    The type of a joint decides which limits it has: a continuous joint or a free-flyer has no position limit,
    and a velocity limit of 0 in a file means that there is none. Velocities are those of Pinocchio, in the
    joint's own frame.

    Attributes:
        model: The kinematic tree; a joint whose axes turn with its own coordinates (composite, universal,
            Euler angles) is split into joints with one axis each, which changes no coordinate.
        name: Name of the robot.
        nq: Number of entries of a posture q.
        nv: Number of entries of a velocity v.
        joints: Names of the movable joints.
        velocity_names: (nv,) name of each velocity.
        coordinate_units: (nv,) "rad" or "m", the unit of the coordinate whose rate each velocity is.
        position_index: (nv,) index in q of the coordinate whose rate the velocity is; −1 if there is no such
            coordinate.
        position_lower: (nv,) [rad, m], −inf where there is no limit.
        position_upper: (nv,) [rad, m], +inf where there is no limit.
        velocity_limit: (nv,) [rad/s, m/s], +inf where there is no limit.
        acceleration_limit: (nv,) [rad/s², m/s²], +inf where there is no limit. No file and no `pin.Model`
            states any; `with_limits` sets them.
        couplings: Couplings of joints, such as mimic joints; a stack keeps them as hard rows.
        dropped: One sentence for each statement of the robot's file that the robot cannot represent.
        neutral: (nq,) Pinocchio's neutral configuration, in which coupled joints follow their leaders.
        postures: Mapping from name to posture (nq,) [rad, m], with "neutral" and "middle" among the names.
    """

    def __init__(
        self,
        model: Model,
        geometry: Shapes = None,
        visual: Shapes = None,
        *,
        name: str | None = None,
        postures: Mapping[str, ArrayLike] | None = None,
        couplings: Sequence[Coupling] = (),
        dropped: Sequence[str] = (),
    ) -> None:
        """Make a robot from a kinematic tree.

        Args:
            model: The kinematic tree (`pin.Model`).
            geometry: Collision shapes (`pin.GeometryModel`), or a function that loads them on first use,
                since meshes take seconds to load; None: no shapes.
            visual: Shapes that a viewer draws, or a function that loads them; None: the collision shapes.
            name: Name of the robot; default: the model's.
            postures: Mapping from name to posture (nq,) [rad, m]; in each, coupled joints are moved to follow
                their leaders.
            couplings: Couplings of joints, each of which makes one joint follow another.
            dropped: One sentence for each statement of a file that the robot cannot represent.

        Raises:
            InvalidValue: The model is no `pin.Model`, has wrong limits or mimic joints, or a posture or a
                coupling does not fit it.
            UnknownName: A coupling names a joint that is not there.
        """
        _check(model)
        parts = Parts(model, geometry, visual).with_still_axes({})
        self.model = model = parts.model
        self.name: str = name or model.name or "robot"
        self.nq: int = model.nq
        self.nv: int = model.nv
        self.joints: tuple[str, ...] = tuple(model.names)[1:]
        table = joint_table(model)
        self.velocity_names = table.names
        self.coordinate_units = table.units
        self.position_index = table.position_index
        self.position_lower = table.position_lower
        self.position_upper = table.position_upper
        self.velocity_limit = table.velocity_limit
        self._acceleration: Mapping[str, float] = {}
        self._unit_norm = table.unit_norm
        self._read = numbers_of(model)
        self._known_frames: tuple[int, dict[str, int]] = 0, {}
        self._geometry, self._visual = parts.geometry, parts.visual
        self.couplings = checked_couplings(self.name, model, couplings)
        self.dropped = tuple(dict.fromkeys((*dropped, *unheld_limits(model))))
        self.neutral: Array = _frozen(self.coupled(pin.neutral(model)))
        given = {key: self.coupled(self.checked_q(q)) for key, q in (postures or {}).items()}
        self.postures: dict[str, Array] = {"neutral": self.neutral, "middle": self._middle(), **given}

    @staticmethod
    def load(name: str, lock: Iterable[str] = (), floating: bool | None = None) -> "Robot":
        """Load a robot by name: an arm of the textbook, or a robot of the extra `taskopt[robots]`.

        Args:
            name: One of the names that `taskopt list` shows.
            lock: Names of joints to fix: each at Pinocchio's neutral value, or at the limit nearest to it.
            floating: True gives the robot a floating base. Default: only a robot that walks or flies has one.

        Returns:
            The robot.

        Raises:
            UnknownName: There is no robot, or no joint, of that name.
            NotInstalled: The robot is not an arm of the textbook, and the extra is not installed.
        """
        return Robot.from_parts(load_named(name, floating)).lock(lock)

    @staticmethod
    def from_urdf(
        path: str | Path,
        package_dirs: Iterable[str | Path] | None = None,
        lock: Iterable[str] = (),
        floating: bool = False,
        srdf: str | Path | None = None,
        meshes: bool = True,
    ) -> "Robot":
        """Read a robot from a URDF file, with the postures of an SRDF file if one is given.

        Args:
            path: The URDF file.
            package_dirs: Folders in which package:// is looked for; default: those above the file.
            lock: Names of joints to fix: each at Pinocchio's neutral value, or at the limit nearest to it.
            floating: Give the robot a floating base.
            srdf: File with named postures and with pairs of links that are never checked for collision.
            meshes: False leaves out meshes, and keeps spheres, boxes and cylinders.

        Returns:
            The robot. Its attribute `dropped` lists the statements of the file that it cannot represent.

        Raises:
            MissingFile: The file, its SRDF or a mesh is not there.
            InvalidValue: The file is not a tree that a `pin.Model` can hold; the message names file and
                element.
            UnknownName: A joint to lock does not exist.

        Warns:
            DroppedWarning: The file states something that the robot lacks.
        """
        return Robot.from_parts(read_urdf(path, package_dirs, floating, srdf, meshes)).lock(lock)

    @staticmethod
    def from_xacro(
        path: str | Path,
        args: Mapping[str, Argument] | None = None,
        package_dirs: Iterable[str | Path] | None = None,
        lock: Iterable[str] = (),
        floating: bool = False,
        srdf: str | Path | None = None,
        meshes: bool = True,
    ) -> "Robot":
        """Expand a xacro file, and read the robot from it; this needs the extra `taskopt[xacro]`.

        Args:
            path: The xacro file.
            args: Mapping from each argument of the file to its value, such as {"gripper": True}.
            package_dirs: Folders in which $(find …) and package:// are looked for, see `from_urdf`.
            lock: Names of joints to fix: each at its neutral value, or at the limit nearest to it.
            floating: Give the robot a floating base.
            srdf: File with named postures and with pairs of links that are never checked for collision.
            meshes: False leaves out meshes, and keeps spheres, boxes and cylinders.

        Returns:
            The robot. Its attribute `dropped` lists the statements of the file that it cannot represent.

        Raises:
            MissingFile: The file, its SRDF or a mesh is not there.
            NotInstalled: The package xacrodoc is not installed.
            InvalidValue: The file cannot be expanded, or is not a tree that a `pin.Model` can hold.
            UnknownName: A joint to lock does not exist.

        Warns:
            DroppedWarning: The file states something that the robot lacks.
        """
        file = expanded_xacro(path, args, package_dirs)
        return Robot.from_parts(read_checked(file, package_dirs, floating, srdf, meshes)).lock(lock)

    @staticmethod
    def from_mjcf(path: str | Path, lock: Iterable[str] = ()) -> "Robot":
        """Read a robot from an MJCF file, the format of MuJoCo; this needs the extra `taskopt[mujoco]`.

        Coordinates are those of MuJoCo's `qpos` in the same order, with quaternions as (x, y, z, w).
        Keyframes and MuJoCo's reference configuration "qpos0" become postures. Such a file states no velocity
        limits.

        Args:
            path: The MJCF file; files that it includes are read, too.
            lock: Names of joints to fix: each at its neutral value, or at the limit nearest to it.

        Returns:
            The robot. Its attribute `dropped` lists the statements of the file that it cannot represent.

        Raises:
            MissingFile: The file, or one that it refers to, is not there.
            NotInstalled: The package mujoco is not installed.
            InvalidValue: MuJoCo cannot compile the file, or nothing in it moves.
            UnknownName: A joint to lock does not exist.

        Warns:
            DroppedWarning: The file states something that the robot lacks.
        """
        return Robot.from_parts(read_mjcf(path)).lock(lock)

    @staticmethod
    def from_dh(
        rows: Sequence[DHRow],
        name: str = "dh_arm",
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
        radius: float | None = None,
    ) -> "Robot":
        """Make a chain from Denavit–Hartenberg rows, with capsules as links.

        Joints are named joint1, joint2, …. Frame link i is the Denavit–Hartenberg frame i.

        Args:
            rows: One row for each joint, from the base on.
            name: Name of the robot.
            base: (4, 4) pose of frame 0 in the world [m]; default: the identity.
            tool: (4, 4) pose of the frame "tip" in the last frame [m]; default: the identity.
            radius: Radius of the capsules [m]; default: 6 % of the longest length.

        Returns:
            The robot.

        Raises:
            InvalidValue: There is no row, a pose is invalid, or the radius is not positive.

        Source:
            (2.52) of the textbook.
        """
        return Robot.from_parts(build_dh(tuple(rows), name, base, tool, radius))

    @staticmethod
    def from_parts(parts: Parts) -> "Robot":
        """Make a robot of the parts that a reader of robots returned.

        Args:
            parts: Tree, shapes, name and postures.

        Returns:
            The robot.

        Raises:
            InvalidValue: The tree has wrong limits or mimic joints, or a posture does not fit it.
        """
        robot = Robot(
            parts.model,
            parts.geometry,
            parts.visual,
            name=parts.name,
            postures=parts.postures,
            couplings=parts.couplings,
            dropped=parts.dropped,
        )
        robot._acceleration = parts.acceleration
        return robot

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, nq={self.nq}, nv={self.nv})"

    @cached_property
    def geometry(self) -> GeometryModel:
        """Collision shapes (`pin.GeometryModel`), loaded on first use.

        Raises:
            MissingFile: A mesh is not there.
        """
        return loaded(self._geometry)

    @cached_property
    def visual(self) -> GeometryModel:
        """Shapes to draw (`pin.GeometryModel`), loaded on first use; the collision shapes if there are none.

        Raises:
            MissingFile: A mesh is not there.
        """
        return self.geometry if self._visual is None else loaded(self._visual)

    @property
    def _frame_ids(self) -> dict[str, int]:
        """Map names to Pinocchio's indices of frames, also of those that were added to the model later.

        Where a joint and a body share a name, the body's frame is taken, which is at the same place.
        """
        if self._known_frames[0] != self.model.nframes:
            self._known_frames = self.model.nframes, self._read_frames()
        return self._known_frames[1]

    def _read_frames(self) -> dict[str, int]:
        """Read the names of the frames of the model."""
        ids = {frame.name: i for i, frame in enumerate(self.model.frames) if i > 0}
        bodies = {
            f.name: i for i, f in enumerate(self.model.frames) if i > 0 and f.type == pin.FrameType.BODY
        }
        return ids | bodies

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of all frames except the world."""
        return tuple(self._frame_ids)

    @cached_property
    def acceleration_limit(self) -> Array:
        """Largest acceleration of each velocity, (nv,) [rad/s², m/s²]; +inf where there is no limit."""
        out = np.full(self.nv, np.inf)
        for joint, most in self._acceleration.items():
            out[self.velocity_index(joint)] = most
        return _frozen(out)

    @cached_property
    def column_joint(self) -> IntArray:
        """Index (nv,) of the joint that each velocity belongs to; along a chain it never decreases."""
        ids = [i for i, joint in enumerate(self.model.joints) if i > 0 for _ in range(joint.nv)]
        out = np.array(ids, dtype=np.int64)
        out.setflags(write=False)
        return out

    def frame_id(self, name: str) -> int:
        """Return Pinocchio's index of a frame.

        Args:
            name: The frame.

        Raises:
            UnknownName: There is no frame of that name.
        """
        if not isinstance(name, str) or name not in self._frame_ids:
            raise UnknownName("frame", name, self.frames)
        return self._frame_ids[name]

    def frame_joint(self, name: str) -> int:
        """Return Pinocchio's index of the joint to which a frame is fixed, 0 for the world.

        Args:
            name: The frame.

        Raises:
            UnknownName: There is no frame of that name.
        """
        return self.model.frames[self.frame_id(name)].parentJoint

    def joint_id(self, name: str) -> int:
        """Return Pinocchio's index of a movable joint.

        Args:
            name: The joint.

        Raises:
            UnknownName: There is no joint of that name.
        """
        if name not in self.joints:
            raise UnknownName("joint", name, self.joints)
        return self.joints.index(name) + 1

    def velocity_index(self, joint: str) -> slice:
        """Return the slice of v that holds the velocities of a joint.

        Args:
            joint: Name of the joint.

        Raises:
            UnknownName: There is no joint of that name.
        """
        return velocity_slice(self.model.joints[self.joint_id(joint)])

    def support(self, frame: str) -> IntArray:
        """Return the columns of the Jacobian that move a frame.

        Args:
            frame: Name of the frame.

        Returns:
            (k,) indices into v, in increasing order.

        Raises:
            UnknownName: There is no frame of that name.
        """
        joint = self.model.frames[self.frame_id(frame)].parentJoint
        columns = np.arange(self.nv, dtype=np.int64)
        chain = [columns[velocity_slice(self.model.joints[i])] for i in self.model.supports[joint]]
        return np.concatenate(chain)

    def posture(self, name: str | Mapping[str, float]) -> Array:
        """Return a copy of a named posture, or the posture in which joints have given values.

        Args:
            name: "neutral", "middle", or a name from the robot's SRDF; or a mapping from joint to number, see
                `checked_q`.

        Returns:
            q (nq,) [rad, m].

        Raises:
            UnknownName: There is no posture, or no joint, of that name.
            InvalidValue: A joint of the mapping has not one coordinate, or its value is not finite.
        """
        if isinstance(name, Mapping):
            return self._by_joint(name)
        if not isinstance(name, str) or name not in self.postures:
            raise UnknownName("posture", str(name), self.postures)
        return self.postures[name].copy()

    def lock(self, names: Iterable[str], q: ArrayLike | None = None) -> "Robot":
        """Make a robot in which some joints are fixed.

        Args:
            names: Names of the joints to fix.
            q: Posture (nq,) [rad, m] at which they are fixed; default: Pinocchio's neutral one, each joint
                moved to the nearest value inside its limits.

        Returns:
            A new robot without these joints; the robot itself if no joint is named.

        Raises:
            UnknownName: There is no joint of that name.
            InvalidValue: q does not fit the robot, or `names` are no names.
        """
        ids = [self.joint_id(name) for name in names_in("lock", names)]
        if not ids:
            return self
        held = self._inside(self.neutral) if q is None else self.checked_q(q)
        return Robot.from_parts(self.parts.locked(ids, held))

    @property
    def parts(self) -> Parts:
        """The parts of the robot, of which `from_parts` makes an equal robot."""
        postures = {key: posture for key, posture in self.postures.items() if key not in ALWAYS}
        return Parts(
            self.model,
            self._geometry,
            self._visual,
            self.name,
            postures,
            self.couplings,
            self.dropped,
            self._acceleration,
        )

    def __reduce__(self) -> tuple[Callable[[Parts], "Robot"], tuple[Parts]]:
        return Robot.from_parts, (self.parts,)

    def __copy__(self) -> "Robot":
        return self

    def __deepcopy__(self, memo: dict[int, object]) -> "Robot":
        return self  # a robot holds no state

    def with_frame(self, name: str, parent: str, pose: ArrayLike | Homogeneous) -> "Robot":
        """Make a robot with an additional frame, such as the tip of a tool.

        Args:
            name: Name of the new frame.
            parent: Name of the frame to which it is fixed.
            pose: Pose in the parent [m], in any of the forms of a target: (4, 4), `pin.SE3`, position (3,),
                or position and quaternion.

        Returns:
            A new robot.

        Raises:
            UnknownName: There is no frame `parent`.
            InvalidValue: There is a frame of that name already, or the pose is not a rigid-body pose.
        """
        if name in self.frames:
            raise InvalidValue(f"{self.name} has a frame '{name}' already; give the new one another name")
        place = as_pose(f"pose of '{name}'", pose, np.eye(4))
        return Robot.from_parts(with_frame(self.parts, name, self.frame_id(parent), place))

    def with_limits(
        self,
        *,
        position: Mapping[str, tuple[float, float]] | None = None,
        velocity: Mapping[str, float] | None = None,
        acceleration: Mapping[str, float] | None = None,
        margin: float | Mapping[str, float] = 0.0,
    ) -> "Robot":
        """Make a robot with tighter limits.

        Args:
            position: New q_min and q_max of joints [rad, m], by name; each lies inside the present range.
            velocity: New v_max of joints [rad/s, m/s], by name; each is at most the present one.
            acceleration: New a_max of joints [rad/s², m/s²], by name; each is at most the present one. They
                are what `JointAccelerationLimit()` keeps.
            margin: Amount by which both ends of the ranges move inwards [rad, m], for all joints or by name
                of joint.

        Returns:
            A new robot; its postures are moved into the new ranges.

        Raises:
            UnknownName: There is no joint of that name.
            InvalidValue: A limit is wider than the present one, no range is left, or the joint has no single
                coordinate that could have a limit.
        """
        limits = TighterLimits(position or {}, velocity or {}, acceleration or {}, margin)
        return Robot.from_parts(with_limits(self.parts, limits))

    def without_collision(self, *links: str | tuple[str, str]) -> "Robot":
        """Make a robot in which pairs of links are not checked for collision with each other.

        Args:
            links: Pairs of names of links; or single names, which leave out all pairs of that link.

        Returns:
            A new robot; its shapes are still loaded on first use only.

        Raises:
            UnknownName: There is no link of that name.
            InvalidValue: An entry is neither a name nor a pair of names.
        """
        pairs = [(named,) if isinstance(named, str) else tuple(named) for named in links]
        for pair in pairs:
            if len(pair) not in (1, 2):
                raise InvalidValue(f"links must be names, or pairs of names, got {pair!r}")
            for name in pair:
                self.frame_id(name)
        return Robot.from_parts(without_collision(self.parts, frozenset(map(frozenset, pairs))))

    def require_unchanged(self) -> None:
        """Check that the limits and the tree of the model were not changed after the robot was made.

        Limits are read once, when the robot is made. Frames may be added at any time.

        Raises:
            InvalidValue: Numbers of `robot.model` differ from those that were read.
        """
        for what, before, now in zip(NUMBERS, self._read, numbers_of(self.model), strict=True):
            if before.shape != now.shape or not np.allclose(before, now, MODEL_UNCHANGED, MODEL_UNCHANGED):
                raise InvalidValue(
                    f"{what} of the model of {self.name} was changed after the robot was made, which read it "
                    "then; use robot.with_limits(...), or make a new Robot of the changed pin.Model"
                )

    def checked_q(self, q: ArrayLike | Mapping[str, float]) -> Array:
        """Check a configuration that a user gave, and return a copy with normalised quaternions.

        Args:
            q: Configuration (nq,) [rad, m]; the name of a posture; or a mapping from joint to number, in
                which joints that are not named are at Pinocchio's neutral value, moved into their limits.

        Returns:
            A new array (nq,).

        Raises:
            InvalidValue: q has the wrong size, a number that is not finite, or a quaternion (or cosine and
                sine) whose norm is not 1; or a joint of a mapping has not one coordinate.
            UnknownName: There is no joint or posture of that name.
        """
        if isinstance(q, str | Mapping):
            return self.posture(q)
        out = finite(f"q of {self.name}", q, (self.nq,))
        for joint, part in self._unit_norm:
            norm = float(np.linalg.norm(out[part]))
            if abs(norm - 1.0) > UNIT_NORM:
                what = "a unit quaternion" if part.stop - part.start == 4 else "cosine and sine"
                raise InvalidValue(
                    f"q[{part.start}:{part.stop}] of {joint} must be {what}, got norm {norm:g}; normalise it"
                )
            out[part] /= norm
        return out

    def _by_joint(self, values: Mapping[str, float]) -> Array:
        """Return the configuration (nq,) in which the joints named have the numbers given [rad, m]."""
        out = self._inside(self.neutral)
        for name, value in values.items():
            joint = self.model.joints[self.joint_id(name)]
            number = finite(f"q of {name}", value, ())
            if joint.nv != 1:
                raise InvalidValue(
                    f"{name} has {joint.nq} coordinates, and cannot be set by one number; give q of "
                    f"{self.name} as an array"
                )
            place = slice(joint.idx_q, joint.idx_q + joint.nq)
            out[place] = number if joint.nq == 1 else (np.cos(number), np.sin(number))
        return self.coupled(out)

    def coupled(self, q: Array) -> Array:
        """Move coupled joints to the values that follow from their leaders.

        Args:
            q: Configuration (nq,) [rad, m].

        Returns:
            A new configuration (nq,) that satisfies the couplings; q itself for a robot without couplings.
        """
        return coupled(self.model, self.couplings, q)

    @cached_property
    def mass(self) -> float:
        """Mass of all links together [kg]; 0 for a robot whose links have no inertia."""
        return float(pin.computeTotalMass(self.model))

    def carried(self) -> tuple[IntArray, Array]:
        """Return the tree of joints and the bodies that they carry.

        Returns:
            Parent of each joint (joints + 1,), with the world as joint 0; and (joints + 1, 4): mass of the
            body that the joint carries [kg], and the centre of that mass in the joint's frame [m].
        """
        bodies = np.array([[body.mass, *body.lever] for body in self.model.inertias])
        bodies[0] = 0.0  # what is fixed to the world moves no centre of mass
        return np.array(self.model.parents, dtype=np.int64), bodies

    def integrate(self, q: Array, v: Array, dt: float) -> Array:
        """Take one Euler step on the configuration manifold and return q ⊕ v dt.

        Args:
            q: Configuration (nq,) [rad, m].
            v: Velocity (nv,) [rad/s, m/s].
            dt: Time step [s].

        Returns:
            The configuration (nq,) after the step.

        Raises:
            InvalidValue: q or v has the wrong size, or something is no number, or too large for a float.

        Source:
            (3.48).
        """
        try:
            return pin.integrate(self.model, q, v * dt)
        except (ValueError, TypeError, OverflowError):  # a check before each step would cost as much
            q, v = finite(f"q of {self.name}", q, (self.nq,)), finite(f"v of {self.name}", v, (self.nv,))
            return pin.integrate(self.model, q, v * float(finite("dt of a step", dt, ())))

    def difference(self, q0: Array, q1: Array) -> Array:
        """Compute the velocity that leads from q0 to q1 in unit time: q0 ⊕ difference(q0, q1) = q1.

        Args:
            q0: Configuration (nq,) [rad, m].
            q1: Configuration (nq,) [rad, m].

        Returns:
            (nv,) [rad/s, m/s].
        """
        return pin.difference(self.model, q0, q1)

    def difference_rates(self, q0: Array, q1: Array) -> tuple[Array, Array]:
        """Compute the derivatives of `difference(q0, q1)`.

        Args:
            q0: Configuration (nq,) [rad, m].
            q1: Configuration (nq,) [rad, m].

        Returns:
            (nv, nv) derivative along the tangent at q0, and (nv, nv) derivative along the tangent at q1.
        """
        from_q0, from_q1 = pin.dDifference(self.model, q0, q1)
        return from_q0, from_q1

    def outside(self, q: Array, tolerance: float = JOINT_RANGE) -> tuple[str, ...]:
        """List the joints that are outside their position limits.

        Args:
            q: Configuration (nq,) [rad, m].
            tolerance: Violation up to which a joint still counts as inside [rad, m].

        Returns:
            One sentence for each joint outside its limits.
        """
        has = self.position_index >= 0
        value = np.where(has, q[self.position_index], 0.0)
        wrong = has & ((value < self.position_lower - tolerance) | (value > self.position_upper + tolerance))
        return tuple(
            f"{self.velocity_names[i]} at {value[i]:.6g} {self.coordinate_units[i]}, "
            f"allowed {self.position_lower[i]:.6g} to {self.position_upper[i]:.6g}"
            for i in np.flatnonzero(wrong)
        )

    def _inside(self, q: Array) -> Array:
        """Move a configuration (nq,) into the position limits."""
        out, has = q.copy(), self.position_index >= 0
        places = self.position_index[has]
        out[places] = np.clip(out[places], self.position_lower[has], self.position_upper[has])
        return self.coupled(out)

    def _middle(self) -> Array:
        """Return the posture (nq,) in the middle of all two-sided ranges.

        Joints without such a range are at neutral, moved into a one-sided limit if there is one.
        """
        out = self._inside(self.neutral)
        two_sided = np.isfinite(self.position_lower) & np.isfinite(self.position_upper)
        middle = 0.5 * (self.position_lower[two_sided] + self.position_upper[two_sided])
        out[self.position_index[two_sided]] = middle
        return _frozen(self.coupled(out))


def _check(model: Model) -> None:
    """Raise `InvalidValue` unless a robot can be made from a model."""
    if not isinstance(model, pin.Model):
        raise InvalidValue(
            f"a robot is made from a pin.Model, got {model!r}; for a name use Robot.load, for a file "
            "Robot.from_urdf"
        )
    if model.nv == 0:
        raise InvalidValue(
            "a robot needs a joint that moves, and this pin.Model has none; Pinocchio ignores <include> "
            "of an MJCF file, which Robot.from_mjcf resolves"
        )


def _frozen(array: Array) -> Array:
    """Make an array read-only."""
    array.setflags(write=False)
    return array
