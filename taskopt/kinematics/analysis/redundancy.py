"""Redundancy: the four subspaces of a Jacobian, redundant degrees of freedom, and internal motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.tolerances import INTERNAL_MOTION, JACOBIAN_RANK
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import log3

ALL_ROWS = (0, 1, 2, 3, 4, 5)
_CORRECTIONS = 20  # Newton steps back to the pose after each step along the null space; three are usual


@dataclass(frozen=True, eq=False)
class Subspaces:
    """Orthonormal bases of the four subspaces of a matrix J (m, n); the columns of each array are a basis.

    The range of J and the null space of Jᵀ together span the space of velocities and of forces of the frame.
    The null space of J and the range of Jᵀ together span the space of velocities and of torques of the
    joints.

    Attributes:
        range: (m, rank) velocities that the joints can produce, R(J).
        null: (n, n − rank) joint velocities that produce no velocity of the frame, N(J).
        range_of_transpose: (n, rank) torques that balance forces, R(Jᵀ).
        null_of_transpose: (m, m − rank) forces that need no torque, N(Jᵀ).

    Source:
        Sect. 3.4 and 3.8.1.
    """

    range: Array
    null: Array
    range_of_transpose: Array
    null_of_transpose: Array

    @property
    def rank(self) -> int:
        """Dimension of the range of J."""
        return self.range.shape[1]

    @property
    def redundant_dofs(self) -> int:
        """Number of redundant degrees of freedom, n − m; 0 if there are no more joints than rows."""
        return max(0, self.null.shape[0] - self.range.shape[0])


def subspaces(J: ArrayLike, tolerance: float = JACOBIAN_RANK) -> Subspaces:
    """Compute bases of the range and the null space of a matrix and of its transpose.

    Args:
        J: Matrix (m, n). Leave out rows that a task does not specify: an arm that is not redundant for six
            rows may be redundant for two of them, which is called functional redundancy.
        tolerance: Singular value, relative to the largest, below which a direction counts as lost.

    Returns:
        The bases.

    Raises:
        InvalidValue: J is not a matrix of finite numbers.

    Source:
        Equations (3.45) and (3.46).
    """
    U, sigma, Vt = np.linalg.svd(finite("J", J, (None, None)))
    rank = int((sigma > tolerance * sigma.max(initial=0.0)).sum())
    return Subspaces(U[:, :rank], Vt[rank:].T, Vt[:rank].T, U[:, rank:])


def internal_motion(
    configuration: Configuration,
    frame: str,
    *,
    rows: Sequence[int] = ALL_ROWS,
    toward: ArrayLike | None = None,
    length: float = 1.0,
    step: float = 0.02,
) -> Array:
    """Sample an internal motion of the robot, during which a frame stays in place.

    Each step goes along N(J), and Newton's method then brings the frame back to its pose.

    Args:
        configuration: The robot at the first posture.
        frame: Name of the frame that does not move.
        rows: Indices of the rows of its velocity that are zero: 0, 1, 2 for x, y, z and 3, 4, 5 for the
            rotations about them, along the axes of the world. The frame may move along the other rows.
        toward: Joint velocities q̇₀ (nv,) whose part in N(J) is followed. Default: the first null direction,
            in the sense that increases its largest entry.
        length: Length of the path in the space of the joints [rad, m].
        step: Length of one step [rad, m].

    Returns:
        Postures (k, nq), the first one included.

    Raises:
        UnknownName: The robot lacks the frame.
        InvalidValue: No joint motion leaves these rows unchanged, the motion ends at a singularity, or a
            number is out of its range.

    Source:
        The homogeneous solution of (3.54) with v_e = 0, and Sect. 3.4.
    """
    robot, kept = configuration.robot, list(rows)
    count = max(1, round(positive("length", length) / positive("step", step)))
    direction = None if toward is None else finite("toward", toward, (robot.nv,))
    at, goal, postures = (
        Configuration(robot, configuration.q),
        configuration.pose(frame),
        [configuration.q.copy()],
    )
    for _ in range(count):
        along = _null_direction(at.jacobian(frame)[kept], direction, frame)
        direction = along if toward is None else direction
        at.update(robot.integrate(at.q, along, step))
        returned = _return_to(at, frame, goal, kept)
        if not returned or along @ robot.difference(postures[-1], at.q) < 0.5 * step:
            raise InvalidValue(
                f"the internal motion of '{frame}' ends after {len(postures) - 1} steps, at a singularity "
                "where the arm cannot go on; choose a smaller length, or another start"
            )
        postures.append(at.q.copy())
    return np.array(postures)


def _null_direction(J: Array, direction: Array | None, frame: str) -> Array:
    """Return the unit vector (nv,) of N(J) nearest to a direction."""
    null = subspaces(J).null
    if null.shape[1] == 0:
        raise InvalidValue(
            f"no joint motion leaves {J.shape[0]} rows of '{frame}' unchanged: the arm is not redundant "
            "for them; hold fewer rows"
        )
    if direction is None:
        along = null[:, 0]
        return along * np.sign(along[np.argmax(np.abs(along))])
    along = null @ (null.T @ direction)
    size = float(np.linalg.norm(along))
    if size < JACOBIAN_RANK * float(np.linalg.norm(direction)):
        raise InvalidValue(f"the direction that is to be followed moves '{frame}'; choose another one")
    return along / size


def _return_to(at: Configuration, frame: str, goal: Array, rows: list[int]) -> bool:
    """Bring the held rows of a frame back to its pose by Newton's method, in place; False if it fails."""
    for _ in range(_CORRECTIONS):
        pose = at.pose(frame)
        error = np.concatenate([goal[:3, 3] - pose[:3, 3], log3(goal[:3, :3] @ pose[:3, :3].T)])[rows]
        if float(np.abs(error).max()) < INTERNAL_MOTION:
            return True
        at.update(at.robot.integrate(at.q, np.linalg.pinv(at.jacobian(frame)[rows]) @ error, 1.0))
    return False
