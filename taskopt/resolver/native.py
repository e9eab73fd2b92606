"""`daqp-hierarchy`, DAQP's own method for hierarchies, to compare with."""

from dataclasses import dataclass
from importlib import import_module

from taskopt.arrays import Array
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.base import Memory, answered, final_state, is_finite
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.infeasible import no_answer, refuse_broken_claim
from taskopt.resolver.solver_accuracy import checked_accuracy


@dataclass(frozen=True)
class NativeHierarchy:
    """Resolve by the method for hierarchies that DAQP brings along.

    Its status is what DAQP claims. DAQP scales each row to unit length, so that rows of a level that cannot
    all be met are weighed otherwise than stated, and levels that are in conflict are mostly not at their
    optimum: `judge` then refutes the claim. Do not drive a robot with it.

    Attributes:
        accuracy: Primal and dual tolerance that DAQP is given.
        name: Name of the resolver.
        strict: True: that is what it is meant to be.
    """

    accuracy: float = ACCURACY
    name: str = "daqp-hierarchy"
    strict: bool = True

    def __post_init__(self) -> None:
        checked_accuracy(self.accuracy)

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:  # noqa: ARG002
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Ignored.

        Returns:
            The answer of DAQP with what it claims, and a memory with its active set.
        """
        solve = import_module("taskopt.solver.daqp").solve_hierarchy
        x, status, iterations = solve(hierarchy, self.accuracy)
        if status is not Status.SOLVED or not is_finite(x):
            return no_answer(hierarchy, status, iterations)
        y = find_multipliers(hierarchy, x)
        state = final_state(hierarchy, x, y)
        return refuse_broken_claim(answered(hierarchy, x, y, state, status, iterations, self.accuracy))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return task_priority(hierarchy)
