"""Base classes of limits: declarations that, bound to a robot, hold whatever the tasks ask for.

A limit narrows the bounds of single velocities (`BoundLimit`), or fills hard rows (`RowLimit`), or does both.
It promises that braking as hard as allowed never violates it, so that all limits together always allow some
velocity. Without a limit on acceleration, braking as hard as allowed means v = 0. Own limits derive from
`Limit` and from one of the bound classes; `taskopt.testing.check_limit` checks that they keep the promise.
"""

from collections.abc import Sequence

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import CROSSED_BY_ROUNDING
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Shape
from taskopt.kinematics.part import Part, RowPart, state_of
from taskopt.kinematics.robot import Robot


class BoundLimit(Part):
    """Bounds on single velocities: lower ≤ v ≤ upper, (nv,) [rad/s, m/s].

    Args:
        name: Name of the limit.
        owners: Names that a bound of this limit may have, one for each reason. None: the name of the limit.

    Attributes:
        of_speed: True if the bounds limit speeds only, −w ≤ v ≤ w, so that they hold no robot that rests.
    """

    of_speed: bool = False

    def __init__(self, name: str, owners: Sequence[str] | None = None) -> None:
        self.name = name
        self.owners = (name,) if owners is None else tuple(owners)

    @property
    def stops(self) -> Sequence[int]:
        """Places in `owners` of the reasons for which a bound can hold a robot that rests."""
        return () if self.of_speed or self.constant else range(len(self.owners))

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:
        """Narrow the bounds in place.

        A limit with a kernel inherits this method, which runs the kernel; other limits define their own. A
        bound that is already tighter must stay as it is; `narrow_one` takes care of that for one velocity.

        Args:
            configuration: Robot at the posture of this tick.
            bounds: (4, nv): lower bounds, upper bounds, owner of each lower bound, owner of each upper bound.
            owner: Number of the first of `owners`. Write it, or the number of a later owner, for every bound
                that this limit sets.
        """
        if self.kernel is not None:
            self.kernel(self.parameters, self.memory, state_of(configuration), bounds, owner)  # type: ignore[call-arg]

    def box_part(self) -> "BoundLimit":
        """Return the part that narrows bounds in a plan: the limit itself, or another part in its place.

        Returns:
            The part.
        """
        return self


class RowLimit(RowPart):
    """Bounds on linear combinations of velocities: named hard rows lower ≤ A v ≤ upper; see `RowPart`."""


class RateLimit:
    """A limit whose bounds depend on the velocity of the last tick; derive from it besides `BoundLimit`."""

    def moved(self, v: Array) -> None:
        """Tell the limit the velocity that the robot has until the next tick.

        Args:
            v: Velocity, (nv,) [rad/s, m/s].

        Raises:
            NotImplementedError: The class does not define the method.
        """
        raise NotImplementedError(f"{type(self).__name__} lacks moved()")

    def brakes(self) -> Array:
        """Return the velocity of the next tick if the robot brakes as hard as allowed.

        Returns:
            (nv,) [rad/s, m/s]; 0 where standstill can be reached.

        Raises:
            NotImplementedError: The class does not define the method.
        """
        raise NotImplementedError(f"{type(self).__name__} lacks brakes()")


class Limit:
    """Base of all limits: a declaration that does not depend on a robot yet.

    Attributes:
        name: Name in explanations, logs and plots.
        obstacles: Shapes from which the limit keeps the robot away, which a viewer draws.
    """

    name: str = "limit"
    obstacles: Sequence[Shape] | Shape = ()

    def bind(self, robot: Robot, dt: float) -> BoundLimit | RowPart:
        """Return the limit for a robot.

        Args:
            robot: The robot.
            dt: Time [s] from one tick to the next.

        Returns:
            The bound limit.

        Raises:
            UnknownName: The robot lacks a joint or link of the limit.
        """
        raise NotImplementedError(f"{type(self).__name__} lacks bind()")


@kernel
def narrow_one(bounds, j, lower, upper, owner):
    """Narrow the bounds of one velocity, and note the owner of each bound that became tighter.

    A bound of NaN is written, too, so that the check of the bounds finds it.

    Args:
        bounds: (4, nv), see `BoundLimit.narrow`.
        j: Index of the velocity in v.
        lower: Lower bound [rad/s, m/s].
        upper: Upper bound [rad/s, m/s].
        owner: Number of the owner, see `BoundLimit.narrow`.
    """
    if not lower <= bounds[0, j]:
        bounds[0, j], bounds[2, j] = lower, owner
    if not upper >= bounds[1, j]:
        bounds[1, j], bounds[3, j] = upper, owner


@kernel
def close_crossed(bounds):
    """Let bounds of a velocity that cross by rounding only meet in the middle.

    A joint that brakes as hard as it may in front of the end of its range has one velocity left, which two
    limits compute in two ways. Bounds that cross by more contradict each other, and stay as they are.

    Args:
        bounds: (4, nv), see `BoundLimit.narrow`.
    """
    for j in range(bounds.shape[1]):
        lower, upper = bounds[0, j], bounds[1, j]
        if lower > upper and lower - upper <= CROSSED_BY_ROUNDING * max(1.0, abs(lower)):
            bounds[0, j] = bounds[1, j] = upper + 0.5 * (lower - upper)
