"""`srtp`, singularity-robust task priority: each level is inverted by itself, and then projected.

    x = Σ_k N_{k−1} J_k† b_k

N_{k−1} projects on the null space of all levels before k. Since J_k is inverted before it is projected, a
conflict between levels, where J_k N_{k−1} loses rank, does not make x large; but a lower level is met exactly
only if it is orthogonal to those before it.

Source: Chiaverini (1997), "Singularity-robust task-priority redundancy resolution for real-time kinematic
control of robot manipulators", IEEE Trans. Robotics and Automation 13(3), for two levels; for more, with the
null space of all levels before, Antonelli (2009), IEEE Trans. Robotics 25(5).
"""

from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.damping import NONE, Damping
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import RULE, equality_levels, inverse_root, row_scale
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered_by_x, checked
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.closed_form_resolvers import refuse_inequalities


@dataclass(frozen=True)
class RobustPriority:
    """Resolve by singularity-robust task priority.

    It promises that no level disturbs one before it, and that x stays bounded where levels are in conflict.
    It does not promise the optimum of any level but the first, ignores limits, and its status is always
    FORMULA: it claims nothing. Hard equalities are the level before the first. It refuses levels with
    inequalities.

    Attributes:
        damping: Policy that gives k² for each singular value of a level by itself; without one, x grows where
            a level alone is singular.
        name: Name of the resolver.
        strict: False: a lower level is not at its optimum.
    """

    damping: Damping = NONE
    name: str = "srtp"
    strict: bool = False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy by formula.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned, which is checked but not used.

        Returns:
            The answer, and an empty memory.

        Raises:
            InvalidValue: A level holds an inequality, or the memory belongs to another layout.
        """
        checked(memory, hierarchy.layout)
        refuse_inequalities(hierarchy, self.name)
        inverse = inverse_root(hierarchy.norm)
        xi, Z = np.zeros(hierarchy.n), np.eye(hierarchy.n)
        for A, b, weight in equality_levels(hierarchy):
            root = np.sqrt(weight)
            J, v = root[:, None] * A @ inverse, root * b
            scale = row_scale(J, root)
            moved = RULE.moved(J, scale)
            xi = xi + Z @ (Z.T @ self._inverted(J[moved], v[moved], scale))
            sigma, Vt = np.linalg.svd(J @ Z)[1:]
            Z = Z @ Vt[RULE.rank(sigma, scale) :].T
        answer = answered_by_x(hierarchy, inverse @ xi, Status.FORMULA)
        return answer, Memory(np.zeros(hierarchy.layout.width, dtype=np.int8))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of task priority, from which this differs where levels are not orthogonal."""
        return task_priority(hierarchy)

    def _inverted(self, J: Array, v: Array, scale: float) -> Array:
        """Return J† v with the damping of the policy."""
        U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
        r = RULE.rank(sigma, scale)
        sigma, goal = sigma[:r], U[:, :r].T @ v
        return Vt[:r].T @ (sigma / (sigma**2 + self.damping(sigma, v)) * goal)
