"""Tasks that keep linear relations between joints: a weighted sum, or any rows A (q ⊖ q₀) = b."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.parameter import Numbers, Parameter
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import CIRCLE, OTHER, coordinate_table
from taskopt.kinematics.task.base import BoundTask, Task, gains, rate_units, weights


@dataclass(frozen=True, eq=False)
class LinearHolonomicTask(Task):
    """Keep a linear relation A (q ⊖ q₀) = b of the configuration: A D v = K e with e = b − A (q ⊖ q₀).

    The difference q ⊖ q₀ and its derivative D = ∂(q ⊖ q₀)/∂v are those of the manifold: for joints with one
    degree of freedom D is the identity, and a continuous joint counts by its angle from q₀ in (−π, π], where
    the error jumps at half a turn. One row for each row of A, in its unit per second.

    Args:
        A: Coefficients (k, nv), or (nv,) for a single row.
        b: Right-hand sides, one number or (k,).
        q0: Posture q₀ (nq,) from which the difference is taken [rad, m]. Default: neutral.
        gain: K [1/s], one number or k. More lets the error die out faster and asks for larger velocities; it
            must stay below 2/Δt.
        weight: Factor of ½ (A D v − K e)² within the level, one number or k. More lets this task win over
            others of the same level.
        name: Name in logs and plots. Default: "linear holonomic".

    Raises:
        InvalidValue: A has a row of zeros, its number of columns is not nv, or a number is out of its range;
            sizes that depend on the robot are checked when bound.

    Source:
        Equation (3.67), applied to A (q ⊖ q₀).
    """

    A: ArrayLike
    b: ArrayLike = 0.0
    q0: ArrayLike | None = field(default=None, kw_only=True)
    gain: ArrayLike = field(default=1.0, kw_only=True)
    weight: ArrayLike = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        A, _ = self._relation()
        gains(self.gain, len(A))
        weights(self.weight, len(A))

    def bind(self, robot: Robot, name: str) -> "BoundLinear":
        """Return the rows for a robot; see `Task.bind`.

        Raises:
            InvalidValue: A does not have nv columns, or q0 is not a posture of the robot.
        """
        A, b = self._relation()
        if A.shape[1] != robot.nv:
            raise InvalidValue(
                f"A of '{name}' must have {robot.nv} columns, one for each velocity of {robot.name}, "
                f"got {A.shape[1]}"
            )
        bound = BoundLinear(robot, name, A, [str(i) for i in range(1, len(A) + 1)], "b")
        q0 = robot.neutral if self.q0 is None else robot.checked_q(self.q0)
        bound.attach(b, q0, gains(self.gain, len(A)), weights(self.weight, len(A)))
        return bound

    def _relation(self) -> tuple[Array, Array]:
        """Return A (k, nv) and b (k,)."""
        A = finite("A", np.atleast_2d(np.asarray(self.A)), (None, None))
        if not A.size or not A.any(axis=1).all():
            raise InvalidValue("A must have at least one row, and in each row a number that is not 0")
        b = (
            np.full(len(A), finite("b", self.b, ()))
            if np.ndim(self.b) == 0
            else finite("b", self.b, (len(A),))
        )
        return A, b


@dataclass(frozen=True, eq=False)
class JointCouplingTask(Task):
    """Couple joints by Σ a_i q_i = b: one row Σ a_i v_i = K e with e = b − Σ a_i q_i.

    `JointCouplingTask({"left": 1.0, "right": -1.0})` keeps two joints at the same angle. The coefficients
    never change, so that the row costs next to nothing. On the first level the row acts as a transmission,
    which no task below can break.

    Args:
        ratios: Coefficient a_i of each joint, by name. The joints have one degree of freedom and are not
            continuous.
        offset: b, in the unit of the sum [rad, m].
        gain: K [1/s]. More lets the error die out faster; it must stay below 2/Δt.
        weight: Factor of ½ (Σ a_i v_i − K e)² within the level. More lets this task win over others of the
            same level.
        name: Name in logs and plots. Default: "joint coupling".

    Raises:
        InvalidValue: No coefficient is given, one is 0, or a number is out of its range; or, when bound, a
            joint has another kind.

    Source:
        Equation (3.67), applied to Σ a_i q_i.
    """

    ratios: Mapping[str, float]
    offset: float = 0.0
    gain: float = field(default=1.0, kw_only=True)
    weight: float = field(default=1.0, kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.ratios, Mapping) or not self.ratios:
            raise InvalidValue(
                f"ratios must be a mapping from joint to coefficient, as {{'left': 1.0, 'right': -1.0}}, "
                f"got {self.ratios!r}"
            )
        numbers = finite("ratios", list(self.ratios.values()), (len(self.ratios),))
        if not numbers.all():
            raise InvalidValue(f"ratios must not be 0, got {dict(self.ratios)}; leave such joints out")
        finite("offset", self.offset, ())
        gains(self.gain, 1)
        weights(self.weight, 1)

    def bind(self, robot: Robot, name: str) -> "BoundLinear":
        """Return the row for a robot; see `Task.bind`.

        Raises:
            UnknownName: The robot has no joint of that name.
            InvalidValue: A joint has several degrees of freedom, or is continuous.
        """
        A, kinds = np.zeros((1, robot.nv)), coordinate_table(robot)[:, 0]
        for joint, ratio in self.ratios.items():
            columns = robot.velocity_index(joint)
            if columns.stop - columns.start != 1 or kinds[columns.start] == OTHER:
                raise InvalidValue(
                    f"'{name}' couples joints of one degree of freedom, and '{joint}' has another"
                )
            if kinds[columns.start] == CIRCLE:
                raise InvalidValue(
                    f"'{joint}' of '{name}' turns without end, so that its angle is known up to whole turns "
                    "only; LinearHolonomicTask measures it from a posture"
                )
            A[0, columns.start] = ratio
        bound = BoundLinear(robot, name, A, ["sum"], "offset")
        offset = finite("offset", [self.offset], (1,))
        bound.attach(offset, robot.neutral, gains(self.gain, 1), weights(self.weight, 1))
        return bound


class BoundLinear(BoundTask):
    """Rows A D v = K (b − A (q ⊖ q₀)), with D the derivative of q ⊖ q₀ by the joint variables.

    Where D is the identity, A is written once and never again.

    Args:
        robot: The robot.
        name: Name of the task in its plan.
        A: Coefficients, (k, nv).
        row_names: Name of each row.
        right: What the declaration calls the right-hand sides, as the name of their parameter.
    """

    def __init__(self, robot: Robot, name: str, A: Array, row_names: list[str], right: str) -> None:
        self._right = right
        super().__init__(name, row_names, _units(robot, A))
        self._robot, self._A = robot, A
        self._curved = bool((coordinate_table(robot)[A.any(axis=0), 0] == OTHER).any())

    def attach(self, b: Array, q0: Array, gain: Array, weight: Array) -> None:
        """Set the numbers of the relation.

        Args:
            b: Right-hand sides, (k,).
            q0: Posture from which the difference is taken, (nq,) [rad, m].
            gain: K of each row [1/s], (k,).
            weight: Weight of each row, (k,).
        """
        self._b, self._q0, self.gain, self.weight = b, q0, gain, weight

    def adjustable(self) -> Mapping[str, Parameter]:
        """Return gain and right-hand sides; see `Part.adjustable`."""
        return {**super().adjustable(), self._right: Numbers(self._b, self._each_side)}

    def _each_side(self, b: ArrayLike) -> Array | float:
        """Return a right-hand side for each row, or one for all."""
        name = f"{self._right} of '{self.name}'"
        return float(finite(name, b, ())) if np.ndim(b) == 0 else finite(name, b, self._b.shape)

    def prepare(self, rows: LevelRows) -> None:
        """Write the coefficients; see `RowPart.prepare`."""
        rows.A[:] = self._A

    def fill(self, configuration: Configuration, t: float, rows: LevelRows) -> None:  # noqa: ARG002
        """Write the rows; see `RowPart.fill`."""
        self.error[:] = self._b - self._A @ self._robot.difference(self._q0, configuration.q)
        if self._curved:
            rows.A[:] = self._A @ self._robot.difference_rates(self._q0, configuration.q)[1]
        rows.lower[:] = self.gain * self.error
        rows.upper[:] = rows.lower


def _units(robot: Robot, A: Array) -> list[str]:
    """Return the unit of each row: the common unit of its coordinates, or "" if their units differ."""
    of_rows = [{robot.coordinate_units[j] for j in np.flatnonzero(row)} for row in A]
    return ["" if len(units) > 1 else rate_units(units)[0] for units in of_rows]
