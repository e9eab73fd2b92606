"""Euler angles: any set of three successive rotations about axes of the current frame."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import REPRESENTATION_SINGULAR
from taskopt.kinematics.orientation.skew import skew

_LETTERS = "XYZ"


@dataclass(frozen=True)
class EulerAngles:
    """A set of Euler angles (φ, ϑ, ψ): R = R_a(φ) R_b(ϑ) R_c(ψ), each about an axis of the current frame.

    The chapter uses two sets: ZYZ, and roll, pitch and yaw (RPY), which turn about x, y and z of the fixed
    frame, first ψ, then ϑ, then φ. The latter is ZYX in the current frame, R = R_z(φ) R_y(ϑ) R_x(ψ).

    Attributes:
        axes: Three letters of "XYZ", no two neighbours alike: the axes a, b and c.
        name: Name in messages and logs; default: the letters.

    Raises:
        InvalidValue: The axes are other letters, or two neighbours are alike.

    Source:
        Sect. 2.4 and 3.6 of the textbook.
    """

    axes: str
    name: str = ""

    def __post_init__(self) -> None:
        a = self.axes if isinstance(self.axes, str) else ""
        if len(a) != 3 or not set(a) <= set(_LETTERS) or a[0] == a[1] or a[1] == a[2]:
            raise InvalidValue(
                "axes must be three letters of XYZ, no two neighbours alike, such as 'ZYZ'; "
                f"got {self.axes!r}"
            )
        if not self.name:
            object.__setattr__(self, "name", a)

    @property
    def representation_singularity(self) -> str:
        """Condition, such as "sin ϑ = 0", under which the rates of the angles cannot express every ω."""
        return "sin ϑ = 0" if self._proper else "cos ϑ = 0"

    def rotation(self, angles: ArrayLike) -> Array:
        """Compute the rotation matrix R(φ) = R_a(φ) R_b(ϑ) R_c(ψ).

        Args:
            angles: φ (3,) [rad].

        Returns:
            R (3, 3).

        Raises:
            InvalidValue: The angles are not three finite numbers.

        Source:
            (2.18) for ZYZ, (2.21) for RPY.
        """
        phi = finite("angles", angles, (3,))
        a, b, c = self._indices
        return _elementary(a, phi[0]) @ _elementary(b, phi[1]) @ _elementary(c, phi[2])

    def angles(self, rotation: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Compute the angles of a rotation matrix.

        Every rotation has two sets of angles, and full turns of 2π may be added to each angle. Without
        `near`, ϑ is in [0, π] for sets such as ZYZ and in [−π/2, π/2] for those such as RPY, and φ and ψ are
        in [−π, π]. At a representation singularity only φ + ψ or φ − ψ is determined; φ is then that of
        `near`, or 0.

        Args:
            rotation: R (3, 3).
            near: (3,) [rad] angles at the last point of a path; the set nearest to them is returned, so that
                angles along the path are continuous.

        Returns:
            φ (3,) [rad].

        Raises:
            InvalidValue: The rotation is not 3×3 finite numbers, or `near` not three.

        Source:
            (2.19) for ZYZ, (2.22) for RPY.
        """
        R = finite("rotation", rotation, (3, 3))
        wanted = None if near is None else finite("near", near, (3,))
        first = self._principal(R, 0.0 if wanted is None else wanted[0])
        if wanted is None:
            return first
        middle = -first[1] if self._proper else np.pi - first[1]
        second = np.array([first[0] + np.pi, middle, first[2] + np.pi])
        both = [wanted + _wrapped(phi - wanted) for phi in (first, second)]
        return min(both, key=lambda phi: float(np.linalg.norm(phi - wanted)))

    def rate_map(self, angles: ArrayLike) -> Array:
        """Compute T(φ), which maps rates of the angles to the angular velocity, ω = T(φ) φ̇.

        The columns of T are the three axes of rotation in the world.

        Args:
            angles: φ (3,) [rad].

        Returns:
            T (3, 3).

        Raises:
            InvalidValue: The angles are not three finite numbers.

        Source:
            Equation (3.64); Problem 3.12 for RPY.
        """
        phi = finite("angles", angles, (3,))
        a, b, c = self._indices
        first = _elementary(a, phi[0])
        second = first @ _elementary(b, phi[1])
        return np.column_stack([np.eye(3)[a], first[:, b], second[:, c]])

    def rate_map_rate(self, angles: ArrayLike, rates: ArrayLike) -> Array:
        """Compute the derivative of T(φ) along rates of the angles.

        The derivative is not zero because each axis turns with the rotations before it.

        Args:
            angles: φ (3,) [rad].
            rates: φ̇ (3,) [rad/s].

        Returns:
            Ṫ (3, 3) [1/s].

        Raises:
            InvalidValue: An argument is not three finite numbers.

        Source:
            Derivative of (3.64), for J̇_A of (3.98).
        """
        T, dot = self.rate_map(angles), finite("rates", rates, (3,))
        second = skew(dot[0] * T[:, 0]) @ T[:, 1]
        third = skew(dot[0] * T[:, 0] + dot[1] * T[:, 1]) @ T[:, 2]
        return np.column_stack([np.zeros(3), second, third])

    def determinant(self, angles: ArrayLike) -> float:
        """Compute det T(φ): ∓sin ϑ for sets such as ZYZ, ±cos ϑ for those such as RPY.

        Args:
            angles: φ (3,) [rad].

        Returns:
            det T, −sin ϑ for ZYZ and −cos ϑ for RPY.

        Raises:
            InvalidValue: The angles are not three finite numbers.

        Source:
            Below (3.64).
        """
        theta = finite("angles", angles, (3,))[1]
        return self._sign * float(np.sin(theta) if self._proper else np.cos(theta))

    def rates(self, angles: ArrayLike, angular_velocity: ArrayLike) -> Array:
        """Compute the rates of the angles of a rotating frame, φ̇ = T(φ)⁻¹ ω.

        Args:
            angles: φ (3,) [rad].
            angular_velocity: ω (3,) [rad/s], or a matrix (3, k) whose columns are angular velocities, such as
                J_O.

        Returns:
            φ̇ (3,) [rad/s], or (3, k).

        Raises:
            InvalidValue: φ is at a representation singularity, where T(φ) has no inverse; or an argument has
                the wrong shape.

        Source:
            Equation (3.64).
        """
        columns = (3,) if np.ndim(angular_velocity) == 1 else (3, None)
        omega = finite("angular_velocity", angular_velocity, columns)
        if abs(self.determinant(angles)) < REPRESENTATION_SINGULAR:
            raise InvalidValue(
                f"the {self.name} angles {np.array2string(np.asarray(angles), precision=6)} rad are at a "
                f"representation singularity, {self.representation_singularity}; use another set of angles, "
                "the quaternion, or the rotation vector there"
            )
        return np.linalg.inv(self.rate_map(angles)) @ omega

    @property
    def _indices(self) -> tuple[int, int, int]:
        """Indices of the three axes."""
        a, b, c = (_LETTERS.index(letter) for letter in self.axes)
        return a, b, c

    @property
    def _proper(self) -> bool:
        """True if the first and the last axis are the same."""
        return self.axes[0] == self.axes[2]

    @property
    def _sign(self) -> float:
        """+1 if the axes a, b and the remaining one are in the cyclic order of x, y, z, else −1."""
        a, b, _ = self._indices
        return 1.0 if (b - a) % 3 == 1 else -1.0

    def _principal(self, R: Array, free: float) -> Array:
        """Return the angles with ϑ in its principal range; where φ is not determined, it is `free`."""
        a, b, c = self._indices
        s, k = self._sign, 3 - a - b
        if self._proper:
            across, along, middle = R[b, a], -s * R[k, a], R[a, a]
            theta = np.arctan2(np.hypot(across, along), middle)
        else:
            across, along, middle = -s * R[b, c], R[c, c], s * R[a, c]
            theta = np.arctan2(middle, np.hypot(across, along))
        singular = np.hypot(across, along) < REPRESENTATION_SINGULAR
        phi = free if singular else np.arctan2(across, along)
        last = (_elementary(a, phi) @ _elementary(b, theta)).T @ R  # R_c(ψ), whatever φ was chosen
        p, q = (c + 1) % 3, (c + 2) % 3
        return np.array([phi, theta, np.arctan2(last[q, p], last[p, p])])


def _elementary(axis: int, angle: float) -> Array:
    """Return the rotation (3, 3) by an angle [rad] about x (0), y (1) or z (2)."""
    p, q = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[p, p] = R[q, q] = np.cos(angle)
    R[q, p] = np.sin(angle)
    R[p, q] = -R[q, p]
    return R


def _wrapped(angles: Array) -> Array:
    """Return angles [rad] moved into [−π, π] by full turns."""
    return np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi


ZYZ = EulerAngles("ZYZ")
RPY = EulerAngles("ZYX", "RPY")
XYZ = EulerAngles("XYZ")
