"""Chains from Denavit–Hartenberg rows, with capsules as links."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import SAME_POINT
from taskopt.kinematics.engine import GeometryModel, Model
from taskopt.kinematics.geometry.coal import add_capsule
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot.parts import Parts


@dataclass(frozen=True)
class DHRow:
    """One row of the classic Denavit–Hartenberg table, A = Rz(ϑ) Tz(d) Tx(a) Rx(α).

    The joint adds its coordinate to ϑ if it is revolute, and to d if it is prismatic.

    Attributes:
        a: Distance along the new x axis [m].
        alpha: Angle α about the new x axis [rad].
        d: Distance along the old z axis [m].
        theta: Angle ϑ about the old z axis [rad].
        joint: "revolute" or "prismatic".
        rod: Length of the rod that a prismatic joint slides [m]. The rod is a piece of the link, from the
            origin of the new frame along its z axis; it points backwards if the length is negative, and 0
            means no rod.
        lower: Lower position limit [rad or m]; −inf means no limit.
        upper: Upper position limit [rad or m]; +inf means no limit.
        velocity: Velocity limit [rad/s or m/s]; +inf means no limit.

    Source:
        (2.52) of the textbook.
    """

    a: float
    alpha: float
    d: float
    theta: float
    joint: Literal["revolute", "prismatic"] = "revolute"
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    rod: float = 0.0

    def __post_init__(self) -> None:
        if self.joint not in ("revolute", "prismatic"):
            raise InvalidValue(f"joint must be 'revolute' or 'prismatic', got {self.joint!r}")
        for field in ("a", "alpha", "d", "theta", "rod"):
            finite(f"{field} of a Denavit–Hartenberg row", vars(self)[field], ())
        if not self.lower <= self.upper:
            raise InvalidValue(f"lower must be ≤ upper, got {self.lower} and {self.upper}")
        if not self.velocity > 0.0:
            raise InvalidValue(f"velocity must be > 0, got {self.velocity}; inf is no limit")

    @property
    def constant(self) -> Array:
        """Transform A (4, 4) at coordinate zero [m].

        Rz and Tz commute with the motion of either joint, so the joint may stand before this transform.
        """
        ct, st, ca, sa = np.cos(self.theta), np.sin(self.theta), np.cos(self.alpha), np.sin(self.alpha)
        return np.array(
            [
                [ct, -st * ca, st * sa, self.a * ct],
                [st, ct * ca, -ct * sa, self.a * st],
                [0.0, sa, ca, self.d],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )


def build_dh(
    rows: tuple[DHRow, ...],
    name: str,
    base: ArrayLike | None = None,
    tool: ArrayLike | None = None,
    radius: float | None = None,
) -> Parts:
    """Make the parts of a chain: its tree, and one capsule for each straight piece of a link.

    Args:
        rows: One row for each joint, from the base on.
        name: Name of the robot.
        base: (4, 4) pose of frame 0 in the world [m]; default: the identity.
        tool: (4, 4) pose of the frame "tip" in the last frame [m]; default: the identity.
        radius: Radius of the capsules [m]; default: 6 % of the longest length.

    Returns:
        The parts of the robot.

    Raises:
        InvalidValue: There is no row, a pose is invalid, or the radius is not positive.
    """
    if not rows:
        raise InvalidValue("an arm needs at least one Denavit–Hartenberg row")
    model, shapes = pin.Model(), pin.GeometryModel()
    model.name = name
    names = tuple(str(i) for i in range(1, len(rows) + 1))
    start = np.eye(4) if base is None else checked_pose("base", base)
    joint = add_chain(model, shapes, rows, names, start, default_radius(rows) if radius is None else radius)
    tip = np.eye(4) if tool is None else checked_pose("tool", tool)
    add_frame(model, "tip", joint, rows[-1].constant @ tip)
    return Parts(model, shapes, None, name)


def default_radius(rows: Sequence[DHRow]) -> float:
    """Choose the radius of the links of an arm.

    Args:
        rows: The rows of all links.

    Returns:
        6 % of the longest length [m], and 3 cm where all lengths are zero.
    """
    return 0.06 * max(abs(length) for row in rows for length in (row.a, row.d, row.rod)) or 0.03


def add_chain(
    model: Model,
    shapes: GeometryModel,
    rows: Sequence[DHRow],
    names: Sequence[str],
    start: Array,
    radius: float,
) -> int:
    """Add a chain of joints and links to a tree, from the base on.

    Args:
        model: The tree, to which the joints and frames are added.
        shapes: Its shapes, to which the capsules are added.
        rows: One row for each joint.
        names: Text that follows "joint" and "link" in the names, one for each joint.
        start: (4, 4) pose of the chain's frame 0 in the world [m].
        radius: Radius of the capsules [m].

    Returns:
        Index of the last joint.

    Raises:
        InvalidValue: The radius is not positive.
    """
    radius = positive("radius", radius)
    joint, placement = 0, start
    for name, row in zip(names, rows, strict=True):
        joint = _add_joint(model, joint, placement, f"joint{name}", row)
        placement = row.constant
        add_frame(model, f"link{name}", joint, placement)
        for k, (begin, end) in enumerate(_segments(row)):
            add_capsule(shapes, f"link{name}_{k}", joint, begin, end, radius)
    return joint


def _segments(row: DHRow) -> list[tuple[Array, Array]]:
    """Return the ends (3,) [m] of the straight pieces of a link, in the frame of its joint."""
    corner, end = np.array([0.0, 0.0, row.d]), row.constant[:3, 3]
    pieces = [(np.zeros(3), corner), (corner, end), (end, end + row.rod * row.constant[:3, 2])]
    return [piece for piece in pieces if np.linalg.norm(piece[1] - piece[0]) > SAME_POINT] or [
        (corner, corner)
    ]


def _add_joint(model: Model, parent: int, placement: Array, name: str, row: DHRow) -> int:
    """Add the joint of a row at a pose (4, 4) in its parent; return its index."""
    kind = pin.JointModelRZ() if row.joint == "revolute" else pin.JointModelPZ()
    limits = (np.array([x]) for x in (np.inf, row.velocity, row.lower, row.upper))
    joint = model.addJoint(parent, kind, pin.SE3(placement), name, *limits)
    model.addJointFrame(joint, 0 if parent == 0 else model.getFrameId(model.names[parent]))
    return joint


def add_frame(model: Model, name: str, joint: int, placement: Array) -> None:
    """Add a body frame to a tree.

    Args:
        model: The tree.
        name: Name of the frame.
        joint: Index of the joint that carries it.
        placement: (4, 4) pose of the frame in that joint [m].
    """
    parent_frame = model.getFrameId(model.names[joint])
    model.addFrame(pin.Frame(name, joint, parent_frame, pin.SE3(placement), pin.FrameType.BODY))
