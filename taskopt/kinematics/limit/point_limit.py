"""Limits that keep values g(q) ≥ 0 for points of the robot, by rows that brake and bounds on velocities.

The points are origins of frames, or centres of mass; `taskopt.kinematics.collision.point_motion` bounds their
motion in a step.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, ArrayLike, BoolArray, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.hierarchy.tolerances import CONTACT
from taskopt.jit import kernel
from taskopt.kinematics.collision.point_motion import PointMotion
from taskopt.kinematics.collision.step_bounds import nominal_speeds
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.base import BoundLimit, RowLimit
from taskopt.kinematics.parameter import Numbers, Parameter, one_number
from taskopt.kinematics.robot import Robot


class PointRows(NamedTuple):
    """Numbers of the rows g_i(q) ≥ 0 of a `BoundPointLimit`.

    Attributes:
        names: Name of each row.
        motions: Bounds on the motion of the points of each row in a step.
        counted: True for the velocities that change each row, (m, nv).
        influence: g at which braking begins [m].
        gain: κ in (0, 1], the largest fraction of the remaining distance that one step may take.
    """

    names: Sequence[str]
    motions: Sequence[PointMotion]
    counted: BoolArray
    influence: float
    gain: float


class BoundPointLimit(RowLimit, BoundLimit):
    """Rows ∇g·v ≥ −κ (g − reserve)/Δt for g < influence, and bounds |v_k| ≤ s v̄_k on the velocities.

    The reserve of a row is twice its bend, but at most half the influence. s is the largest share of the
    nominal speeds v̄ for which no row can lose more in one step than its own bound leaves. All rows and
    bounds allow v = 0. If g < 0, the robot may stop or return.

    Args:
        name: Name of the limit.
        robot: The robot.
        dt: Δt [s].
        declared: Numbers of the rows.

    Attributes:
        value: g of each row, as of the last `fill`, (m,) [m].
        bend: Bound on the loss of g beyond ∇g·v Δt in a step at s = 1, (m,) [m].
        share: s of each velocity, as of the last `fill`, (nv,).
    """

    def __init__(self, name: str, robot: Robot, dt: float, declared: PointRows) -> None:
        RowLimit.__init__(self, name, declared.names, ("m/s",) * len(declared.names))
        BoundLimit.__init__(self, name)
        self._dt, self._declared, self._speeds = dt, declared, nominal_speeds(robot)
        self._gain = np.array([declared.gain])
        travel = np.array([motion.travel for motion in declared.motions])
        bend = np.array([motion.bend for motion in declared.motions])
        self._known = np.array([np.zeros(len(travel)), travel, bend, bend])
        self.value, self._travel, self._far_bend, self.bend = self._known
        self._gradient = np.zeros((len(declared.names), robot.nv))
        self.share: Array = np.full(robot.nv, np.inf)

    def measure(self, configuration: Configuration, gradient: Array) -> Array:
        """Compute g and its gradient at a configuration.

        Args:
            configuration: Robot at the posture of this tick.
            gradient: ∇g of each row, (m, nv), written here.

        Returns:
            g of each row, (m,) [m].

        Raises:
            NotImplementedError: The class does not define the method.
        """
        raise NotImplementedError(f"{type(self).__name__} lacks measure()")

    def retime(self, dt: float) -> None:
        """Change Δt [s]; see `Part.retime`."""
        # The travel of a step is proportional to Δt, and its bend to the square.
        longer = dt / self._dt
        self._travel *= longer
        self._far_bend *= longer * longer
        self._dt, self.bend[:] = dt, self._far_bend

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return the gain; see `Part.adjustable`."""
        return {"gain": Numbers(self._gain, self._one_gain)}

    def _one_gain(self, gain: ArrayLike) -> float:
        """Return a gain that is in its range."""
        return one_number(f"gain of '{self.name}'", gain, 0.0, 1.0)

    def prepare(self, rows: LevelRows) -> None:
        """Open both sides; see `RowPart.prepare`."""
        rows.lower[:], rows.upper[:] = -np.inf, np.inf

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Measure, and write the rows; see `RowPart.fill`."""
        self.value[:] = self.measure(configuration, self._gradient)
        settings = np.array([self._declared.influence, self._gain[0], self._dt])
        brake_into(
            self._known, settings, self._gradient, self._declared.counted, rows.A, rows.lower, self.share
        )

    def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:  # noqa: ARG002
        """Narrow the bounds to |v_k| ≤ s_k v̄_k, after `fill`; see `BoundLimit.narrow`."""
        largest = self.share * self._speeds
        for row, limit, tighter in ((0, -largest, np.greater), (1, largest, np.less)):
            binds = tighter(limit, bounds[row])
            bounds[row, binds], bounds[row + 2, binds] = limit[binds], owner


@kernel
def brake_into(known, settings, gradient, counted, A, lower, share):
    """Write the rows of a `BoundPointLimit`, and the share of each velocity.

    Args:
        known: Four numbers of each row: g, travel, bend, and the bend far from the edge, (4, m) [m].
        settings: Influence [m], κ, Δt [s].
        gradient: ∇g of each row, (m, nv).
        counted: Velocities that change each row, (m, nv).
        A: Rows, (m, nv), written here.
        lower: Lower bounds, (m,) [m/s], written here.
        share: s of each velocity, (nv,), written here.
    """
    influence, gain, dt = settings[0], settings[1], settings[2]
    share[:] = np.inf
    for i in range(lower.size):
        g, travel, bend, far_bend = known[0, i], known[1, i], known[2, i], known[3, i]
        near = not g >= influence  # so that NaN is handed on, and found
        free = max(g - min(2.0 * bend, 0.5 * influence), 0.0)
        for k in range(share.size):
            A[i, k] = gradient[i, k] if near else 0.0
        lower[i] = -gain * free / dt if near else -np.inf
        left, first, curve = (g - gain * free, 0.0, bend) if near else (g, travel, far_bend)
        if g < CONTACT:
            left = max(CONTACT, -0.1 * g)
        loss = first + np.sqrt(first * first + 4.0 * curve * left)
        s = 2.0 * left / loss if loss > 0.0 else np.inf
        for k in range(share.size):
            if counted[i, k]:
                share[k] = min(share[k], s)


def checked_braking(influence: float, gain: float) -> tuple[float, float]:
    """Check influence and gain of a limit, and return them.

    Args:
        influence: Value at which braking begins [m].
        gain: κ, the largest fraction of the remaining distance that one step may take.

    Returns:
        Influence [m] and gain.

    Raises:
        InvalidValue: Unless influence > 0 and 0 < gain ≤ 1.
    """
    if positive("gain", gain) > 1.0:
        raise InvalidValue(f"gain of a limit must be in (0, 1], got {gain:g}")
    return positive("influence", influence), float(gain)
