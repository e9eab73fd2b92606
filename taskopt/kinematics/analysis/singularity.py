"""Kinematic singularities: rank, lost directions, arm and wrist singularities, their kind, and maps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import qmc

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import CURVED, JACOBIAN_RANK, WRIST_AXES_MEET
from taskopt.kinematics.analysis.redundancy import subspaces
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.orientation.skew import skew
from taskopt.kinematics.robot import Robot

Kind = Literal["regular", "boundary", "internal"]


@dataclass(frozen=True, eq=False)
class Singularity:
    """The distance of a Jacobian J (m, n) from a loss of rank, and the directions that are lost.

    Attributes:
        rank: Rank of J: the number of independent directions in which the frame can move.
        singular_values: Singular values of J, (min(m, n),), in falling order.
        lost: (m, m − rank) unit vectors in the columns: directions in which the frame cannot move.
        idle: (n, n − rank) unit vectors in the columns: joint motions that do not move the frame.
    """

    rank: int
    singular_values: Array
    lost: Array
    idle: Array

    @property
    def is_singular(self) -> bool:
        """True if J does not have full rank."""
        return self.rank < self.singular_values.size

    @property
    def distance(self) -> float:
        """Smallest singular value: the distance to the nearest matrix of lower rank, in the spectral norm."""
        return float(self.singular_values[-1])

    @property
    def ratio(self) -> float:
        """Ratio σ_r/σ_1, the inverse of the condition number; 1 where all directions are equally fast."""
        largest = float(self.singular_values[0])
        return self.distance / largest if largest > 0.0 else 0.0

    @property
    def manipulability(self) -> float:
        """Product of the singular values, w = √det(J Jᵀ) for m ≤ n, see (3.56)."""
        return float(np.prod(self.singular_values))


def find_singularity(J: ArrayLike, tolerance: float = JACOBIAN_RANK) -> Singularity:
    """Analyse a Jacobian: its rank, its distance from singularity, and the directions that are lost.

    Args:
        J: The rows of a Jacobian that matter, (m, n). Metres and radians cannot be compared, so give rows of
            one unit.
        tolerance: Singular value, relative to the largest, below which a direction counts as lost.

    Returns:
        Rank, singular values, lost directions, and joint motions that do not move the frame.

    Raises:
        InvalidValue: J is not a matrix of finite numbers.

    Source:
        Sect. 3.3 and 3.9, Problem 3.8.
    """
    bases = subspaces(J, tolerance)
    sigma: Array = np.linalg.svd(finite("J", J, (None, None)), compute_uv=False).astype(np.float64)
    return Singularity(bases.rank, sigma, bases.null_of_transpose, bases.null)


@dataclass(frozen=True, eq=False)
class Decoupling:
    """The Jacobian of a frame at the wrist centre, in blocks [[arm, 0], [coupling, wrist]].

    Attributes:
        arm: J₁₁ (3, n − 3): velocity of the wrist centre that the joints before the wrist cause.
        coupling: J₂₁ (3, n − 3): angular velocity that the same joints cause.
        wrist: J₂₂ (3, 3): angular velocity that the wrist joints cause.
        centre: (3,) [m] point where the wrist axes meet, in the world.
    """

    arm: Array
    coupling: Array
    wrist: Array
    centre: Array

    @property
    def arm_measure(self) -> float:
        """det J₁₁ with three joints before the wrist, else √det(J₁₁ J₁₁ᵀ); zero at an arm singularity."""
        if self.arm.shape[1] == 3:
            return float(np.linalg.det(self.arm))
        return float(np.sqrt(max(0.0, np.linalg.det(self.arm @ self.arm.T))))

    @property
    def wrist_measure(self) -> float:
        """det J₂₂ = ±sin ϑ₅ for a wrist of ZYZ axes; zero at a wrist singularity."""
        return float(np.linalg.det(self.wrist))


def decouple(configuration: Configuration, frame: str) -> Decoupling:
    """Split the Jacobian of a frame into those of arm and wrist, with det J = det J₁₁ det J₂₂.

    The last three joints must be revolute, with axes that meet in a point, the wrist centre. For a frame at
    that point the wrist causes no linear velocity, so that the block J₁₂ is zero.

    Args:
        configuration: The robot at q.
        frame: Name of a frame behind the wrist.

    Returns:
        The blocks.

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: The last three joints that move the frame are not a spherical wrist, or fewer than six
            joints move it.

    Source:
        Equations (3.42), (3.43) and (3.44).
    """
    columns, J = configuration.frame(frame).columns, configuration.jacobian(frame)
    if len(columns) < 6:
        raise InvalidValue(f"{len(columns)} joints move '{frame}'; arm and wrist need at least six")
    wrist, p = columns[-3:], configuration.pose(frame)[:3, 3]
    axes = J[3:, wrist]
    lengths = np.linalg.norm(axes, axis=0)
    if (np.abs(lengths - 1.0) > WRIST_AXES_MEET).any():
        raise InvalidValue(
            f"the last three joints that move '{frame}' are not all revolute: no spherical wrist"
        )
    centre = p + _meeting_point(axes, J[:3, wrist], frame)
    J[:3] -= skew(centre - p) @ J[3:]
    arm = columns[:-3]
    return Decoupling(J[:3, arm], J[3:, arm], J[3:, wrist], centre)


def _meeting_point(axes: Array, velocities: Array, frame: str) -> Array:
    """Return the point (3,) [m], relative to the frame's origin, that no wrist joint moves.

    A joint moves the point r by its velocity of the frame's origin plus z × r = −S(r) z.
    """
    system = np.vstack([skew(z) for z in axes.T])
    point: Array = np.linalg.lstsq(system, -velocities.T.ravel(), rcond=None)[0].astype(np.float64)
    miss = float(np.abs(system @ point + velocities.T.ravel()).max())
    if miss > WRIST_AXES_MEET:
        raise InvalidValue(
            f"the last three axes that move '{frame}' pass each other by {miss:.3g} m: no spherical wrist, "
            "so arm and wrist cannot be told apart; use find_singularity on the whole Jacobian"
        )
    return point


def classify_singularity(configuration: Configuration, frame: str, rows: Sequence[int]) -> Kind:
    """Classify a posture: the frame is at a boundary singularity, at an internal one, or at none.

    To first order the frame cannot move along the lost direction u. Joint motions δ in the null space of J
    displace it along u to second order only, by ½ δᵀ H δ with H = Σ u_i ∂²x_i/∂q². If all of them displace it
    to the same side, the arm is stretched out or folded, and the frame is at a boundary that it cannot cross.
    If they displace it to both sides or not at all, the frame is in the interior of the workspace.

    Args:
        configuration: The robot at q.
        frame: Name of the frame.
        rows: Rows of its velocity that matter: 0, 1, 2 for x, y, z, and 3, 4, 5 for rotations, along the axes
            of the world.

    Returns:
        "regular", "boundary" or "internal". The statement is local: in another posture the robot may reach
        beyond the boundary.

    Raises:
        UnknownName: The robot lacks the frame.

    Source:
        Sect. 3.3; the criterion of second order is our own.
    """
    kept = list(rows)
    bases = subspaces(configuration.jacobian(frame)[kept])
    if bases.rank == min(len(kept), bases.null.shape[0]):
        return "regular"
    hessian = configuration.hessian(frame)[kept]
    curvatures = np.einsum("ma,mjk,jp,kr->apr", bases.null_of_transpose, hessian, bases.null, bases.null)
    curvatures = 0.5 * (curvatures + curvatures.transpose(0, 2, 1))
    mean = np.einsum("app->a", curvatures)  # where several directions are lost, the one that curves most
    candidates = [*curvatures, np.einsum("a,apr->pr", mean, curvatures)]
    scale = max(float(np.abs(hessian).max()), np.finfo(float).tiny)
    for candidate in candidates:
        eigenvalues = np.linalg.eigvalsh(candidate) / scale
        to_both = eigenvalues.min() < -CURVED and eigenvalues.max() > CURVED
        if np.abs(eigenvalues).max() > CURVED and not to_both:
            return "boundary"
    return "internal"


@dataclass(frozen=True, eq=False)
class WorkspaceMap:
    """Distance of a frame from singularity, at many postures.

    Attributes:
        q: Postures, (k, nq) [rad, m].
        points: Positions of the frame, (k, 3) [m] in the world.
        singular_values: Singular values of the chosen rows of its Jacobian, (k, r), in falling order.
    """

    q: Array
    points: Array
    singular_values: Array

    @property
    def distance(self) -> Array:
        """(k,) smallest singular value at each posture."""
        return self.singular_values[:, -1]

    @property
    def manipulability(self) -> Array:
        """(k,) product of the singular values at each posture."""
        return self.singular_values.prod(axis=1)


def workspace_map(
    robot: Robot, frame: str, rows: Sequence[int] = (0, 1, 2), count: int = 4096, seed: int = 0
) -> WorkspaceMap:
    """Sample postures over all joint ranges, and measure the distance from singularity at each.

    Args:
        robot: The robot.
        frame: Name of the frame.
        rows: Indices of the rows of its velocity that matter, along the axes of the world.
        count: Number of postures; a power of two covers the ranges most evenly.
        seed: Seed of the quasi-random sequence of Sobol.

    Returns:
        The map.

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: A prismatic joint has no limits, or a joint has a quaternion.
    """
    lower, upper = robot.position_lower.copy(), robot.position_upper.copy()
    if robot.nq != robot.nv:
        raise InvalidValue(
            f"{robot.name} has joints of several coordinates; lock them for a map of its workspace"
        )
    free = ~(np.isfinite(lower) & np.isfinite(upper))
    units = zip(robot.velocity_names, robot.coordinate_units, free, strict=True)
    unlimited = [name for name, unit, is_free in units if is_free and unit == "m"]
    if unlimited:
        raise InvalidValue(f"{', '.join(unlimited)} of {robot.name} can slide without limit; give it limits")
    lower[free], upper[free] = -np.pi, np.pi
    q = qmc.scale(qmc.Sobol(robot.nq, rng=seed).random(count), lower, upper)
    at, kept = Configuration(robot, robot.neutral), list(rows)
    points, sigma = np.empty((count, 3)), np.empty((count, min(len(kept), robot.nv)))
    for i, posture in enumerate(q):
        at.update(posture)
        points[i] = at.pose(frame)[:3, 3]
        sigma[i] = np.linalg.svd(at.jacobian(frame)[kept], compute_uv=False)
    return WorkspaceMap(q, points, sigma)
