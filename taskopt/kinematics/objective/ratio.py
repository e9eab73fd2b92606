"""Transformation ratios along a direction as objectives: how well a posture moves, or pushes, that way."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, IntArray, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import RATIO_FLOOR
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.space import chosen_rows


@dataclass(frozen=True)
class _Ratio(Objective):
    """Base of both ratios: a frame, a direction, and the rows in which it lies."""

    frame: str
    direction: tuple[float, ...]
    axes: str = "xyz"
    _rows: IntArray = field(init=False, repr=False, compare=False)
    _unit: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows = chosen_rows(self.axes, "xyzrpy")
        if rows.min() < 3 <= rows.max():
            raise InvalidValue(
                f"axes must be of one unit, either of 'xyz' or, after a blank, of 'rpy'; got {self.axes!r}"
            )
        direction = finite("direction", self.direction, (len(rows),))
        if not direction.any():
            raise InvalidValue("direction must not be zero")
        object.__setattr__(self, "direction", tuple(direction.tolist()))
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_unit", direction / np.linalg.norm(direction))

    def _jacobian(self, configuration: Configuration) -> Array:
        """Return the chosen rows of the geometric Jacobian, (m, nv)."""
        return configuration.jacobian(self.frame)[self._rows]

    def _slopes(self, configuration: Configuration, left: Array, right: Array) -> Array:
        """Return leftᵀ (∂J/∂q_k) right for every k, (nv,)."""
        hessian = configuration.hessian(self.frame)[self._rows]
        return np.einsum("m,mjk,j->k", left, hessian, right)


@dataclass(frozen=True)
class VelocityRatio(_Ratio):
    """Speed of a frame along u for joint velocities of norm 1, β = (uᵀ (J Jᵀ)⁻¹ u)^(−1/2).

    Climbing it finds postures that actuate a velocity well along u, or that control a force well; descending
    it, postures that control the velocity finely. At a singularity where u is lost, β = 0 has a kink as |x|
    has one, and the gradient is the slope to one side of it.

    With y = (J Jᵀ)⁻¹ u, ∂β/∂q_k = β³ yᵀ (∂J/∂q_k) Jᵀ y.

    Args:
        frame: Name of the frame.
        direction: u in the axes of the world, one number for each of the chosen axes, of any length but zero.
        axes: Rows of J, all linear ("xyz") or all angular (" rpy").

    Raises:
        InvalidValue: No axis is chosen, or axes of two units; or the direction is zero or does not fit.

    Source:
        Equation (3.128); Chiu (1988), International Journal of Robotics Research 7(5).
    """

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of β: "m" or "" (per radian of the joints)."""
        return "m" if self._rows.max() < 3 else ""

    def value(self, configuration: Configuration) -> float:
        """Return β(q); see `Objective.value`."""
        U, sigma, _ = self._factors(configuration)
        return 1.0 / float(np.linalg.norm((U.T @ self._unit) / sigma))

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂β/∂q (nv,); see `Objective.gradient`."""
        U, sigma, Vt = self._factors(configuration)
        shares = (U.T @ self._unit) / sigma
        beta = 1.0 / float(np.linalg.norm(shares))
        y, Jt_y = U @ (shares / sigma), shares @ Vt
        return self._slopes(configuration, beta**2 * y, beta * Jt_y)

    def _factors(self, configuration: Configuration) -> tuple[Array, Array, Array]:
        """Return U (m, m), σ (m,) and Vᵀ (m, nv) of J, with σ raised to a floor so that it can divide."""
        J = self._jacobian(configuration)
        if J.shape[0] > J.shape[1]:
            raise InvalidValue(
                f"{configuration.robot.name} has fewer joints than axes={self.axes!r}; choose fewer"
            )
        U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
        return U, np.maximum(sigma, RATIO_FLOOR * sigma[0]), Vt


@dataclass(frozen=True)
class ForceRatio(_Ratio):
    """Force along u that joint torques of norm 1 balance, α = (uᵀ J Jᵀ u)^(−1/2).

    Climbing it finds postures that actuate a force well along u, or that control a velocity well. It grows
    beyond all bounds near a singularity that loses u, where the structure bears the force; so climb it
    together with something that keeps away, or keep it above a value with `ObjectiveTask`.

    ∂α/∂q_k = −α³ uᵀ (∂J/∂q_k) Jᵀ u.

    Args:
        frame: Name of the frame.
        direction: u in the axes of the world, one number for each of the chosen axes, of any length but zero.
        axes: Rows of J, all linear ("xyz") or all angular (" rpy").

    Raises:
        InvalidValue: No axis is chosen, or axes of two units; or the direction is zero or does not fit.

    Source:
        Equation (3.127); Chiu (1988), International Journal of Robotics Research 7(5).
    """

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of α: "1/m" or "" (per newton metre of the joints)."""
        return "1/m" if self._rows.max() < 3 else ""

    def value(self, configuration: Configuration) -> float:
        """Return α(q); see `Objective.value`."""
        return 1.0 / self._torque(self._jacobian(configuration))[1]

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂α/∂q (nv,); see `Objective.gradient`."""
        torque, size = self._torque(self._jacobian(configuration))
        return -self._slopes(configuration, self._unit, torque) / size**3

    def _torque(self, J: Array) -> tuple[Array, float]:
        """Return Jᵀ u (nv,), and its norm raised to a floor so that it can divide."""
        torque = J.T @ self._unit
        return torque, max(float(np.linalg.norm(torque)), RATIO_FLOOR * float(np.linalg.norm(J, 2)))
