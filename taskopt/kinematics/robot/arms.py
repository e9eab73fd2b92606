"""The arms of the textbook by their dimensions: Siciliano et al., Robotics, Sect. 2.9 and Figs 2.20–2.36.

Every limit is one number for all joints or one number for each joint (n,); ±inf means no limit. The frames of
an arm are the Denavit–Hartenberg frames, named link1, link2, …, and "tip". The default lengths are our own
choice, since the textbook gives symbols only.
"""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array, ArrayLike, bound, finite
from taskopt.errors import InvalidValue
from taskopt.kinematics.pose import homogeneous
from taskopt.kinematics.robot.dh import DHRow, add_chain, add_frame, build_dh, default_radius
from taskopt.kinematics.robot.parts import Parts

_QUARTER = 0.5 * np.pi
_Link = tuple[float, float, float, Literal["revolute", "prismatic"]]  # a [m], α [rad], d [m], joint


def planar_arm(
    lengths: Sequence[float] = (0.5, 0.5, 0.5),
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make an arm with parallel revolute joints, which moves in the x-y plane.

    With three links the tip is at x = a₁ c₁ + a₂ c₁₂ + a₃ c₁₂₃, and y is the same sum with sines.

    Args:
        lengths: Lengths a_i of the links [m], (n,).
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "planar" and the number of its links.

    Raises:
        InvalidValue: A length is not finite, or the limits do not fit.

    Source:
        Fig. 2.20 and (2.83) of the textbook; its Jacobian is (3.35), that of two links (3.40).
    """
    a = finite("lengths", lengths, (None,))
    rows: list[_Link] = [(length, 0.0, 0.0, "revolute") for length in a.tolist()]
    return _chain(f"planar{len(rows)}", rows, (lower, upper, velocity), radius)


def spherical_arm(
    d2: float = 0.2,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make an arm with two revolute joints and a prismatic one, q = (ϑ₁, ϑ₂, d₃).

    Args:
        d2: Offset of the second joint along its axis [m].
        lower: Lower position limits [rad, rad, m].
        upper: Upper position limits [rad, rad, m].
        velocity: Velocity limits [rad/s, rad/s, m/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "spherical".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.22 of the textbook; Problem 3.5.
    """
    rows: list[_Link] = [
        (0.0, -_QUARTER, 0.0, "revolute"),
        (0.0, _QUARTER, d2, "revolute"),
        (0.0, 0.0, 0.0, "prismatic"),
    ]
    return _chain("spherical", rows, (lower, upper, velocity), radius, rod=-0.5)


def cylindrical_arm(
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make an arm that turns about a column, slides along it, and reaches out: q = (ϑ₁, d₂, d₃).

    The tip is at p = (−d₃ s₁, d₃ c₁, d₂).

    Args:
        lower: Lower position limits [rad, m, m].
        upper: Upper position limits [rad, m, m].
        velocity: Velocity limits [rad/s, m/s, m/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "cylindrical".

    Raises:
        InvalidValue: The limits do not fit.

    Source:
        Fig. 2.35 of the textbook; Problems 3.2 and 3.6.
    """
    rows: list[_Link] = [
        (0.0, 0.0, 0.0, "revolute"),
        (0.0, -_QUARTER, 0.0, "prismatic"),
        (0.0, 0.0, 0.0, "prismatic"),
    ]
    return _chain("cylindrical", rows, (lower, upper, velocity), radius, rod=-0.5)


def scara(
    a1: float = 0.5,
    a2: float = 0.5,
    height: float = 1.0,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make a SCARA manipulator, q = (ϑ₁, ϑ₂, d₃, ϑ₄), with all axes upwards.

    The tip is at p = (a₁ c₁ + a₂ c₁₂, a₁ s₁ + a₂ s₁₂, height + d₃), turned by ϑ₁ + ϑ₂ + ϑ₄ about z.

    Args:
        a1: Length of the first link [m].
        a2: Length of the second link [m].
        height: Height of both links above the base [m]; where the tip is lower than that, d₃ is negative.
        lower: Lower position limits [rad, rad, m, rad].
        upper: Upper position limits [rad, rad, m, rad].
        velocity: Velocity limits [rad/s, rad/s, m/s, rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "scara".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.36 of the textbook; Problems 3.3, 3.7 and 3.22.
    """
    rows: list[_Link] = [
        (a1, 0.0, height, "revolute"),
        (a2, 0.0, 0.0, "revolute"),
        (0.0, 0.0, 0.0, "prismatic"),
        (0.0, 0.0, 0.0, "revolute"),
    ]
    return _chain("scara", rows, (lower, upper, velocity), radius, rod=height)


def anthropomorphic_arm(
    a2: float = 0.5,
    a3: float = 0.5,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make an arm with a base that turns, a shoulder and an elbow; at q = 0 it is stretched along x.

    The tip is at p = (c₁ (a₂ c₂ + a₃ c₂₃), s₁ (a₂ c₂ + a₃ c₂₃), a₂ s₂ + a₃ s₂₃).

    Args:
        a2: Length of the upper arm [m].
        a3: Length of the forearm [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "anthropomorphic".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.23 and (2.66) of the textbook; its Jacobian is (3.37).
    """
    rows: list[_Link] = [
        (0.0, _QUARTER, 0.0, "revolute"),
        (a2, 0.0, 0.0, "revolute"),
        (a3, 0.0, 0.0, "revolute"),
    ]
    return _chain("anthropomorphic", rows, (lower, upper, velocity), radius)


def spherical_wrist(
    d6: float = 0.1,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make a wrist of three axes that meet in a point; its joints are the ZYZ angles of the tip.

    Args:
        d6: Distance of the tip from the point where the axes meet [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The wrist, named "spherical_wrist".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.24 of the textbook; Fig. 3.4.
    """
    return _chain("spherical_wrist", _wrist(d6), (lower, upper, velocity), radius)


def stanford_manipulator(
    d2: float = 0.2,
    d6: float = 0.1,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make a spherical arm with a spherical wrist, q = (ϑ₁, ϑ₂, d₃, ϑ₄, ϑ₅, ϑ₆).

    Args:
        d2: Offset of the second joint along its axis [m].
        d6: Distance of the tip from the point where the wrist axes meet [m].
        lower: Lower position limits [rad, m].
        upper: Upper position limits [rad, m].
        velocity: Velocity limits [rad/s, m/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "stanford".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.25 of the textbook; Sect. 3.2.3.
    """
    rows: list[_Link] = [
        (0.0, -_QUARTER, 0.0, "revolute"),
        (0.0, _QUARTER, d2, "revolute"),
        (0.0, 0.0, 0.0, "prismatic"),
        *_wrist(d6),
    ]
    return _chain("stanford", rows, (lower, upper, velocity), radius, rod=-0.5)


def anthropomorphic_with_wrist(
    a2: float = 0.5,
    d4: float = 0.5,
    d6: float = 0.1,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make an anthropomorphic arm with a spherical wrist, six revolute joints.

    The forearm lies along the axis of the fourth joint, so that ϑ₃ = π/2 corresponds to ϑ₃ = 0 of
    `anthropomorphic_arm`.

    Args:
        a2: Length of the upper arm [m].
        d4: Length of the forearm [m].
        d6: Distance of the tip from the point where the wrist axes meet [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "anthropomorphic_with_wrist".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.26 and (2.70) of the textbook; Sect. 3.3.1.
    """
    rows: list[_Link] = [
        (0.0, _QUARTER, 0.0, "revolute"),
        (a2, 0.0, 0.0, "revolute"),
        (0.0, _QUARTER, 0.0, "revolute"),
        *_wrist(d6, d4),
    ]
    return _chain("anthropomorphic_with_wrist", rows, (lower, upper, velocity), radius)


def seven_joint_arm(
    d3: float = 0.4,
    d5: float = 0.4,
    d7: float = 0.1,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make a redundant arm with a spherical shoulder, an elbow and a spherical wrist, seven revolute joints.

    At q = 0 it is stretched upwards.

    Args:
        d3: Length of the upper arm [m].
        d5: Length of the forearm [m].
        d7: Distance of the tip from the point where the wrist axes meet [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "seven_joint_arm".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        The DLR manipulator of Fig. 2.27 of the textbook, but with angles α of alternating sign.
    """
    lengths = (0.0, 0.0, d3, 0.0, d5, 0.0, d7)
    turns = (-_QUARTER, _QUARTER, -_QUARTER, _QUARTER, -_QUARTER, _QUARTER, 0.0)
    rows: list[_Link] = [(0.0, turn, d, "revolute") for turn, d in zip(turns, lengths, strict=True)]
    return _chain("seven_joint_arm", rows, (lower, upper, velocity), radius)


def parallelogram_arm(
    a1: float = 0.2,
    a2: float = 0.5,
    a4: float = 0.5,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make the open tree of the planar parallelogram arm, q = (ϑ₁', ϑ₂', ϑ₃', ϑ₁'').

    Links 1', 2', 3' form one chain and link 1'' the other; the loop is closed where the frames "loop_a", at
    the end of link 3', and "loop_b", at the end of link 1'', meet: ϑ₂' = ϑ₁'' − ϑ₁' and ϑ₃' = π − ϑ₂'. The
    tip is on link 3', beyond that point. Joints 1' and 1'' are at the base. The posture "closed" is one where
    the loop is closed; hold it closed with `LoopTask`.

    Args:
        a1: Length of links 1' and 3' [m].
        a2: Length of links 2' and 1'' [m].
        a4: Distance of the tip from the point where the loop closes [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The arm, named "parallelogram"; joints "joint1'", "joint2'", "joint3'" and "joint1''".

    Raises:
        InvalidValue: A number is not finite, or the limits do not fit.

    Source:
        Fig. 2.21 and (2.64) of the textbook; Example 3.5.
    """
    limits = (lower, upper, velocity)
    rows = _rows([(length, 0.0, 0.0, "revolute") for length in (a1, a2, a1, a2)], limits)
    model, shapes = pin.Model(), pin.GeometryModel()
    model.name = "parallelogram"
    thickness = default_radius(rows) if radius is None else radius
    inner = add_chain(model, shapes, rows[:3], ("1'", "2'", "3'"), np.eye(4), thickness)
    outer = add_chain(model, shapes, rows[3:], ("1''",), np.eye(4), thickness)
    add_frame(model, "loop_a", inner, rows[2].constant)
    add_frame(model, "loop_b", outer, rows[3].constant)
    add_frame(model, "tip", inner, rows[2].constant @ homogeneous(np.eye(3), [a4, 0.0, 0.0]))
    closed = np.array([2.0, -1.2, np.pi + 1.2, 0.8])
    return Parts(model, shapes, None, "parallelogram", {"closed": closed})


def four_bar(
    lengths: Sequence[float] = (0.2, 0.5, 0.45, 0.55),
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    velocity: ArrayLike = np.inf,
    radius: float | None = None,
) -> Parts:
    """Make the open tree of a planar four-bar linkage, q = (ϑ₁, ϑ₂, ϑ₃) of crank, coupler and rocker.

    Crank and coupler form one chain, the rocker the other; the loop is closed where the frames "loop_a", at
    the end of the coupler, and "loop_b", at the end of the rocker, meet. The posture "closed" has the
    crank at 1 rad and the elbow up; hold it closed with `LoopTask`. The tip is at the end of the coupler.

    Args:
        lengths: Crank, coupler, rocker, and the distance of their bases along x (4,) [m].
        lower: Lower position limits [rad].
        upper: Upper position limits [rad].
        velocity: Velocity limits [rad/s].
        radius: Radius of the capsules that form the links [m]; default: 6 % of the longest link.

    Returns:
        The linkage, named "four_bar"; joints "joint1", "joint2" and "joint3".

    Raises:
        InvalidValue: A length is not finite, the linkage cannot be closed with the crank at 1 rad, or the
            limits do not fit.

    Source:
        Sect. 3.8.3, on closed chains.
    """
    crank, coupler, rocker, ground = finite("lengths", lengths, (4,)).tolist()
    pin_a = crank * np.exp(1j * 1.0)
    gap = ground - pin_a
    bend = (coupler**2 + abs(gap) ** 2 - rocker**2) / (2.0 * coupler * abs(gap))
    if not abs(bend) <= 1.0:
        raise InvalidValue(f"links of {lengths} m do not close with the crank at 1 rad; choose other lengths")
    turned = np.angle(gap) + np.arccos(bend)
    meeting = pin_a + coupler * np.exp(1j * turned)
    closed = np.array([1.0, turned - 1.0, np.angle(meeting - ground)])
    links: list[_Link] = [(length, 0.0, 0.0, "revolute") for length in (crank, coupler, rocker)]
    rows = _rows(links, (lower, upper, velocity))
    model, shapes = pin.Model(), pin.GeometryModel()
    model.name = "four_bar"
    thickness = default_radius(rows) if radius is None else radius
    driven = add_chain(model, shapes, rows[:2], ("1", "2"), np.eye(4), thickness)
    base = homogeneous(np.eye(3), [ground, 0.0, 0.0])
    led = add_chain(model, shapes, rows[2:], ("3",), base, thickness)
    add_frame(model, "loop_a", driven, rows[1].constant)
    add_frame(model, "loop_b", led, rows[2].constant)
    add_frame(model, "tip", driven, rows[1].constant)
    return Parts(model, shapes, None, "four_bar", {"closed": closed})


ARMS: dict[str, Callable[[], Parts]] = {
    "planar2": lambda: planar_arm((0.5, 0.5)),
    "planar3": planar_arm,
    "parallelogram": parallelogram_arm,
    "four_bar": four_bar,
    "spherical": spherical_arm,
    "cylindrical": cylindrical_arm,
    "scara": scara,
    "anthropomorphic": anthropomorphic_arm,
    "spherical_wrist": spherical_wrist,
    "stanford": stanford_manipulator,
    "anthropomorphic_with_wrist": anthropomorphic_with_wrist,
    "seven_joint_arm": seven_joint_arm,
}
"""The arms by name, with their default dimensions."""


def _wrist(d6: float, d4: float = 0.0) -> list[_Link]:
    """Return the rows of a spherical wrist."""
    return [(0.0, -_QUARTER, d4, "revolute"), (0.0, _QUARTER, 0.0, "revolute"), (0.0, 0.0, d6, "revolute")]


def _chain(
    name: str,
    links: Sequence[_Link],
    limits: tuple[ArrayLike, ArrayLike, ArrayLike],
    radius: float | None,
    rod: float = 0.0,
) -> Parts:
    """Make a chain, in which the last prismatic joint slides a rod of the given length [m]."""
    return build_dh(_rows(links, limits, rod), name, radius=radius)


def _rows(
    links: Sequence[_Link], limits: tuple[ArrayLike, ArrayLike, ArrayLike], rod: float = 0.0
) -> tuple[DHRow, ...]:
    """Return Denavit–Hartenberg rows with ϑ = 0, each with its own limits."""
    n = len(links)
    lower, upper, velocity = (
        _one_each(name, value, n) for name, value in zip(("lower", "upper", "velocity"), limits, strict=True)
    )
    sliding = max((i for i, link in enumerate(links) if link[3] == "prismatic"), default=-1)
    return tuple(
        DHRow(a, alpha, d, 0.0, joint, lower[i], upper[i], velocity[i], rod if i == sliding else 0.0)
        for i, (a, alpha, d, joint) in enumerate(links)
    )


def _one_each(name: str, value: ArrayLike, n: int) -> Array:
    """Return one limit for each joint, from one number for all or one for each."""
    return bound(name, np.full(n, value) if np.ndim(value) == 0 else value, (n,))
