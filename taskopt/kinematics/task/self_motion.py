"""The rows with which every stack of second order closes: what its levels leave free comes to rest."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.jit import kernel_apart
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.base import BoundTask, rate_units

NAME = "self-motion"


class BoundSelfMotion(BoundTask):
    """Rows √W q̈ = −K_v √W v, one for each velocity, so that self-motion dies out as v̇ = −K_v v.

    The least ½ q̈ᵀ W q̈ alone, which is what a norm asks for, lets a self-motion go on for ever, since to
    brake it costs an acceleration. With these rows on the last level, what stays free minimises
    ½ (q̈ + K_v v)ᵀ W (q̈ + K_v v), which is (3.104) with q̈₀ = −K_v v.

    Args:
        robot: The robot.
        gain: K_v [1/s].
        norm: W of the stack, its diagonal (nv,) or all of it (nv, nv).
    """

    constant = False
    curved = False
    fixed_target = True

    def __init__(self, robot: Robot, gain: float, norm: Array) -> None:
        nv, diagonal = robot.nv, norm.ndim == 1
        units = rate_units(robot.coordinate_units)
        weight, column = (norm, list(range(nv))) if diagonal else (np.ones(nv), None)
        super().__init__(NAME, robot.velocity_names, units, gain, weight, column)
        self._root = np.eye(nv) if diagonal else np.linalg.cholesky(norm).T
        self.kernel, self.lift_kernel = standing_rows, velocity_lift
        self.parameters = np.array([nv], dtype=np.int64)
        self.use(np.concatenate([self.gain, self.further_memory()]))

    def accelerate(self) -> None:
        """Do nothing: the rows are those of second order. See `BoundTask.accelerate`."""

    def most_gain(self) -> float:
        """Return 1/Δt, with which self-motion stops in one tick; see `BoundTask.most_gain`."""
        return 1.0 / self.dt if self.dt > 0.0 else np.inf

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        memory[: self.gain.size] = self.gain
        self.memory, self.gain = memory, memory[: self.gain.size]

    def further_memory(self) -> Array:
        """Return the memory that follows the gains."""
        return np.zeros(0)

    def prepare(self, rows: LevelRows) -> None:
        """Write the rows; see `RowPart.prepare`."""
        rows.A[:] = self._root


@kernel_apart
def standing_rows(parameters, memory, state, rows):  # noqa: ARG001 (a `RowKernel`)
    """Ask for standstill, A v = 0.

    Args:
        parameters: Not read.
        memory: Not read.
        state: Not read.
        rows: The rows, see `RowArrays`.
    """
    rows.lower[:] = 0.0
    rows.upper[:] = 0.0


@kernel_apart
def velocity_lift(parameters, memory, state, motion, rows):  # noqa: ARG001 (a `LiftKernel`)
    """Turn rows A v = b on velocities into A q̈ = K (b − A v), so that A v tends to b.

    Args:
        parameters: Not read.
        memory: Flat array that begins with the gain K of each row [1/s].
        state: Not read.
        motion: Motion of the robot, see `Motion`.
        rows: The rows, see `RowArrays`.
    """
    v = motion.velocity
    for i in range(rows.lower.size):
        now = 0.0
        for j in range(v.size):
            now += rows.A[i, j] * v[j]
        rows.lower[i] = rows.upper[i] = memory[i] * (rows.lower[i] - now)
