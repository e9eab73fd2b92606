"""Resolvers by name, all of one type."""

import numpy as np
import pytest

from taskopt.errors import NotInstalled, UnknownName
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.base import Resolver
from taskopt.resolver.registry import resolve, resolver, resolver_names
from taskopt.solver.registry import missing_solvers
from tests.helpers.oracles import random_hierarchy

NAMES = ["pinv", "dls", "active-set", "wqp/daqp", "hqp/clarabel"]


@pytest.mark.parametrize("name", NAMES)
def test_a_resolver_answers_to_its_name(name: str) -> None:
    """The name that finds it is the name it carries, and it is a Resolver."""
    found = resolver(name)
    assert found.name == name
    assert isinstance(found, Resolver)
    assert name in resolver_names()


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "hqp/clarabel", "hqp/proxqp", "hqp/quadprog"])
def test_strict_resolvers_agree(name: str) -> None:
    """One lexicographic optimum, whoever finds it."""
    for seed in range(5):
        hierarchy = random_hierarchy(seed)
        np.testing.assert_allclose(resolve(hierarchy, name).x, resolve(hierarchy, "hqp/daqp").x, atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_a_tick_resolved_again_from_its_memory_comes_out_the_same(name: str) -> None:
    """Memory is all that a resolver carries."""
    hierarchy = Hierarchy(
        [Level([[1.0, 1.0]], [5.0]), Level(np.eye(2), [0.3, 0.1])], box=(-np.ones(2), np.ones(2))
    )
    found = resolver(name)
    _, memory = found(hierarchy)
    np.testing.assert_array_equal(found(hierarchy, memory)[0].answer, found(hierarchy, memory)[0].answer)


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [("hpq/daqp", "hqp/daqp"), ("hqp/dapq", "hqp/daqp"), ("pinw", "pinv"), ("active_set", "active-set")],
)
def test_a_mistyped_name_gets_the_nearest_match(wrong: str, meant: str) -> None:
    """What was asked for, and what was probably meant."""
    with pytest.raises(UnknownName, match=f"no resolver named '{wrong}'; did you mean .*{meant}"):
        resolver(wrong)


def test_a_solver_that_is_not_there_is_named_with_what_installs_it() -> None:
    """It is no misspelt name of another one."""
    missing = next(iter(missing_solvers().items()))
    with pytest.raises(NotInstalled, match=f"solver {missing[0]} is not installed.*{missing[1]}"):
        resolver(f"hqp/{missing[0]}")


def test_a_misspelt_solver_is_asked_back() -> None:
    """The nearest name is offered."""
    with pytest.raises(UnknownName, match="did you mean hqp/daqp"):
        resolver("hqp/dakp")
