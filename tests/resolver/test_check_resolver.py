"""The public check of a resolver: all registered resolvers pass it, and each planted fault is named."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from taskopt import Controller, JointTask, Stack, planar_arm
from taskopt.arrays import Array
from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver import registry
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.registry import register_resolver, resolve, resolver, resolver_names
from taskopt.resolver.weighted import WeightedQP
from taskopt.testing.resolver import check_resolver, random_hierarchy

LOOSE = ("highs", "osqp", "scs")  # solvers that are not held to the accuracy of a proof
# ProxQP does not always reach what it is asked for of weighted problems; it then stops at its limit of steps.
EXCEPT = ("wqp/proxqp", "daqp-hierarchy")  # the latter is refuted where levels are in conflict
NAMES = [name for name in resolver_names() if not name.endswith(LOOSE) and name not in EXCEPT]
SLOW = ("cvxpy", "hqp/proxqp", "hqp/piqp", "wqp/piqp")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n.startswith(SLOW) else ()) for n in NAMES]
)
def test_every_resolver_keeps_the_contract_of_a_resolver(name: str) -> None:
    """Closed form where nothing is active, proof, strictness, memory, no side effects, honest status."""
    check_resolver(resolver(name), accuracy=1e-5 if name == "wqp/piqp" else 1e-6, count=10)


def test_the_random_hierarchies_are_not_idle() -> None:
    """Limits are active in nearly all of them, so that the check says something."""
    active = [bool(resolve(random_hierarchy(seed)).active) for seed in range(20)]
    assert sum(active) >= 18


@dataclass(frozen=True)
class Own:
    """The bare active set under another name, for faults to be planted in."""

    name: str = "own"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return ActiveSet()(hierarchy, memory)

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return ActiveSet().closed_form(hierarchy)


class Scaled(Own):
    """Its closed form is that of another problem."""

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        return 1.001 * super().closed_form(hierarchy)


class Unproven(Own):
    """It claims an optimum that its certificate does not prove."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = super().__call__(hierarchy, memory)
        x = 0.99 * resolution.x if resolution.active else resolution.x
        y = find_multipliers(hierarchy, x)
        return answered(hierarchy, x, y, resolution.state, Status.SOLVED)


class Weighted(Own):
    """It calls itself strict, and is not."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        if not len(hierarchy.limits.lower):
            return super().__call__(hierarchy, memory)
        return WeightedQP("daqp", 0.1)(hierarchy)


class Scribbling(Own):
    """It relaxes the bounds of the hierarchy where they lie."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        answer = super().__call__(hierarchy, memory)
        hierarchy.box_upper[:] += 1.0
        return answer


class Referring(Own):
    """Its answers refer to the arrays of the hierarchy instead of a copy."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = super().__call__(hierarchy, memory)
        vars(resolution)["_problem"] = hierarchy
        return resolution, memory


class Drifting(Own):
    """It takes something from its memory that it must not."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, after = super().__call__(hierarchy, memory)
        return (
            answered(hierarchy, 0.5 * resolution.x, resolution.multipliers, after.state, Status.SOLVED)[0]
            if memory
            else resolution
        ), after


class Forgetful(Own):
    """Its memory belongs to another problem."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        return super().__call__(hierarchy)[0], Memory(np.zeros(2, np.int8))


class Blind(Own):
    """It drops the hard rows, and so it finds an optimum where there is none."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, after = super().__call__(hierarchy, memory)
        if resolution.claimed:
            return resolution, after
        return super().__call__(Hierarchy([Level([[1.0, 0.0]], [0.5])]))


