"""What every task is: a declaration that, bound to a robot, fills its rows in place on every tick."""

from typing import Protocol, runtime_checkable

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot


class BoundTask(Protocol):
    """A task of one robot in one plan: rows A v = b, or lower ≤ A v ≤ upper, and their names.

    `error` is e = x_d − x of the last `fill`, unweighted, one number a row; `gain` K [1/s] is what
    multiplies it. `column[i]` is j where row i is e_j for good, else −1. Frame tasks have the name of
    their `frame` and the poses `desired` and `actual` (4, 4) of the last `fill`; elsewhere None.
    """

    name: str
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]  # of b and of the residual A v − b
    column: tuple[int, ...]
    weight: Array
    gain: Array
    error: Array
    constant: bool  # what `prepare` wrote never changes, and `fill` need not be called

    @property
    def frame(self) -> str | None: ...
    @property
    def desired(self) -> Array | None: ...
    @property
    def actual(self) -> Array | None: ...

    def prepare(self, rows: LevelRows) -> None:
        """Write once what never changes; A arrives full of zeros."""
        ...

    def start(self, at: Configuration, t: float) -> None:
        """Anchor references that begin at the start posture, at the time t [s]."""
        ...

    def fill(self, at: Configuration, t: float, rows: LevelRows) -> None:
        """Write the rows at a configuration and time, in place, without allocating."""
        ...


@runtime_checkable
class Task(Protocol):
    """A declaration, known to no robot yet."""

    @property
    def name(self) -> str | None: ...

    def bind(self, robot: Robot, name: str) -> BoundTask:
        """The task's rows for a robot; raise `UnknownName` for a frame or joint that it lacks."""
        ...

    def default_name(self) -> str:
        """What the stack calls it if it has no name."""
        ...
