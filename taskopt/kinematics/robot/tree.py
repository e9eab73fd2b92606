"""A robot as plain data for JSON, and the robot again: what a log keeps so that it can be drawn anywhere.

The data have joints, frames and limits, and the shapes of arms that were made in code. Meshes are not copied:
a robot of a name that `taskopt list` shows gets those of its files, any other one a capsule along each link.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from taskopt.arrays import NO_BOUND, Array
from taskopt.errors import BadLog
from taskopt.hierarchy.tolerances import SAME_POINT
from taskopt.kinematics.engine import GeometryModel, JointModel, Model
from taskopt.kinematics.geometry.coal import add_capsule
from taskopt.kinematics.robot.named import robot_names
from taskopt.kinematics.robot.robot import Robot

_KINDS = (
    "JointModelRX", "JointModelRY", "JointModelRZ", "JointModelPX", "JointModelPY", "JointModelPZ",
    "JointModelRUBX", "JointModelRUBY", "JointModelRUBZ", "JointModelFreeFlyer", "JointModelPlanar",
    "JointModelSpherical", "JointModelTranslation",
)  # fmt: skip
_WITH_AXIS = (
    "JointModelRevoluteUnaligned", "JointModelPrismaticUnaligned", "JointModelRevoluteUnboundedUnaligned",
)  # fmt: skip
_SIZES = {  # attributes of Coal's shapes, with the factors that make arguments of their constructors of them
    "Sphere": {"radius": 1.0},
    "Capsule": {"radius": 1.0, "halfLength": 2.0},
    "Cylinder": {"radius": 1.0, "halfLength": 2.0},
    "Box": {"halfSide": 2.0},
}
_LINK = 0.05  # radius of a capsule along a link, as a share of the longest link

Tree = Mapping[str, Any]


def tree_of(robot: Robot) -> dict[str, Any]:
    """Describe a robot by plain data.

    Args:
        robot: The robot; its meshes are not loaded.

    Returns:
        Name, joints, frames and plain shapes; numbers are kept to the last bit.
    """
    model = robot.model
    joints = [_joint(model, i) for i in range(1, model.njoints)]
    frames = [
        {
            "name": frame.name,
            "joint": int(frame.parentJoint),
            "frame": int(frame.parentFrame),
            "pose": _pose(frame.placement),
            "type": frame.type.name,
        }
        for frame in list(model.frames)[1:]
    ]
    parts = robot.parts
    held = parts.geometry if parts.visual is None else parts.visual
    shapes = [] if held is None or callable(held) else list(_plain_shapes(held))
    return {"name": robot.name, "joints": joints, "frames": frames, "shapes": shapes}


def robot_of(tree: Tree) -> Robot:
    """Make a robot again from its data.

    Args:
        tree: What `tree_of` returned, perhaps through JSON.

    Returns:
        A robot with the same joints, frames and limits of position and speed.

    Raises:
        BadLog: The data have a kind of joint that is not known here.
    """
    model = pin.Model()
    model.name = tree["name"]
    for joint in tree["joints"]:
        velocity, lower, upper = (np.array(joint[name]) for name in ("velocity", "lower", "upper"))
        model.addJoint(
            joint["parent"], _made(joint), _se3(joint["pose"]), joint["name"],
            np.full(velocity.size, NO_BOUND), velocity, lower, upper,
        )  # fmt: skip
    model.lowerVelocityLimit[:] = -model.upperVelocityLimit
    for frame in tree["frames"]:
        kind = getattr(pin.FrameType, frame["type"])
        model.addFrame(
            pin.Frame(frame["name"], frame["joint"], frame["frame"], _se3(frame["pose"]), kind), False
        )
    if tree["shapes"]:
        return Robot(model, _shapes(tree["shapes"]), name=tree["name"])
    named = _of_that_name(tree["name"], model)
    return named or Robot(model, _along_links(model), name=tree["name"])


def _joint(model: Model, i: int) -> dict[str, Any]:
    """Describe one joint."""
    joint = model.joints[i]
    kind, q = joint.shortname(), slice(joint.idx_q, joint.idx_q + joint.nq)
    about = {
        "name": model.names[i],
        "kind": kind,
        "parent": int(model.parents[i]),
        "pose": _pose(model.jointPlacements[i]),
        "lower": _finite(model.lowerPositionLimit[q]),
        "upper": _finite(model.upperPositionLimit[q]),
        "velocity": _finite(model.upperVelocityLimit[joint.idx_v : joint.idx_v + joint.nv]),
    }
    return about | {"axis": np.ravel(joint.extract().axis).tolist()} if kind in _WITH_AXIS else about


def _made(joint: Mapping[str, Any]) -> JointModel:
    """Make one joint."""
    if joint["kind"] in _KINDS:
        return getattr(pin, joint["kind"])()
    if joint["kind"] in _WITH_AXIS:
        return getattr(pin, joint["kind"])(np.array(joint["axis"]))
    raise BadLog(f"joint {joint['name']} is a {joint['kind']}, which cannot be made again from a log")


def _of_that_name(name: str, model: Model) -> Robot | None:
    """Load the robot of a name, with its meshes, if it is known and has the same tree."""
    if name not in robot_names():
        return None
    whole, kept = Robot.load(name), set(model.names)
    robot = whole.lock([joint for joint in whole.joints if joint not in kept])
    places = [[pose.homogeneous for pose in tree.jointPlacements] for tree in (model, robot.model)]
    same = list(model.names) == list(robot.model.names)
    return robot if same and np.allclose(*places, rtol=0.0, atol=SAME_POINT) else None


def _plain_shapes(shapes: GeometryModel) -> Iterator[dict[str, Any]]:
    """Yield spheres, capsules, cylinders and boxes as data, with sizes as Coal's constructors take them."""
    for shape in shapes.geometryObjects:
        kind, form = type(shape.geometry).__name__, shape.geometry
        if kind in _SIZES:
            sizes = [factor * np.ravel(getattr(form, name)) for name, factor in _SIZES[kind].items()]
            yield {
                "name": shape.name,
                "joint": int(shape.parentJoint),
                "pose": _pose(shape.placement),
                "kind": kind,
                "sizes": np.concatenate(sizes).tolist(),
                "colour": np.ravel(shape.meshColor).tolist(),
            }


