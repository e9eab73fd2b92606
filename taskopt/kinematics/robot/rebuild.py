"""Trees that are rebuilt so that every joint has a frame, and axes that are constant in it.

Jacobian derivatives hold for joints whose axes are constant in their own frame. A composite or universal
joint, or one of Euler angles, has axes that turn with its own coordinates. It becomes a chain of joints with
one axis each and links without mass in between. The chain has the same coordinates and velocities in the same
order.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from taskopt.arrays import IntArray
from taskopt.errors import InvalidValue
from taskopt.kinematics.engine import GeometryModel, JointModel, Model

_CONSTANT_AXES = (
    "JointModelR", "JointModelP", "JointModelH", "JointModelFreeFlyer", "JointModelSpherical",
    "JointModelTranslation",
)  # fmt: skip
_TURNING = ("JointModelComposite", "JointModelUniversal", "JointModelSphericalZYX")
_OF_MJCF = "Composite_"  # how Pinocchio begins the name of a body's joints, of which it keeps the first name
_Axes = list[tuple[JointModel, pin.SE3]]  # joints with one axis, each placed in the one before


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """A rebuilt tree, with a map from the old joints and frames to the new ones.

    Attributes:
        model: The new tree.
        joints: (joints + 1,) for each old joint the index of the new joint that carries its body.
        frames: (frames,) for each old frame the index of the new one.
    """

    model: Model
    joints: IntArray
    frames: IntArray

    def moved(self, shapes: GeometryModel) -> GeometryModel:
        """Copy shapes of the old tree, and fix them to the joints of the new tree.

        Args:
            shapes: Shapes fixed to joints of the old tree.

        Returns:
            The shapes, fixed to joints of the new tree.
        """
        out = pin.GeometryModel(shapes)
        for shape in out.geometryObjects:
            shape.parentJoint = int(self.joints[shape.parentJoint])
            if shape.parentFrame < len(self.frames):
                shape.parentFrame = int(self.frames[shape.parentFrame])
        return out


def has_turning_axes(model: Model) -> bool:
    """Return True if a joint of a tree has axes that turn with its own coordinates.

    Args:
        model: The tree.

    Returns:
        True if `rebuilt` would split a joint.

    Raises:
        InvalidValue: A joint is of a kind that can neither be kept nor split.
    """
    found = False
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        _split(joint, name)
        found = found or joint.shortname() in _TURNING
    return found


def rebuilt(model: Model, names: Mapping[str, Sequence[str]]) -> Rebuilt:
    """Rebuild a tree with joints whose axes are constant, and with a frame for each joint.

    Args:
        model: The tree, which stays as it is.
        names: Mapping from a joint that is split to the names of its axes. Axes of a joint that is not named
            get its name and a number, as in "shoulder_1".

    Returns:
        The new tree, with the coordinates and velocities of the old one.

    Raises:
        InvalidValue: A joint is of a kind that can neither be kept nor split; or the axes of a joint have
            names in its file, and `names` lacks them.
    """
    out = pin.Model()
    out.name, out.gravity = model.name, model.gravity
    joints = np.zeros(model.njoints, dtype=np.int64)
    frames = np.zeros(model.nframes, dtype=np.int64)
    for i in range(1, model.njoints):
        _add_axes(out, model, i, joints, names)
    _copy_numbers(out, model)
    for i, frame in enumerate(model.frames):
        if i > 0:
            frames[i] = _add_frame(out, frame, model.names, joints, frames)
    return Rebuilt(out, joints, frames)


def _add_axes(out: Model, model: Model, i: int, joints: IntArray, names: Mapping[str, Sequence[str]]) -> None:
    """Add the axes of joint i to the new tree, each with a frame, and its body to the last."""
    name, parent = model.names[i], int(joints[model.parents[i]])
    axes = _split(model.joints[i], name)
    placement = model.jointPlacements[i]
    for (kind, inner), own in zip(axes, _axis_names(name, len(axes), names), strict=True):
        frame_before = 0 if parent == 0 else out.getFrameId(out.names[parent], pin.FrameType.JOINT)
        parent = out.addJoint(parent, kind, placement * inner, own)
        out.addJointFrame(parent, frame_before)
        placement = pin.SE3.Identity()
    out.inertias[parent] = model.inertias[i]
    joints[i] = parent


def _axis_names(name: str, count: int, names: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the names of the axes of a joint."""
    if count == 1:
        return [name]
    if name in names:
        return list(names[name])
    if name.startswith(_OF_MJCF):
        raise InvalidValue(
            f"joint {name} stands for {count} joints of one body of an MJCF file, and only the name of the "
            "first is left in this pin.Model; read the file with Robot.from_mjcf(path), which keeps the names"
        )
    return [f"{name}_{k}" for k in range(1, count + 1)]


def _split(joint: JointModel, name: str) -> _Axes:
    """Split a joint into joints whose axes are constant; return the joint itself if its axes are constant."""
    kind = joint.shortname()
    whole, here = joint.extract(), pin.SE3.Identity()
    if kind == "JointModelComposite":
        out: _Axes = []
        for inner, placement in zip(whole.joints, whole.jointPlacements, strict=True):
            first, *rest = _split(inner, name)
            out += [(first[0], placement * first[1]), *rest]
        return out
    if kind == "JointModelUniversal":
        return [(pin.JointModelRevoluteUnaligned(axis), here) for axis in (whole.axis1, whole.axis2)]
    if kind == "JointModelSphericalZYX":
        return [(pin.JointModelRZ(), here), (pin.JointModelRY(), here), (pin.JointModelRX(), here)]
    if kind == "JointModelMimic":
        raise InvalidValue(f"joint {name} mimics another; load the model with mimic=False")
    if not kind.startswith(_CONSTANT_AXES):
        raise InvalidValue(
            f"joint {name} is a {kind}, whose axes turn with its own coordinates; make it of joints with one "
            "axis each"
        )
    return [(joint, here)]


def _copy_numbers(out: Model, model: Model) -> None:
    """Copy the limits of position and speed, which both trees hold in the same order."""
    out.lowerPositionLimit[:], out.upperPositionLimit[:] = model.lowerPositionLimit, model.upperPositionLimit
    out.upperVelocityLimit[:] = model.upperVelocityLimit
    out.lowerVelocityLimit[:] = -model.upperVelocityLimit


def _add_frame(out: Model, frame: pin.Frame, names: Sequence[str], joints: IntArray, frames: IntArray) -> int:
    """Add an old frame to the new tree, unless it is the frame of a joint; return its new index."""
    joint = int(joints[frame.parentJoint])
    of_joint = out.getFrameId(out.names[joint], pin.FrameType.JOINT) if joint else 0
    if frame.type == pin.FrameType.JOINT and frame.name == names[frame.parentJoint]:
        return of_joint
    before = int(frames[frame.parentFrame])
    if out.frames[before].parentJoint != joint:
        before = of_joint
    return out.addFrame(
        pin.Frame(frame.name, joint, before, frame.placement, frame.type, frame.inertia), False
    )