@pytest.mark.parametrize(
    ("lie", "sentence"),
    [
        (Scaled(), "from its closed form"),
        (Unproven(), "is none: worst residual"),
        (Weighted(), "more with one level below it"),
        (Scribbling(), "changed hierarchy"),
        (Referring(), "refers to the arrays"),
        (Drifting(), "if called without a memory"),
        (Blind(), "where hard limits contradict each other"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_check_catches_a_resolver_that_lies(lie: Own, sentence: str) -> None:
    """Each planted fault is named in the sentence of the error."""
    with pytest.raises(AssertionError, match=sentence):
        check_resolver(lie)


class Returning(Own):
    """It returns something else than a resolution and a memory."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> Any:
        resolution, memory = super().__call__(hierarchy, memory)
        other, _ = ActiveSet()(Hierarchy([Level(np.ones((1, 2)), [1.0])]))
        wrong = {
            "nothing": None,
            "alone": resolution,
            "swapped": (memory, resolution),
            "forgotten": (resolution, None),
            "status": (resolution.replaced("solved"), memory),  # type: ignore[arg-type]
            "size": (other, memory),
        }
        return wrong[self.name]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("nothing", "returned NoneType instead of the pair"),
        ("alone", "returned Resolution instead of the pair"),
        ("swapped", r"returned \(Memory, Resolution\) instead of the pair"),
        ("forgotten", r"returned \(Resolution, NoneType\) instead of the pair"),
        ("status", "returned the status 'solved' instead of"),
        ("size", r"returned x of shape \(2,\) instead of"),
    ],
)
def test_what_is_no_answer_is_named(name: str, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the check, by `resolve` and by a controller: what was returned, and what was expected instead."""
    monkeypatch.setattr(registry, "_PLAIN", dict(registry._PLAIN))
    wrong = Returning(name)
    register_resolver(lambda: wrong)
    with pytest.raises(AssertionError, match=f"resolver {name} {sentence}"):
        check_resolver(wrong)
    with pytest.raises(InvalidValue, match=f"resolver {name} {sentence}"):
        resolve(Hierarchy([Level(np.ones((1, 3)), [1.0])]), name)
    arm = planar_arm([0.5, 0.5, 0.5])
    with pytest.raises(InvalidValue, match=f"resolver {name} {sentence}"):
        Controller(arm, Stack([[JointTask()]]), wrong).step(np.zeros(3), 0.0)


def test_a_memory_of_another_problem_is_caught() -> None:
    """The same sentence as for a memory from outside."""
    with pytest.raises(InvalidValue, match="for each of 14 unknowns and rows"):
        check_resolver(Forgetful())


def test_an_incomplete_resolver_is_told_what_it_lacks() -> None:
    """By the check, and at registration."""

    class Incomplete:
        name = "incomplete"

        def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> None:
            return None

    lacking: Any = Incomplete
    with pytest.raises(AssertionError, match="lacks strict, closed_form"):
        check_resolver(lacking())
    with pytest.raises(InvalidValue, match="Incomplete is no resolver: it lacks strict, closed_form"):
        register_resolver(lacking)


def test_a_resolver_of_ones_own_is_asked_for_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Registered, it resolves; similar names are suggested, taken and empty ones refused."""
    monkeypatch.setattr(registry, "_PLAIN", dict(registry._PLAIN))
    assert register_resolver(Own).name == "own"
    check_resolver(resolver("own"), count=3)
    assert "own" in resolver_names()
    with pytest.raises(UnknownName, match="did you mean own"):
        resolver("owm")
    with pytest.raises(InvalidValue, match="'own' already"):
        register_resolver(Own)
    register_resolver(Own, replace=True)
    with pytest.raises(InvalidValue, match="needs a name"):
        register_resolver(lambda: Own(name=""))
    not_callable: Any = Own()
    with pytest.raises(InvalidValue, match="make must return"):
        register_resolver(not_callable.name)


class Lost(ActiveSet):
    """A search that never finds a proof."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = super().__call__(hierarchy, memory)
        return resolution.replaced(Status.FAILED), memory


def test_a_fallback_is_named_in_the_answer_and_can_be_switched_off() -> None:
    """Where the search fails `hqp/daqp` answers, and says so; without a fallback the answer stays FAILED."""
    hierarchy = random_hierarchy(3)
    exact = resolve(hierarchy)
    assert exact.fallback is None
    answer, _ = ActiveSetWithFallback(Lost())(hierarchy)
    assert answer.fallback == "hqp/daqp"
    assert "found no optimum; hqp/daqp" in answer.notes[0]
    assert answer.kkt_met()
    np.testing.assert_allclose(answer.x, exact.x, atol=1e-9)
    alone, _ = ActiveSetWithFallback(Lost(), fallback=None)(hierarchy)
    assert alone.status is Status.FAILED
    assert alone.fallback is None


class Contradicted(ActiveSet):
    """A search that always claims a contradiction."""

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = super().__call__(hierarchy, memory)
        return resolution.replaced(Status.INFEASIBLE), memory


def test_a_contradiction_that_phase_one_does_not_find_is_no_answer() -> None:
    """The search's claim is refuted: the fallback answers, or the status is FAILED."""
    hierarchy = random_hierarchy(3)
    answer, _ = ActiveSetWithFallback(Contradicted())(hierarchy)
    assert answer.fallback == "hqp/daqp"
    assert answer.kkt_met()
    alone, _ = ActiveSetWithFallback(Contradicted(), fallback=None)(hierarchy)
    assert alone.status is Status.FAILED


def test_a_fallback_that_proves_nothing_is_not_taken() -> None:
    """Any resolver can be the fallback; one that fails, or claims without a proof, leaves FAILED."""
    hierarchy = random_hierarchy(3)
    taken, _ = ActiveSetWithFallback(Lost(), fallback=Own())(hierarchy)
    assert taken.fallback == "own"
    for useless in (Lost(), Unproven()):
        refused, _ = ActiveSetWithFallback(Lost(), fallback=useless)(hierarchy)
        assert refused.fallback is None
        assert refused.status is Status.FAILED


def test_limits_that_contradict_stay_infeasible() -> None:
    """Phase one confirms what the search claims, and nobody else is asked."""
    limits = Level([[1.0, 1.0]], lower=[3.0])
    hierarchy = Hierarchy([Level([[1.0, 0.0]], [0.5])], box=(-np.ones(2), np.ones(2)), limits=limits)
    answer, _ = ActiveSetWithFallback(fallback=Own())(hierarchy)
    assert answer.status is Status.INFEASIBLE
    assert answer.fallback is None
