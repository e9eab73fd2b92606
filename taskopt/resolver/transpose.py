"""`transpose`: the algorithm with the transposed Jacobian, x = Jᵀ K e, which inverts nothing."""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import inverse_root
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import TRANSPOSE_STUCK
from taskopt.resolver.base import Memory, answered, checked
from taskopt.resolver.closed_form import task_priority


@dataclass(frozen=True)
class Transpose:
    """Resolve by the gradient of the error, x = W⁻¹ Aᵀ diag(w) b.

    With b = K e, the rows of a task whose target has no rate (`WithoutRate`), it is (3.76). The error falls
    as long as b is not in the null space of Aᵀ; there the arm is stuck, and a note of the resolution says so.
    With one level x = 0 then is the least-squares optimum, too: a pseudo-inverse would not move the arm
    either. A step of Δt is stable for gains below `largest_gain`. A gradient knows no priority: all levels
    pull together. The answer is no optimum of the hierarchy, and its status is always FORMULA; it does not
    look at limits, and it refuses inequalities and hard rows.

    Attributes:
        name: Name of the resolver.
        strict: False: levels are not met, only approached.

    Source:
        Equations (3.73)–(3.77); Wolovich and Elliott (1984), IEEE Conference on Decision and Control.
    """

    name: str = "transpose"
    strict: bool = False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy by formula.

        Args:
            hierarchy: The problem of this tick, equalities on all levels.
            memory: What the last call returned; it is checked and not used.

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
        state = np.zeros(hierarchy.layout.width, dtype=np.int8)
        answer, own = answered(hierarchy, x, find_multipliers(hierarchy, x), state, Status.FORMULA)
        if is_stuck(A, weight * b):
            answer = answer.replaced(notes=(_stuck_note(hierarchy.layout),))
        return answer, own

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority`, so that the distance shows what the transpose leaves undone."""
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
    """Say that the arm is stuck, on which rows, and what helps."""
    rows = ", ".join(layout.row_names[int(layout.offsets[1]) :])
    # On one level Jᵀ W K e = 0 is also the optimality condition of x = 0, so no inverse helps.
    inverse = "An inverse of J would not move it either. " if layout.level_count == 1 else ""
    return (
        f"The transposed Jacobian is stuck: the error of {rows} lies in the null space of Jᵀ, in which no "
        f"joint moves the task. {inverse}Take another start, or a target beside that direction."
    )


def is_stuck(J: ArrayLike, force: ArrayLike) -> bool:
    """Return True if a force that is not zero needs no torque, so that the arm does not follow it.

    Args:
        J: Rows (m, n).
        force: K e (m,), in any unit.

    Raises:
        InvalidValue: An argument is not finite, or they do not fit.

    Returns:
        True if ‖Jᵀ K e‖ is zero but for rounding and K e is not.

    Source:
        Example 3.4: K e in the null space of Jᵀ.
    """
    matrix = finite("J", J, (None, None))
    pull = finite("force", force, (matrix.shape[0],))
    size = float(np.linalg.norm(matrix, 2)) * float(np.linalg.norm(pull))
    return bool(pull.any()) and float(np.linalg.norm(matrix.T @ pull)) <= TRANSPOSE_STUCK * size


def largest_gain(J: ArrayLike, dt: float) -> float:
    """Return the gain k below which q ← q + Δt Jᵀ k e makes the error of a still target fall, 2/(Δt σ_1²).

    To first order the error becomes (I − Δt k J Jᵀ) e, and no eigenvalue of this matrix may fall below −1.
    With a diagonal K in place of k, hand in K^½ J: K is below the bound if the answer is above 1, since
    K J Jᵀ has the eigenvalues of K^½ J Jᵀ K^½.

    Args:
        J: Rows (m, n).
        dt: Δt [s], the period.

    Returns:
        k [1/s, times the unit of the rows per joint, inverse and squared]; inf if J is zero.

    Raises:
        InvalidValue: J is no matrix of finite numbers, or Δt is not positive.

    Source:
        The upper bound on K that Sect. 3.7.2 speaks of.
    """
    sigma = float(np.linalg.norm(finite("J", J, (None, None)), 2))
    return 2.0 / (positive("dt", dt) * sigma**2) if sigma > 0.0 else np.inf
