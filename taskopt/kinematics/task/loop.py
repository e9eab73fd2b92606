"""A closed chain as a task: two frames of a tree that a cut joint holds together."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import log3
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import ROW_NAMES, ROW_UNITS, chosen_rows
from taskopt.kinematics.task.base import BoundTask, Task, gains, weights


@dataclass(frozen=True, eq=False)
class LoopTask(Task):
    """Keep a closed chain closed: two frames of the tree stay together by (J_a − J_b) v = K e.

        e = [p_b − p_a; log3(R_b R_aᵀ)], the rows that the cut joint holds together, in the axes of the world

    Put it on the first level, above everything that the mechanism is to do: its joints then move as (3.118)
    says. Limits of the joints rank above every level; where they prevent the loop from staying closed, the
    gap shows in e.

    Args:
        frame_a: Name of the frame at one side of the cut joint.
        frame_b: Name of the frame at the other side.
        axes: Rows that the joint holds together: "xy" for a revolute joint of a mechanism in the x-y plane,
            "xyz" for a ball joint, "xyzrpy" for a weld.
        gain: K [1/s]. More closes a gap from integration faster; it must stay below 2/Δt.
        weight: Factor of ½ ‖(J_a − J_b) v − K e‖² within the level.
        name: Name in logs and plots. Default: "loop".

    Raises:
        InvalidValue: Both frames are the same, no axis is chosen, or a number is out of its range.

    Source:
        Sect. 3.8.3.
    """

    frame_a: str
    frame_b: str
    axes: str | Sequence[bool] = field(default="xyz", kw_only=True)
    gain: ArrayLike = field(default=10.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if self.frame_a == self.frame_b:
            raise InvalidValue(f"a loop needs two frames that meet, got '{self.frame_a}' twice")
        rows = chosen_rows(self.axes, "xyzrpy")
        gains(self.gain, len(rows))
        weights(self.weight, len(rows))

    def bind(self, robot: Robot, name: str) -> "BoundLoop":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot lacks one of the two frames.
        """
        robot.frame_id(self.frame_a)
        robot.frame_id(self.frame_b)
        return BoundLoop(name, self, chosen_rows(self.axes, "xyzrpy"))


class BoundLoop(BoundTask):
    """The rows of a `LoopTask`.

    Args:
        name: Name of the task in its plan.
        task: The declared task.
        rows: Rows of six that are taken, (m,).
    """

    def __init__(self, name: str, task: LoopTask, rows: IntArray) -> None:
        names, units = [ROW_NAMES[i] for i in rows], [ROW_UNITS[i] for i in rows]
        super().__init__(name, names, units, task.gain, task.weight)
        self._frames, self._rows = (task.frame_a, task.frame_b), rows

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        a, b = self._frames
        rows.A[...] = (configuration.jacobian(a) - configuration.jacobian(b))[self._rows]
        self.error[:] = _gap(configuration.pose(a), configuration.pose(b))[self._rows]
        rows.lower[:] = rows.upper[:] = self.gain * self.error


def _gap(a: Array, b: Array) -> Array:
    """Return the gap e (6,) [m, rad] from frame a to frame b, in the axes of the world."""
    return np.concatenate([b[:3, 3] - a[:3, 3], log3(b[:3, :3] @ a[:3, :3].T)])
