"""The parts of a robot, which every reader of robots returns, and locking of joints in them."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from typing_extensions import TypeAliasType

from taskopt.arrays import Array
from taskopt.kinematics.engine import GeometryModel, Model
from taskopt.kinematics.robot.couplings import Coupling, coupled
from taskopt.kinematics.robot.rebuild import Rebuilt, has_turning_axes, rebuilt

Shapes = TypeAliasType("Shapes", GeometryModel | Callable[[], GeometryModel] | None)
"""Shapes, or a function that loads them on first use, or None for no shapes."""

ALWAYS = ("neutral", "middle")
"""Names of the postures that every robot has."""


class Lazy:
    """Shapes that a function loads at their first use.

    Function and arguments are stored, since a closure could not be pickled. A pickle contains these and not
    the shapes, so that a robot that is sent to another process reads its meshes there.

    Args:
        load: A function at the top level of a module.
        arguments: Arguments of the function.
    """

    def __init__(self, load: Callable[..., GeometryModel], *arguments: object) -> None:
        self._load, self._arguments = load, arguments
        self._loaded: GeometryModel | None = None

    def __call__(self) -> GeometryModel:
        """Return the shapes.

        Returns:
            The shapes, the same at each call.
        """
        if self._loaded is None:
            self._loaded = self._load(*self._arguments)
        return self._loaded

    def __reduce__(self) -> tuple[type["Lazy"], tuple[object, ...]]:
        return Lazy, (self._load, *self._arguments)


@dataclass(frozen=True)
class Parts:
    """Tree, shapes and named postures of a robot.

    Attributes:
        model: The kinematic tree.
        geometry: Collision shapes, or a function that loads them.
        visual: Shapes to draw, or a function that loads them; None: the collision shapes.
        name: Name of the robot.
        postures: Mapping from name to posture (nq,) [rad, m].
        couplings: Couplings of joints; their leaders follow no joint.
        dropped: One sentence for each statement of the file that the robot cannot represent.
        acceleration: Largest acceleration of joints that have a limit [rad/s², m/s²], by name.
    """

    model: Model
    geometry: Shapes = None
    visual: Shapes = None
    name: str = "robot"
    postures: Mapping[str, Array] = field(default_factory=dict)
    couplings: tuple[Coupling, ...] = ()
    dropped: tuple[str, ...] = ()
    acceleration: Mapping[str, float] = field(default_factory=dict)

    def locked(self, ids: Sequence[int], q: Array) -> "Parts":
        """Make the parts of a robot in which some joints are fixed.

        A joint that is coupled to one of them is fixed, too, at the value that the coupling gives.

        Args:
            ids: Pinocchio's indices of the joints to fix.
            q: Configuration (nq,) [rad, m] at which they are fixed.

        Returns:
            New parts; shapes are still loaded on first use only.
        """
        if not _can_be_reduced(self.model):
            return self._rebuilt({}).locked(ids, q)
        model, fixed = self.model, self._coupled_to(ids)
        held = coupled(self.model, self.couplings, q)
        names = {self.model.names[i] for i in fixed}

        return Parts(
            pin.buildReducedModel(model, fixed, held),
            Lazy(_reduced, model, self.geometry, fixed, held),
            None if self.visual is None else Lazy(_reduced, model, self.visual, fixed, held),
            self.name,
            {name: self._kept(posture, fixed) for name, posture in self.postures.items()},
            tuple(coupling for coupling in self.couplings if coupling.leader not in names),
            self.dropped,
            {name: most for name, most in self.acceleration.items() if name not in names},
        )

    def with_still_axes(self, names: Mapping[str, Sequence[str]]) -> "Parts":
        """Split the joints whose axes turn with their own coordinates into joints with one axis each.

        Args:
            names: Mapping from a joint that is split to the names of its axes. Axes of a joint that is not
                named get its name and a number.

        Returns:
            Parts with the same coordinates; these parts themselves if there is no such joint.

        Raises:
            InvalidValue: A joint can neither be kept nor split, or its axes have names in its file that
                `names` lacks.
        """
        return self._rebuilt(names) if has_turning_axes(self.model) else self

    def _rebuilt(self, names: Mapping[str, Sequence[str]]) -> "Parts":
        """Build the tree anew; the shapes are still loaded on first use only."""
        new = rebuilt(self.model, names)
        geometry, visual = (
            None if shapes is None else Lazy(_moved, new, shapes) for shapes in (self.geometry, self.visual)
        )
        return replace(self, model=new.model, geometry=geometry, visual=visual)

    def _coupled_to(self, ids: Sequence[int]) -> list[int]:
        """Return the sorted indices of some joints and of all joints that are coupled to them."""
        names = {self.model.names[i] for i in ids}
        leaders = {c.leader for c in self.couplings if names & {c.leader, c.follower}}
        names |= leaders | {c.follower for c in self.couplings if c.leader in leaders}
        return [i for i, name in enumerate(self.model.names) if i > 0 and name in names]

    def _kept(self, q: Array, ids: Sequence[int]) -> Array:
        """Return the part of a configuration that belongs to the joints that are not fixed."""
        joints = [joint for i, joint in enumerate(self.model.joints) if i > 0 and i not in ids]
        return np.concatenate([np.empty(0), *(q[j.idx_q : j.idx_q + j.nq] for j in joints)])


def _can_be_reduced(model: Model) -> bool:
    """Return True if Pinocchio can fix joints: each has a frame, and no lower limit is above its upper one.

    A joint that was added without limits has a lower limit of speed of +1.8e308 in Pinocchio 4.1.
    """
    frames = all(model.existFrame(name, pin.FrameType.JOINT) for name in list(model.names)[1:])
    return frames and bool((model.lowerVelocityLimit <= model.upperVelocityLimit).all())


def _reduced(model: Model, shapes: Shapes, fixed: list[int], q: Array) -> GeometryModel:
    """Return the shapes of a tree in which joints are fixed at q."""
    return pin.buildReducedModel(model, _with_frames(model, shapes), fixed, q)[1]


def _moved(new: Rebuilt, shapes: Shapes) -> GeometryModel:
    """Return the shapes of a rebuilt tree."""
    return new.moved(loaded(shapes))


def _with_frames(model: Model, shapes: Shapes) -> GeometryModel:
    """Copy the shapes with a parent frame for each, since Pinocchio crashes on shapes without one."""
    out = pin.GeometryModel(loaded(shapes))
    for shape in out.geometryObjects:
        if shape.parentFrame >= model.nframes:
            shape.parentFrame = model.getFrameId(model.names[shape.parentJoint], pin.FrameType.JOINT)
    return out


def loaded(shapes: Shapes) -> GeometryModel:
    """Load shapes if they are not loaded yet.

    Args:
        shapes: The shapes, a function that loads them, or None.

    Returns:
        The shapes (`pin.GeometryModel`); an empty model for None.
    """
    if shapes is None:
        return pin.GeometryModel()
    return shapes() if callable(shapes) else shapes


def link_of(shape: str) -> str:
    """Return the name of the link to which a shape belongs.

    Args:
        shape: Name of the shape, which is that of its link with a number, as in link_0 and link_1.

    Returns:
        The name of the link.
    """
    return re.sub(r"_\d+$", "", shape)
