"""`transpose`, the algorithm with the transposed Jacobian, x = Jᵀ K e, which needs no inverse."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import inverse_root
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import TRANSPOSE_STUCK
from taskopt.resolver.base import Memory, answered_by_x, checked
from taskopt.resolver.closed_form import task_priority


@dataclass(frozen=True)
class Transpose:
    """Resolve along the gradient of the error, x = W⁻¹ Aᵀ diag(w) b.

    For a task whose target has no rate (`WithoutRate`), b = K e and this is (3.76). The error decreases
    unless b is in the null space of Aᵀ. In that case the arm is stuck, and a note of the resolution says so;
    with one level x = 0 is then also the least-squares optimum, so that a pseudo-inverse would not move the
    arm either. A step of Δt is stable for gains below `largest_gain`. All levels act together, without
    priorities. The answer is not an optimum of the hierarchy, and its status is always FORMULA. The resolver
    ignores limits on single unknowns, and refuses inequalities and hard rows.

    Attributes:
        name: Name of the resolver.
        strict: False, since priorities between levels are not kept.

    Source:
        Equations (3.73)–(3.77); Wolovich and Elliott (1984), IEEE Conference on Decision and Control.
    """

    name: str = "transpose"
    strict: bool = False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy by formula.

        Args:
            hierarchy: The problem of this tick, equalities on all levels.
            memory: Memory that the last call returned, which is checked but not used.

        Returns:
            The answer, with a note if the arm is stuck, and an empty memory.

        Raises:
            InvalidValue: A row is an inequality or hard, or the memory belongs to another layout.
        """
        checked(memory, hierarchy.layout)
        A, b, weight = self._equalities(hierarchy)
        torque = A.T @ (weight * b)
        root = inverse_root(hierarchy.norm)
        x = root @ (root.T @ torque)
        answer = answered_by_x(hierarchy, x, Status.FORMULA)
        if is_stuck(A, weight * b):
            answer = answer.replaced(notes=(_stuck_note(hierarchy.layout),))
        return answer, Memory(np.zeros(hierarchy.layout.width, dtype=np.int8))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority`, to which the answer of the transpose can be compared."""
        return task_priority(hierarchy)

    def _equalities(self, hierarchy: Hierarchy) -> tuple[Array, Array, Array]:
        """Return A, b and weights of the rows of all levels; raise `InvalidValue` if one is no equality."""
        first = int(hierarchy.layout.offsets[1])
        unequal = np.flatnonzero(hierarchy.lower[first:] != hierarchy.upper[first:])
        if unequal.size:
            row = hierarchy.layout.row_names[first + int(unequal[0])]
            raise InvalidValue(f"{self.name} knows no inequality, got {row}; use hqp/… or active-set")
        if (hierarchy.lower[:first] == hierarchy.upper[:first]).any():
            raise InvalidValue(f"{self.name} keeps no hard row; use pinv, hqp/… or active-set")
        return hierarchy.A[first:], hierarchy.upper[first:], hierarchy.weight[first:]


def _stuck_note(layout: Layout) -> str:
    """Return a note which says that the arm is stuck, on which rows, and what helps."""
    rows = ", ".join(layout.row_names[int(layout.offsets[1]) :])
    # On one level Jᵀ W K e = 0 is also the optimality condition of x = 0, so no inverse helps.
    inverse = "An inverse of J would not move it either. " if layout.level_count == 1 else ""
    return (
        f"The transposed Jacobian is stuck: the error of {rows} lies in the null space of Jᵀ, in which no "
        f"joint moves the task. {inverse}Take another start, or a target beside that direction."
    )


def is_stuck(J: ArrayLike, force: ArrayLike) -> bool:
    """Return True if a force K e that is not zero needs no torque, so that the arm does not move.

    Args:
        J: Rows (m, n).
        force: K e (m,), in any unit.

    Raises:
        InvalidValue: An argument is not finite, or they do not fit.

    Returns:
        True if ‖Jᵀ K e‖ is zero up to rounding while K e is not zero.

    Source:
        Example 3.4: K e in the null space of Jᵀ.
    """
    matrix = finite("J", J, (None, None))
    pull = finite("force", force, (matrix.shape[0],))
    size = float(np.linalg.norm(matrix, 2)) * float(np.linalg.norm(pull))
    return bool(pull.any()) and float(np.linalg.norm(matrix.T @ pull)) <= TRANSPOSE_STUCK * size


def largest_gain(J: ArrayLike, dt: float) -> float:
    """Return the gain 2/(Δt σ_1²) below which steps q ← q + Δt Jᵀ k e to a fixed target converge.

    To first order the error becomes (I − Δt k J Jᵀ) e, and no eigenvalue of this matrix may fall below −1.
    For a diagonal K in place of k, pass K^½ J as `J`: K is small enough if the result is above 1, since K J
    Jᵀ and K^½ J Jᵀ K^½ have the same eigenvalues.

    Args:
        J: Rows (m, n).
        dt: Δt [s], the period.

    Returns:
        k, in 1/s divided by the squared unit of J; inf if J is zero.

    Raises:
        InvalidValue: J is not a matrix of finite numbers, or Δt is not positive.

    Source:
        The upper bound on K of Sect. 3.7.2.
    """
    sigma = float(np.linalg.norm(finite("J", J, (None, None)), 2))
    return 2.0 / (positive("dt", dt) * sigma**2) if sigma > 0.0 else np.inf
