"""Resolvers by name: "active-set", "pinv", "transpose", "srtp", "sns", "dls" and families with a solver.

The families are "hqp/<solver>", "wqp/<solver>", "pqp/<solver>" and "cvxpy/<solver>"; "wqp@0.01/<solver>" is
"wqp/<solver>" with the ratio 0.01 between levels.

To add a resolver to taskopt, write a class (see `taskopt.resolver.base.Resolver`) and add a line to one of
the two tables below. For a resolver outside the package, call `register_resolver`.
"""

from collections.abc import Callable
from functools import partial

from taskopt.errors import InvalidValue, NotInstalled, UnknownName
from taskopt.hierarchy.damping import POLICIES
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.resolver.base import Resolver, missing_parts, require_answer
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.cvxpy_model import CvxpyModel
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.native import NativeHierarchy
from taskopt.resolver.null_space_saturation import NullSpaceSaturation
from taskopt.resolver.projected import ProjectedQP
from taskopt.resolver.robust_priority import RobustPriority
from taskopt.resolver.transpose import Transpose
from taskopt.resolver.weighted import WeightedQP
from taskopt.solver.cvxpy import ENGINES
from taskopt.solver.registry import missing_solvers, solver, solvers

DEFAULT = "active-set"

_PLAIN: dict[str, Callable[[], Resolver]] = {  # and what users register
    "pinv": PseudoInverse,
    "transpose": Transpose,
    "srtp": RobustPriority,
    "daqp-hierarchy": NativeHierarchy,
    "sns": NullSpaceSaturation,
    **{row.name: partial(DampedLeastSquares, row.damping) for row in map(DampedLeastSquares, POLICIES)},
    "active-set": ActiveSetWithFallback,
}
_WITH_SOLVER: dict[str, Callable[[str], Resolver]] = {
    "wqp": WeightedQP,
    "pqp": ProjectedQP,
    "hqp": HierarchicalQP,
    "cvxpy": CvxpyModel,
}


def resolver(name: str) -> Resolver:
    """Return the resolver of a name, with default settings.

    Args:
        name: Name such as "active-set" or "hqp/daqp"; `resolver_names` lists all.

    Returns:
        A new resolver.

    Raises:
        InvalidValue: `name` is not a string, or the ratio in it is none.
        UnknownName: There is no such resolver; the message suggests similar names.
        NotInstalled: The package of its solver cannot be imported.
    """
    if not isinstance(name, str):
        raise InvalidValue(f"a resolver is known by its name, such as {DEFAULT!r}; got {name!r}")
    if name in _PLAIN:
        return _PLAIN[name]()
    family, _, engine = name.partition("/")
    family, at, ratio = family.partition("@")
    if at and family == "wqp" and engine in _engines(family):
        return WeightedQP(solver(engine).name, _ratio(ratio, name))
    if at or family not in _WITH_SOLVER or engine not in _engines(family):
        missing = missing_solvers().get(engine) if family in _WITH_SOLVER else None
        if missing is not None:
            raise NotInstalled(f"solver {engine}", missing)
        raise UnknownName("resolver", name, resolver_names())
    return _WITH_SOLVER[family](solver(engine).name)


def resolver_names() -> tuple[str, ...]:
    """Return the names of all resolvers, including those whose solver is not installed;
    those with a ratio, such as "wqp@0.01/daqp", are not listed."""
    return (*_PLAIN, *(f"{family}/{engine}" for family in _WITH_SOLVER for engine in _engines(family)))


def resolve(hierarchy: Hierarchy, name: str = DEFAULT) -> Resolution:
    """Resolve one hierarchy once, without a memory.

    Args:
        hierarchy: The problem.
        name: Name of the resolver.

    Returns:
        Its answer.

    Raises:
        InvalidValue: `hierarchy` is not a `Hierarchy`, or a user's resolver returns no answer to it.
        UnknownName: There is no such resolver.
        NotInstalled: The package of its solver cannot be imported.
    """
    if not isinstance(hierarchy, Hierarchy):
        raise InvalidValue(f"resolve needs a Hierarchy, got {type(hierarchy).__name__}")
    return require_answer(resolver(name)(hierarchy), name, hierarchy)[0]


def as_resolver(value: str | Resolver) -> Resolver:
    """Return the resolver of a name, or check that a user's own resolver is complete.

    Args:
        value: Name of a resolver, or a resolver.

    Returns:
        The resolver.

    Raises:
        UnknownName: There is no resolver of that name.
        InvalidValue: The value is a class instead of a resolver, or lacks a part of the protocol.
    """
    if isinstance(value, str):
        return resolver(value)
    if isinstance(value, type):
        raise InvalidValue(f"{value.__name__} is a class; make a resolver of it: {value.__name__}()")
    missing = missing_parts(value)
    if missing:
        raise InvalidValue(
            f"{type(value).__name__} is no resolver: it lacks {', '.join(missing)}; see taskopt.Resolver"
        )
    return value


def register_resolver(make: Callable[[], Resolver], *, replace: bool = False) -> Resolver:
    """Add a resolver of your own, so that its name can be used everywhere.

    `taskopt.testing.check_resolver` tests that it keeps the promises of a resolver.

    Args:
        make: Function that returns a new resolver with default settings, such as the class of the resolver.
        replace: True to replace a resolver that has this name already.

    Returns:
        A resolver that `make` returned, whose `name` is registered.

    Raises:
        InvalidValue: The resolver lacks a part of the protocol, or its name is empty or taken.
    """
    if not callable(make):
        raise InvalidValue(f"make must return a resolver when it is called, got {type(make).__name__}")
    made = as_resolver(make())
    if not isinstance(made.name, str) or not made.name:
        raise InvalidValue(f"a resolver needs a name, got {made.name!r}")
    if made.name in resolver_names() and not replace:
        raise InvalidValue(
            f"there is a resolver '{made.name}' already; name yours differently or pass replace=True"
        )
    _PLAIN[made.name] = make
    return made


def _ratio(text: str, name: str) -> float:
    """Return the ratio in the name of a weighted resolver."""
    try:
        return float(text)
    except ValueError as error:
        raise InvalidValue(
            f"'{name}' needs a number in (0, 1] after @, the weight of a level over that of the level before "
            f"it, as in 'wqp@0.01/daqp'; got '{text}'"
        ) from error


def _engines(family: str) -> tuple[str, ...]:
    """Return the names of the solvers that a family can use; CVXPY can use only some of them."""
    names = tuple(row.name for row in solvers())
    return tuple(name for name in names if name in ENGINES) if family == "cvxpy" else names
