"""Couplings of joints, such as the mimic joints of a robot's file, as hard rows of every stack."""

from collections.abc import Sequence

from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.limit.base import RowLimit
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.couplings import Coupling


class BoundCoupling(RowLimit):
    """Rows v_follower − m v_leader = 0, the derivative of q_follower = m q_leader + o.

    The rows never change, v = 0 satisfies them, and an Euler step keeps q_follower − m q_leader up to
    rounding. If a measured posture starts with a gap from the coupling, that gap therefore stays constant.

    Args:
        robot: The robot.
        couplings: Couplings of its joints, one row for each.
        name: Name of the rows in explanations, logs and plots.
    """

    constant = True

    def __init__(self, robot: Robot, couplings: Sequence[Coupling], name: str = "coupling") -> None:
        self._columns = [
            (robot.velocity_index(c.follower).start, robot.velocity_index(c.leader).start, c.multiplier)
            for c in couplings
        ]
        units = ["m/s" if robot.coordinate_units[j] == "m" else "rad/s" for j, _, _ in self._columns]
        super().__init__(name, [coupling.follower for coupling in couplings], units)

    def prepare(self, rows: LevelRows) -> None:
        """Write the rows, whose bounds are 0; see `RowPart.prepare`."""
        for row, (follower, leader, multiplier) in zip(rows.A, self._columns, strict=True):
            row[follower], row[leader] = 1.0, -multiplier
