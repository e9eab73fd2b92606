"""Resolvers by name: "pinv", "dls", "active-set", "wqp/<solver>", "hqp/<solver>", "cvxpy/<solver>"."""

from collections.abc import Callable
from functools import partial

from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.damping import POLICIES
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.resolver.base import Resolver
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.cvxpy_model import CvxpyModel
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.weighted import WeightedQP
from taskopt.solver.cvxpy import ENGINES
from taskopt.solver.registry import solver, solvers

DEFAULT = "active-set"


_ALONE: dict[str, Callable[[], Resolver]] = {
    "pinv": PseudoInverse,
    **{row.name: partial(DampedLeastSquares, row.damping) for row in map(DampedLeastSquares, POLICIES)},
    "active-set": ActiveSetWithFallback,
}
_WITH_SOLVER: dict[str, Callable[[str], Resolver]] = {
    "wqp": WeightedQP,
    "hqp": HierarchicalQP,
    "cvxpy": CvxpyModel,
}


def resolver(name: str) -> Resolver:
    """The resolver of that name. Raises `UnknownName`, or `NotInstalled` for its solver."""
    if not isinstance(name, str):
        raise InvalidValue(f"a resolver is known by its name, such as {DEFAULT!r}; got {name!r}")
    if name in _ALONE:
        return _ALONE[name]()
    family, _, engine = name.partition("/")
    if family not in _WITH_SOLVER or engine not in _engines(family):
        raise UnknownName("resolver", name, resolver_names())
    return _WITH_SOLVER[family](solver(engine).name)


def resolver_names() -> tuple[str, ...]:
    """All names, those whose solver is not installed among them."""
    return (*_ALONE, *(f"{family}/{engine}" for family in _WITH_SOLVER for engine in _engines(family)))


def resolve(hierarchy: Hierarchy, name: str = DEFAULT) -> Resolution:
    """One hierarchy, once, without memory."""
    if not isinstance(hierarchy, Hierarchy):
        raise InvalidValue(f"resolve needs a Hierarchy, got {type(hierarchy).__name__}")
    return resolver(name)(hierarchy)[0]


def _engines(family: str) -> tuple[str, ...]:
    """Solvers that a family knows; CVXPY speaks to some of them only."""
    names = tuple(row.name for row in solvers())
    return tuple(name for name in names if name in ENGINES) if family == "cvxpy" else names
