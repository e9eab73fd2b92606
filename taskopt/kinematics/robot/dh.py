"""Chains from Denavit–Hartenberg rows, with capsules as links."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import SAME_POINT
from taskopt.kinematics.engine import Model
from taskopt.kinematics.geometry.coal import add_capsule
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot.parts import Parts


@dataclass(frozen=True)
class DHRow:
    """One row of the classic Denavit–Hartenberg table, A = Rz(ϑ) Tz(d) Tx(a) Rx(α).

    The joint adds its coordinate to ϑ if it is revolute, and to d if it is prismatic.

    Attributes:
        a: [m].
        alpha: α [rad].
        d: [m].
        theta: ϑ [rad].
        joint: "revolute" or "prismatic".
        lower: Lower position limit [rad or m]; −inf is none.
        upper: Upper position limit [rad or m]; +inf is none.
        velocity: Velocity limit [rad/s or m/s]; +inf is none.

    Source: (2.52) of the textbook.
    """

    a: float
    alpha: float
    d: float
    theta: float
    joint: Literal["revolute", "prismatic"] = "revolute"
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf

    def __post_init__(self) -> None:
        if self.joint not in ("revolute", "prismatic"):
            raise InvalidValue(f"joint must be 'revolute' or 'prismatic', got {self.joint!r}")
        if not np.isfinite([self.a, self.alpha, self.d, self.theta]).all():
            raise InvalidValue(f"a, alpha, d and theta must be finite, got {self}")
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
        radius: Of the capsules [m]; default: 6 % of the longest length.

    Returns:
        The parts of the robot.

    Raises:
        InvalidValue: There is no row, a pose is none, or the radius is not positive.
    """
    if not rows:
        raise InvalidValue("an arm needs at least one Denavit–Hartenberg row")
    if radius is None:
        radius = 0.06 * max([abs(r.a) for r in rows] + [abs(r.d) for r in rows]) or 0.03
    radius = positive("radius", radius)
    model, shapes = pin.Model(), pin.GeometryModel()
    model.name = name
    joint, placement = 0, np.eye(4) if base is None else checked_pose("base", base)
    for i, row in enumerate(rows, start=1):
        joint = _add_joint(model, joint, placement, f"joint{i}", row)
        placement = row.constant
        _add_frame(model, f"link{i}", joint, placement)
        corner = np.array([0.0, 0.0, row.d])
        ends = (np.zeros(3), corner), (corner, placement[:3, 3])
        pieces = [piece for piece in ends if np.linalg.norm(piece[1] - piece[0]) > SAME_POINT]
        for k, (start, stop) in enumerate(pieces or [(corner, corner)]):
            add_capsule(shapes, f"link{i}_{k}", joint, start, stop, radius)
    tip = np.eye(4) if tool is None else checked_pose("tool", tool)
    _add_frame(model, "tip", joint, placement @ tip)
    return Parts(model, shapes, None, name)


def _add_joint(model: Model, parent: int, placement: Array, name: str, row: DHRow) -> int:
    """Add the joint of a row at a pose (4, 4) in its parent; return its index."""
    kind = pin.JointModelRZ() if row.joint == "revolute" else pin.JointModelPZ()
    limits = (np.array([x]) for x in (np.inf, row.velocity, row.lower, row.upper))
    joint = model.addJoint(parent, kind, pin.SE3(placement), name, *limits)
    model.addJointFrame(joint, 0 if parent == 0 else model.getFrameId(model.names[parent]))
    return joint


def _add_frame(model: Model, name: str, joint: int, placement: Array) -> None:
    """Add a body frame at a pose (4, 4) in its joint."""
    parent_frame = model.getFrameId(model.names[joint])
    model.addFrame(pin.Frame(name, joint, parent_frame, pin.SE3(placement), pin.FrameType.BODY))
