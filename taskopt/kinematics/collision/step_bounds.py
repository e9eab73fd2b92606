"""How far and how fast the shapes of a pair can move against each other in one step, at most."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from typing import Any

import numpy as np

from taskopt.arrays import Array, Mask
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.coal import core, extent
from taskopt.kinematics.robot.robot import Robot

Core = tuple[float, float]  # see `geometry.core`
_TURNING, _SLIDING = 2.0 * np.pi, 1.0  # [rad/s], [m/s] the most that a distance limit makes room for


def nominal_speeds(robot: Robot) -> Array:
    """(nv,) the robot's velocity limits, or 2π rad/s and 1 m/s where they are higher or there is none."""
    return np.minimum(robot.velocity_limit, np.where(_turns(robot), _TURNING, _SLIDING))


def step_losses(collision: Collision, dt: float, within: float) -> tuple[Array, Array, Array]:
    """Three bounds (P,) [m] on what one step of dt at the nominal speeds does to a distance.

    `travel` bounds the first-order change Δt Σ |v_k| ρ_k, ρ_k being the farthest that any point of the
    first solid can be from joint k. `jump` and `bend` bound what the linearised distance d + Δt ∇d·v
    overstates for pairs nearer than `within`; at s times the speeds it is s · jump + s² · bend.

    Why these: a plane that separates the solids and moves with one of them separates them as long as no
    point of the other crosses it. Points that are not the witness point p move by ω × (x − p) more, which
    is jump = Δt Ω ℓ with Ω = Σ |v_k| over turning joints and ℓ the size of the other's core; it is
    zero for a sphere. Moving with constant v, a point accelerates by at most Ω Σ |v_k| ρ_k (sliding
    joints twice, for Coriolis), which is bend = ½ Δt² times that.
    """
    known = [core(shape) for shape in collision.shapes.geometryObjects]
    out = [
        _losses(collision, pair, known[first], known[second], dt, within)
        for pair, (first, second) in enumerate(collision.pairs)
    ]
    travel, jump, bend = np.array(out).reshape(-1, 3).T.copy()
    return travel, jump, bend


def _losses(
    collision: Collision, pair: int, mine: Core, other: Core, dt: float, within: float
) -> tuple[float, float, float]:
    robot, moving = collision.robot, collision.turn[pair] != 0.0
    speeds, turning = nominal_speeds(robot), _turns(robot) & moving
    spin = float(speeds[turning].sum())
    slide = float(speeds[moving & ~turning].sum())
    swing = float(speeds[turning] @ _reach(robot, collision, pair)[turning])

    def bend(pad: float) -> float:
        return 0.5 * dt * dt * spin * (swing + spin * pad + 2.0 * slide)

    # The plane goes with the second solid, and points of the first are watched; or the other way round.
    ways = [(dt * spin * mine[0], bend(0.0))]
    if np.isfinite(other[0]):
        ways.append((dt * spin * other[0], bend(within + sum(other))))
    return dt * (swing + slide), *min(ways, key=sum)


def _reach(robot: Robot, collision: Collision, pair: int) -> Array:
    """(nv,) the farthest that a point of the first solid can be from each joint between the two [m]."""
    first, second = collision.joints[pair]
    shape = collision.shapes.geometryObjects[collision.pairs[pair][0]]
    mine, theirs = (list(robot.model.supports[joint]) for joint in (first, second))
    shared = sum(a == b for a, b in zip(mine, theirs, strict=False))
    out, length = np.zeros(robot.nv), extent(shape)
    for joint in reversed(mine[shared:]):
        _write(robot, out, joint, length)
        length += _link_length(robot, joint)
    for joint in theirs[shared:]:
        length += _link_length(robot, joint)
        _write(robot, out, joint, length)
    if not np.isfinite(out[_turns(robot) & (collision.turn[pair] != 0.0)]).all():
        raise InvalidValue(
            f"{collision.names[pair]}: a sliding joint between them has no position limit, so a step has no "
            "bound; give the joint limits"
        )
    return out


def _turns(robot: Robot) -> Mask:
    return np.array([unit == "rad" for unit in robot.coordinate_units])


def _write(robot: Robot, out: Array, joint: int, value: float) -> None:
    known = robot.model.joints[joint]
    out[known.idx_v : known.idx_v + known.nv] = value


def _link_length(robot: Robot, joint: int) -> float:
    """From the origin of the joint before to that of this one, at most [m]."""
    known: Any = robot.model.joints[joint]
    length = float(np.linalg.norm(robot.model.jointPlacements[joint].translation))
    for column in range(known.idx_v, known.idx_v + known.nv):
        if robot.coordinate_units[column] == "m":
            length += max(abs(robot.position_lower[column]), abs(robot.position_upper[column]))
    return length
