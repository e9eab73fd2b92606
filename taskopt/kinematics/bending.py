"""Second derivatives of the tasks of a plan along a velocity."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.addresses import rows_of_block
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.part import Motion, state_of
from taskopt.kinematics.stack import Plan


class Bending:
    """How the values of the curved tasks of a plan of second order bend along a velocity.

    A row asks for A q̈ = … − J̇ v. Its part that is even in v is −f″(v, v), for a target at rest and for one
    that moves.

    Args:
        plan: A plan of order 2.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan, self._probe = plan, Configuration(plan.robot, plan.robot.neutral)
        blocks = {block.name: block for block in plan.layout.blocks if block.level}
        self._tasks = [
            (task, blocks[task.name]) for task in plan.tasks if plan.groups[blocks[task.name].rows].any()
        ]
        self.along(np.ones(plan.robot.nv))  # so that no tick has to wait for the compiler

    def along(self, v: Array) -> Array:
        """Return f″(v, v) of each row at the posture of this tick, which must have been filled.

        Args:
            v: A velocity, (nv,) [rad/s, m/s].

        Returns:
            One number for each row of the plan, in the unit of the row; 0 for rows that do not bend, (M,).
        """
        plan, probe = self._plan, self._probe
        probe.update(plan.configuration.q, v)
        state, rates = state_of(probe), probe.jacobian_rates.copy(order="F")
        out = np.zeros(plan.layout.row_count)
        for task, block in self._tasks:
            rows, parts = rows_of_block(plan.hierarchy, block), []
            for sign in (0.0, 1.0, -1.0):
                asked = LevelRows(rows.A, rows.lower.copy(), rows.upper.copy(), rows.weight)
                task.lift(state, Motion(plan.dt, sign * v, sign * rates), asked)
                parts.append(asked.lower)
            out[block.rows] = parts[0] - 0.5 * (parts[1] + parts[2])
        return out
