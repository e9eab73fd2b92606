"""The resolver `active-set`: the active-set search, with phase one and a cascade of programs as fallback.

Only this module combines the search, phase one and the cascade of `hqp`, so that none of them has to import
another one. The search itself (`taskopt.resolver.active_set`) never falls back.
"""

from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof.judgement import Verdict
from taskopt.hierarchy.proof.judging import judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.infeasible import limits_agree
from taskopt.resolver.tick_review import TickReview

_GAVE_UP = (Status.FAILED, Status.ITERATION_LIMIT)


@dataclass(frozen=True)
class ActiveSetWithFallback:
    """Resolve with the active-set search; if it finds no optimum, call another resolver.

    It aims at the lexicographic optimum inside the hard limits, and claims an answer if that meets its KKT
    conditions. It does not promise a bound on computing time.

    The search may end without an optimum, or not end within its limit of iterations: with a hundred and more
    nearly parallel hard rows, this happens about once in some thousand ticks. The fallback then resolves the
    same hierarchy. Its answer is taken only if it meets its KKT conditions and is not refuted, and
    `resolution.fallback` has its name.

    If the search claims that the hard limits contradict each other, phase one (`limits_agree`) decides, and
    the status is INFEASIBLE only if phase one finds the contradiction, too.

    Attributes:
        search: The search.
        fallback: The resolver that is called if the search finds none; None for none.
    """

    search: ActiveSet = field(default_factory=ActiveSet)
    fallback: Resolver | None = field(default_factory=lambda: HierarchicalQP("daqp"))

    @property
    def name(self) -> str:
        """Name of the resolver, "active-set"."""
        return self.search.name

    @property
    def strict(self) -> bool:
        """True: priorities between levels are exact."""
        return True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned, for a warm start; None for a cold one.

        Returns:
            The answer, and the memory for the next call.

        Raises:
            InvalidValue: The memory belongs to a hierarchy of another layout.
        """
        resolution, memory = self.search(hierarchy, memory)
        return (resolution if resolution.claimed else self.conclude(resolution)), memory

    def conclude(self, resolution: Resolution) -> Resolution:
        """Check the status INFEASIBLE by phase one, and call the fallback if the search claims nothing.

        Args:
            resolution: An answer of the search.

        Returns:
            The fallback is called if the status is FAILED or ITERATION_LIMIT, or if it is INFEASIBLE and
            phase one refutes that. Then the result is the answer of the fallback if that meets its KKT
            conditions and is not refuted, else the answer of the search, with the status FAILED in place of
            INFEASIBLE. In all other cases the answer of the search is returned.
        """
        hierarchy, status = resolution.source, resolution.status
        if status is Status.INFEASIBLE:
            if not limits_agree(hierarchy):
                return resolution
            status = Status.FAILED
        elif status not in _GAVE_UP or not np.isfinite(resolution.certificate.worst):
            return resolution  # the hierarchy holds a NaN
        if self.fallback is not None:
            found, _ = self.fallback(hierarchy)
            if found.claimed and found.kkt_met() and not _refuted(found):
                iterations = resolution.iterations + found.iterations
                taken = Resolution(
                    hierarchy, found.answer, found.state, Status.SOLVED, iterations, TickReview
                )
                note = f"The active-set search found no optimum; {self.fallback.name} found the optimum."
                return taken.replaced(notes=(note,), fallback=self.fallback.name)
        return resolution.replaced(status)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return self.search.closed_form(hierarchy)


def _refuted(resolution: Resolution) -> bool:
    """Return True if the answer is proven to be away from the optimum, whatever its residuals are."""
    found = judge(resolution.source, resolution.x, resolution.state)
    return found.verdict is Verdict.REFUTED
