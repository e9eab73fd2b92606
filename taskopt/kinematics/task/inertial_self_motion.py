"""The rows of self-motion in the norm of the robot's own inertia, which changes with its posture."""

import numpy as np

from taskopt.arrays import Array, ArrayLike
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import checked_norm
from taskopt.hierarchy.tolerances import DEPENDENT_DIRECTION
from taskopt.jit import kernel_apart
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.task.self_motion import BoundSelfMotion


class BoundInertialSelfMotion(BoundSelfMotion):
    """Rows R q̈ = −K_v R v with Rᵀ R = M(q), so that the norm is that of the kinetic energy ½ vᵀ M(q) v.

    The matrix is that of the present posture. `curved` is False although the rows change with the posture:
    damping at rest is for errors that cannot be met, and these rows have none.

    Args:
        robot: The robot.
        gain: K_v [1/s].

    Raises:
        InvalidValue: The mass matrix is not positive definite, as of a robot whose links have no masses.
    """

    fixed_target = False  # so that `aim` follows the posture

    def __init__(self, robot: Robot, gain: float) -> None:
        eigenvalues = np.linalg.eigvalsh(Configuration(robot, robot.neutral).mass_matrix())
        if eigenvalues[0] <= DEPENDENT_DIRECTION * eigenvalues[-1]:
            raise InvalidValue(
                f"norm='inertia' needs masses; M of {robot.name} has the eigenvalue {eigenvalues[0]:g}; give "
                "its links masses, or give a norm in numbers"
            )
        super().__init__(robot, gain, np.eye(robot.nv))
        self.kernel = rows_from_memory

    def use(self, memory: Array) -> None:
        """Re-bind this part to a memory; see `Part.use`."""
        super().use(memory)
        nv = self.gain.size
        self._rows = memory[nv:].reshape(nv, nv)

    def further_memory(self) -> Array:
        """Return the memory of the rows; see `BoundSelfMotion.further_memory`."""
        return np.zeros(self.gain.size**2)

    def start(self, configuration: Configuration, t: float) -> None:
        """Follow a robot; see `RowPart.start`."""
        super().start(configuration, t)
        self._configuration = configuration

    def aim(self, t: float) -> None:  # noqa: ARG002 (the norm does not depend on the time)
        """Factor M(q) of this tick for the kernel; see `RowPart.aim`."""
        self._rows[:] = np.linalg.cholesky(self._configuration.mass_matrix()).T


def self_motion_of(norm: ArrayLike | None, robot: Robot, gain: float) -> BoundSelfMotion:
    """Return the rows with which a stack of second order closes.

    Args:
        norm: W of the stack, its diagonal, "inertia", or None for the identity.
        robot: The robot.
        gain: K_v [1/s].

    Returns:
        The bound task.

    Raises:
        InvalidValue: The norm, or the mass matrix of the robot, is not positive definite.
    """
    if isinstance(norm, str):
        return BoundInertialSelfMotion(robot, gain)
    return BoundSelfMotion(robot, gain, checked_norm(norm, robot.nv))


@kernel_apart
def rows_from_memory(parameters, memory, state, rows):  # noqa: ARG001 (a `RowKernel`)
    """Write rows that stand in the memory, and ask for standstill, A v = 0.

    Args:
        parameters: Number of rows.
        memory: Flat array: K of each row [1/s], then A row by row.
        state: Not read.
        rows: The rows, see `RowArrays`.
    """
    n = parameters[0]
    for i in range(n):
        for j in range(n):
            rows.A[i, j] = memory[n + i * n + j]
        rows.lower[i] = 0.0
        rows.upper[i] = 0.0
