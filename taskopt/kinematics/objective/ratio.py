"""Transformation ratios of velocity and of force along a direction as objectives."""

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
    """Base of both ratios, which holds the frame, the direction, and the rows of its axes."""

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

    J has the chosen rows of the frame's geometric Jacobian. Climbing β leads to postures in which the joints
    move the frame fast along u, or control a force along u accurately; descending it leads to postures that
    control the velocity accurately. At a singularity where motion along u is lost, β is 0 and has a kink like
    |x|; the gradient is then the slope on one side of the kink.

    The gradient is ∂β/∂q_k = β³ yᵀ (∂J/∂q_k) Jᵀ y with y = (J Jᵀ)⁻¹ u.

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
        """Return U (m, m), σ (m,) and Vᵀ (m, nv) of J, with σ raised to a small minimum to allow division."""
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

    J has the chosen rows of the frame's geometric Jacobian. Climbing α leads to postures in which small joint
    torques exert a large force along u, or which control a velocity along u accurately. α grows without bound
    near a singularity where motion along u is lost, since the structure then bears the force. Climb it
    therefore together with an objective that avoids singularities, or keep it above a value with
    `ObjectiveTask`.

    The gradient is ∂α/∂q_k = −α³ uᵀ (∂J/∂q_k) Jᵀ u.

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
        """Return Jᵀ u (nv,), and its norm raised to a small minimum to allow division."""
        torque = J.T @ self._unit
        return torque, max(float(np.linalg.norm(torque)), RATIO_FLOOR * float(np.linalg.norm(J, 2)))
