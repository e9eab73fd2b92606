"""What every limit is: a declaration that, bound to a robot, narrows the box or fills hard rows.

The promise of a limit is that braking as hard as allowed never breaks it, so that together they are never
empty; without a limit on acceleration that is v = 0. `narrow` is told where its own names begin.
"""

from typing import Protocol, runtime_checkable

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot


@runtime_checkable
class BoundLimit(Protocol):
    """Bounds on single velocities: lower ≤ v ≤ upper, (nv,) [rad/s, m/s]."""

    name: str
    constant: bool  # the bounds never change: `narrow` is called once, when the stack is compiled

    def narrow(self, at: Configuration, bounds: Array, index: int) -> None:
        """Narrow the bounds in place.

        `bounds` (4, nv): lower, upper, and which limit each lower and each upper bound comes from; put
        `index` there where this one binds.
        """
        ...


@runtime_checkable
class RowLimit(Protocol):
    """Bounds on sums of velocities: lower ≤ A v ≤ upper, hard rows with names."""

    name: str
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]
    column: tuple[int, ...]

    def prepare(self, rows: LevelRows) -> None:
        """Write once what never changes; A arrives full of zeros."""
        ...

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows at a configuration and time, in place."""
        ...


@runtime_checkable
class RateLimit(Protocol):
    """A limit whose bounds depend on the velocity of the last tick."""

    def moved(self, v: Array) -> None:
        """Take v (nv,) for the velocity that the robot has until the next tick."""
        ...

    def brakes(self) -> Array:
        """(nv,): from there towards standstill, as hard as allowed."""
        ...


@runtime_checkable
class Limit(Protocol):
    """A declaration, known to no robot yet."""

    @property
    def name(self) -> str: ...

    def bind(self, robot: Robot, dt: float) -> BoundLimit | RowLimit:
        """The limit for a robot that takes steps of dt [s]."""
        ...
