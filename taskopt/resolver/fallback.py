"""`active-set` as users get it: the active-set search, with phase one and a cascade of programs behind it.

This is the one place where the search, phase one and the cascade of `hqp` are wired together, so that none
of them has to import another one. The search itself (`taskopt.resolver.active_set`) never falls back.
"""

from dataclasses import dataclass, field

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.infeasible import limits_agree
from taskopt.resolver.tick_review import TickReview

_CASCADE = HierarchicalQP("daqp")


@dataclass(frozen=True)
class ActiveSetWithFallback:
    """Resolve with the active-set search; decide by phase one what it claims to be infeasible.

    It promises the lexicographic optimum inside the hard limits, proven by the certificate. Where the search
    finds no proof, which happens about once in some thousand ticks among hundreds of nearly parallel hard
    rows, the cascade `hqp/daqp` is asked instead. Its answer is taken only if the certificate proves it, and
    the resolution says so: `resolution.fallback` names the cascade. The status is INFEASIBLE if and only if
    phase one finds that the hard limits contradict each other. It does not promise a bound on computing time.

    Attributes:
        search: The search without a fallback.
    """

    search: ActiveSet = field(default_factory=ActiveSet)

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
            memory: What the last call returned, for a warm start; None for a cold one.

        Returns:
            The answer, and the memory for the next call.

        Raises:
            InvalidValue: The memory belongs to a hierarchy of another layout.
        """
        resolution, memory = self.search(hierarchy, memory)
        return (resolution if resolution.claimed else conclude(resolution)), memory

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of `task_priority` on the equalities."""
        return self.search.closed_form(hierarchy)


def conclude(resolution: Resolution) -> Resolution:
    """Check what the search claims to be infeasible, and ask the cascade where the search has no proof.

    Args:
        resolution: An answer of `ActiveSet`.

    Returns:
        An answer of the cascade with `fallback` set, if the search ended without a proof or claimed a
        contradiction that phase one does not find, and if the cascade's answer is proven. FAILED replaces a
        refuted INFEASIBLE if the cascade finds no proof either. Any other answer is returned as it is.
    """
    hierarchy = resolution.source
    status = resolution.status
    if status is Status.INFEASIBLE:
        if not limits_agree(hierarchy):
            return resolution
        status = Status.FAILED
    elif status is not Status.FAILED or resolution.certificate.worst == float("inf"):
        return resolution  # stopped at the limit of iterations, or the hierarchy holds a NaN
    found, _ = _CASCADE(hierarchy)
    if found.claimed and found.certified():
        notes = (f"The active-set search found no proof; {_CASCADE.name} found the optimum.",)
        iterations = resolution.iterations + found.iterations
        proven = Resolution(hierarchy, found.answer, found.state, Status.SOLVED, iterations, TickReview)
        return proven.replaced(notes=notes, fallback=_CASCADE.name)
    return resolution.replaced(status)
