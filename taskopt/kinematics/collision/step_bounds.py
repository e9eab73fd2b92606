"""Bounds on the changes of distances between shapes during one step of a robot."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.errors import InvalidValue
from taskopt.kinematics.collision.lengths import link_length
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry.coal import core, extent
from taskopt.kinematics.robot.joints import velocity_slice
from taskopt.kinematics.robot.robot import Robot

_TURNING, _SLIDING = 2.0 * np.pi, 1.0  # [rad/s], [m/s] the most that a distance limit makes room for


class StepLosses(NamedTuple):
    """Upper bounds on changes of distances in one step with speeds |v_k| ≤ s v̄_k, v̄ the nominal speeds.

    Attributes:
        travel: (P,) [m] bound on Δt |∇d·v| at s = 1; it is proportional to s.
        jump: (P,) [m] linear part of the error of the linearised distance at s = 1; it is proportional to s.
        bend: (P,) [m] quadratic part of that error at s = 1; it is proportional to s².
        slide: (P,) [m] the part of `bend` that sliding joints make together with turning ones.
    """

    travel: Array
    jump: Array
    bend: Array
    slide: Array


class Core(NamedTuple):
    """A solid as the sum core ⊕ ball, see `geometry.coal.core`.

    Attributes:
        diameter: Diameter of the core [m].
        radius: Radius of the ball [m].
    """

    diameter: float
    radius: float


def nominal_speeds(robot: Robot) -> Array:
    """Return the nominal speeds v̄, for which distance limits keep a reserve.

    Args:
        robot: The robot.

    Returns:
        (nv,) the velocity limits, but at most 2π rad/s for turning and 1 m/s for sliding joints.
    """
    return np.minimum(robot.velocity_limit, np.where(turning(robot), _TURNING, _SLIDING))


class Between(NamedTuple):
    """The velocities that change each distance, pair after pair.

    Attributes:
        start: (P + 1,) where the entries of each pair begin, and the end.
        column: Index of each such velocity.
        reach: ρ, the largest distance that a point of the first solid can have from the axis of the joint
            [m]; 1 for a slide.
        sign: +1 where the velocity moves the second solid, −1 where it moves the first.
        speed: v̄, see `nominal_speeds` [rad/s, m/s].
    """

    start: IntArray
    column: IntArray
    reach: Array
    sign: Array
    speed: Array


def between(collision: Collision) -> Between:
    """List the velocities that change each distance.

    Args:
        collision: The P pairs.

    Returns:
        The velocities, each with the largest change of the distance that it can make in unit time.

    Raises:
        InvalidValue: A sliding joint between two solids has no position limit.
    """
    reaches = _Reaches(collision)
    reach = np.array([reaches.of(pair) for pair in range(len(collision.pairs))]).reshape(collision.turn.shape)
    reach[:, ~turning(collision.robot)] = 1.0
    pair, column = np.nonzero(collision.turn)
    start = np.searchsorted(pair, np.arange(len(collision.pairs) + 1))
    speed = nominal_speeds(collision.robot)[column]
    return Between(start, column, reach[pair, column], collision.turn[pair, column], speed)


def step_losses(collision: Collision, dt: float, within: float) -> StepLosses:
    """Compute bounds on the change of each distance in one step at the nominal speeds.

    `travel` bounds the first-order change Δt Σ |v_k| ρ_k, where no point of the first solid can be farther
    than ρ_k from joint k. The linearised distance d + Δt ∇dᵀv overstates the true one by at most
    s · jump + s² · bend at s times these speeds, for pairs nearer than `within`.

    The reason is this. A plane that separates the solids and moves with one of them separates them as long as
    no point of the other crosses it. Compared with the nearest point p, another point x moves by ω × (x − p)
    more, hence jump = Δt Ω ℓ, with Ω = Σ |v_k| over turning joints and ℓ the diameter of the other solid's
    core (zero for a sphere). At constant v, a point accelerates by at most Ω Σ |v_k| ρ_k (twice that for
    sliding joints, because of Coriolis terms), and bend is ½ Δt² times this. Sliding joints lose nothing by
    themselves, since d is a convex function of a translation: with turning joints at s times their speeds and
    sliding joints at most at theirs, the loss is at most s · (jump + slide) + s² · (bend − slide).

    Args:
        collision: The P pairs.
        dt: Δt [s].
        within: Distance up to which the bounds must hold [m].

    Returns:
        The bounds.

    Raises:
        InvalidValue: A sliding joint between two solids has no position limit.
    """
    known = [Core(*core(shape)) for shape in collision.shapes.geometryObjects]
    reaches, turns, speeds = _Reaches(collision), turning(collision.robot), nominal_speeds(collision.robot)
    out = []
    for pair, (first, second) in enumerate(collision.pairs):
        moving = collision.turn[pair] != 0.0
        turn = turns & moving
        speed = _Speeds(
            float(speeds[turn].sum()),
            float(speeds[moving & ~turns].sum()),
            float(speeds[turn] @ reaches.of(pair)[turn]),
        )
        out.append(_losses(known[first], known[second], speed, dt, within))
    return StepLosses(*np.array(out).reshape(-1, 4).T.copy())


class _Speeds(NamedTuple):
    """Sums over the velocities that change one distance, at the nominal speeds."""

    spin: float  # Σ v̄ over turning joints [rad/s]
    slide: float  # Σ v̄ over sliding joints [m/s]
    swing: float  # Σ v̄ ρ over turning joints [m/s]


def _losses(mine: Core, other: Core, speed: _Speeds, dt: float, within: float) -> tuple[float, ...]:
    """Return the numbers of `StepLosses` [m] of one pair of solids, whose cores are `mine` and `other`."""
    spin, slide, swing = speed

    def bend(pad: float) -> float:
        """Bound the acceleration part for points up to `pad` [m] farther from the joints."""
        return 0.5 * dt * dt * spin * (swing + spin * pad + 2.0 * slide)

    # The plane goes with the second solid, and points of the first are watched; or the other way round.
    ways = [(dt * spin * mine.diameter, bend(0.0))]
    if np.isfinite(other.diameter):
        ways.append((dt * spin * other.diameter, bend(within + (other.diameter + other.radius))))
    return dt * (swing + slide), *min(ways, key=sum), dt * dt * spin * slide


class _Reaches:
    """Bounds on the distances of points of the first solid of a pair from the joints between the two."""

    def __init__(self, collision: Collision) -> None:
        """Measure shapes and links once, because there may be thousands of pairs."""
        robot = collision.robot
        self._collision, self._turns = collision, turning(robot)
        self._supports = [list(support) for support in robot.model.supports]
        self._columns = [velocity_slice(joint) for joint in robot.model.joints]
        self._lengths = [link_length(robot, joint) for joint in range(len(self._supports))]
        self._extents = [extent(shape) for shape in collision.shapes.geometryObjects]

    def of(self, pair: int) -> Array:
        """Return bounds (nv,) [m] on distances of the first solid's points from the joints between the two.

        Raises `InvalidValue` if one of them is a sliding joint without a position limit.
        """
        collision = self._collision
        mine, theirs = (self._supports[joint] for joint in collision.joints[pair])
        shared = sum(a == b for a, b in zip(mine, theirs, strict=False))
        out, length = np.zeros(self._turns.size), self._extents[collision.pairs[pair][0]]
        for joint in reversed(mine[shared:]):
            out[self._columns[joint]] = length
            length += self._lengths[joint]
        for joint in theirs[shared:]:
            length += self._lengths[joint]
            out[self._columns[joint]] = length
        if not np.isfinite(out[self._turns & (collision.turn[pair] != 0.0)]).all():
            raise InvalidValue(
                f"{collision.names[pair]}: a sliding joint between them has no position limit, so a step has "
                "no bound; give the joint limits"
            )
        return out


def turning(robot: Robot) -> Mask:
    """Return which velocities turn.

    Args:
        robot: The robot.

    Returns:
        (nv,) True for [rad/s], False for [m/s].
    """
    return np.array([unit == "rad" for unit in robot.coordinate_units])
