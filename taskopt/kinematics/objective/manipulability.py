"""The distance from kinematic singularities as an objective."""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import JACOBI_DONE, JACOBI_ORTHOGONAL
from taskopt.jit import kernel
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.objective.base import Objective
from taskopt.kinematics.space import chosen_rows


@dataclass(frozen=True)
class Manipulability(Objective):
    """Distance from singularities, w = √det(J Jᵀ), the product of the singular values of a Jacobian.

    J has the chosen rows of the frame's geometric Jacobian, in the axes of the world. If k of these rows are
    among x, y, z, the unit of w is m^k.

    The gradient is ∂w/∂q_k = w tr(∂J/∂q_k Jᵀ (J Jᵀ)⁻¹). With the singular value decomposition J = Σ σ_i u_i
    v_iᵀ, the factor w Jᵀ (J Jᵀ)⁻¹ is Σ (Π_{j≠i} σ_j) v_i u_iᵀ, which stays finite where w = 0. At such a
    singularity w has a kink, like |x| for a square J and a cone like ‖x‖ otherwise; the gradient is then a
    slope on one side, so that climbing leaves the singularity.

    Args:
        frame: Name of the frame.
        axes: Rows of J: letters of "xyz" and, after a blank, of "rpy".

    Raises:
        InvalidValue: No row is chosen; or, when first used, fewer joints than rows move the frame.

    Source:
        Equation (3.56) and Problem 3.8; Yoshikawa (1985), International Journal of Robotics Research 4(2).
    """

    frame: str
    axes: str = "xyz rpy"
    _rows: IntArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rows", chosen_rows(self.axes, "xyzrpy"))

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of w: "", "m", "m²" or "m³"."""
        return ("", "m", "m²", "m³")[int((self._rows < 3).sum())]

    def value(self, configuration: Configuration) -> float:
        """Return w(q); see `Objective.value`."""
        return self._value_and_gradient(configuration)[0]

    def gradient(self, configuration: Configuration) -> Array:
        """Return ∂w/∂q (nv,); see `Objective.gradient`."""
        return self._value_and_gradient(configuration)[1]

    def _value_and_gradient(self, configuration: Configuration) -> tuple[float, Array]:
        """Return w and ∂w/∂q."""
        robot, columns = configuration.robot, configuration.frame(self.frame).columns
        if len(self._rows) > len(columns):
            raise InvalidValue(
                f"manipulability of '{self.frame}' in {len(self._rows)} axes is 0 everywhere, as only "
                f"{len(columns)} joint(s) move it; choose fewer axes, as in axes='xy'"
            )
        out = np.zeros(robot.nv)
        jacobian = configuration.jacobian(self.frame)
        w = _manipulability_into(jacobian, self._rows, columns, robot.column_joint, out)
        return w, out


@kernel
def _manipulability_into(jacobian, rows, columns, column_joint, out):
    """Return w, and write the gradient into `columns` of `out` (nv,); its other entries must be zero."""
    m, n = len(rows), len(columns)
    B, U = np.empty((m, n)), np.eye(m)
    for i in range(m):
        for j in range(n):
            B[i, j] = jacobian[rows[i], columns[j]]
    _orthogonalise_rows(B, U)
    sigma, w = np.zeros(m), 1.0
    for i in range(m):
        for j in range(n):
            sigma[i] += B[i, j] * B[i, j]
        sigma[i] = np.sqrt(sigma[i])
        w *= sigma[i]
    slope = np.zeros((6, n))  # ∂w/∂J on the columns, Σ (Π_{j≠i} σⱼ) uᵢ vᵢᵀ
    for i in range(m):
        others = 1.0
        for j in range(m):
            if j != i:
                others *= sigma[j]
        if others > 0.0:
            if sigma[i] == 0.0:
                _fill_beside(B, sigma, i)
            size = sigma[i] if sigma[i] > 0.0 else 1.0
            for r in range(m):
                for j in range(n):
                    slope[rows[r], j] += others * U[r, i] * B[i, j] / size
    _contract_with_hessian(slope, jacobian, columns, column_joint, out)
    return w


@kernel
def _orthogonalise_rows(B, U):
    """Rotate the rows of B (m, n) until they are orthogonal, by B ← UᵀB, which gives B = Σ Vᵀ.

    The one-sided method of Jacobi keeps the digits of small singular values, which are lost in J Jᵀ. Hestenes
    (1958), Journal of the Society for Industrial and Applied Mathematics 6(1).
    """
    m, n = B.shape
    for _ in range(30):
        largest = 0.0
        for p in range(m - 1):
            for q in range(p + 1, m):
                pp = qq = pq = 0.0
                for j in range(n):
                    pp += B[p, j] * B[p, j]
                    qq += B[q, j] * B[q, j]
                    pq += B[p, j] * B[q, j]
                if abs(pq) <= JACOBI_ORTHOGONAL * np.sqrt(pp) * np.sqrt(qq):
                    continue
                largest = max(largest, abs(pq) / (np.sqrt(pp) * np.sqrt(qq)))
                zeta = (qq - pp) / (2.0 * pq)
                t = np.copysign(1.0, zeta) / (abs(zeta) + np.hypot(1.0, zeta))  # ζ² could overflow
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = c * t
                for j in range(n):
                    B[p, j], B[q, j] = c * B[p, j] - s * B[q, j], s * B[p, j] + c * B[q, j]
                for j in range(m):
                    U[j, p], U[j, q] = c * U[j, p] - s * U[j, q], s * U[j, p] + c * U[j, q]
        if largest < JACOBI_DONE:  # converges quadratically: the rotations just made have finished it
            return


@kernel
def _fill_beside(B, sigma, empty):
    """Set the zero row `empty` of B to a unit vector (n,) that is orthogonal to all other rows."""
    n = B.shape[1]
    v, largest = np.empty(n), 0.0
    for k in range(n):
        v[:] = 0.0
        v[k] = 1.0
        for i in range(B.shape[0]):
            if i != empty:
                share = B[i, k] / (sigma[i] * sigma[i])
                for j in range(n):
                    v[j] -= share * B[i, j]
        squared = 0.0
        for j in range(n):
            squared += v[j] * v[j]
        if squared > largest:
            largest = squared
            for j in range(n):
                B[empty, j] = v[j] / np.sqrt(squared)


@kernel
def _contract_with_hessian(slope, jacobian, columns, column_joint, out):
    """Write out_k = Σ slope[r, j] ∂J[r, j]/∂q_k; the derivative is that of `frame_hessian_into`."""
    for k in columns:
        vx, vy, vz = jacobian[0, k], jacobian[1, k], jacobian[2, k]
        wx, wy, wz = jacobian[3, k], jacobian[4, k], jacobian[5, k]
        total = 0.0
        for i, j in enumerate(columns):
            if column_joint[k] <= column_joint[j]:
                for part in range(0, 6, 3):
                    x, y, z = jacobian[part, j], jacobian[part + 1, j], jacobian[part + 2, j]
                    total += slope[part, i] * (wy * z - wz * y)
                    total += slope[part + 1, i] * (wz * x - wx * z)
                    total += slope[part + 2, i] * (wx * y - wy * x)
            else:
                x, y, z = jacobian[3, j], jacobian[4, j], jacobian[5, j]
                total += slope[0, i] * (y * vz - z * vy)
                total += slope[1, i] * (z * vx - x * vz)
                total += slope[2, i] * (x * vy - y * vx)
        out[k] = total