def _shapes(known: Iterable[Mapping[str, Any]]) -> GeometryModel:
    """Make the shapes that `_plain_shapes` described."""
    shapes = pin.GeometryModel()
    for one in known:
        form = getattr(coal, one["kind"])(*one["sizes"])
        shape = pin.GeometryObject(one["name"], one["joint"], _se3(one["pose"]), form)
        shape.meshColor = np.array(one["colour"])
        shapes.addGeometryObject(shape)
    return shapes


def _along_links(model: Model) -> GeometryModel:
    """Return a capsule from each joint to the next ones, and to the frames of bodies."""
    ends = [(int(model.parents[i]), model.jointPlacements[i].translation) for i in range(1, model.njoints)]
    ends += [(f.parentJoint, f.placement.translation) for f in model.frames if f.type == pin.FrameType.BODY]
    longest = max((float(np.linalg.norm(end)) for _, end in ends), default=0.0)
    shapes = pin.GeometryModel()
    for number, (joint, end) in enumerate(ends):
        if np.linalg.norm(end) > _LINK * longest:
            add_capsule(shapes, f"link {number}", joint, np.zeros(3), end, _LINK * longest)
    return shapes


def _pose(pose: pin.SE3) -> list[list[float]]:
    """Return a pose (4, 4) [m] as lists."""
    return pose.homogeneous.tolist()


def _se3(pose: list[list[float]]) -> pin.SE3:
    """Return a pose of Pinocchio, with the entries as they are."""
    entries = np.array(pose)
    return pin.SE3(entries[:3, :3], entries[:3, 3])


def _finite(limits: Array) -> list[float]:
    """Return limits as numbers that JSON has; what is no limit becomes a large number."""
    return np.clip(limits, -NO_BOUND, NO_BOUND).tolist()
