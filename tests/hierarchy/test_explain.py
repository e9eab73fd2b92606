"""A resolution reads as plain sentences with names, numbers and units."""

from dataclasses import replace

import numpy as np
import pytest

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import answered
from taskopt.resolver.closed_form_resolvers import PseudoInverse
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.registry import resolve


def stack(limit: float) -> Hierarchy:
    """A hand that wants 2 within ±limit, above a posture."""
    return Hierarchy(
        [Level([[1.0, 0.0]], [2.0], name="hand", weight=3.0), Level(np.eye(2), [0.0, 0.5], name="posture")],
        box=([-limit, -9.0], [limit, 9.0]),
        unknowns=("elbow", "wrist"),
    )


def test_what_is_held_back_is_told_with_its_multiplier() -> None:
    """The hand lacks 0.5; one unit of the elbow would lower ½·3·0.5² by 1.5 to begin with."""
    text = HierarchicalQP("daqp")(stack(1.5))[0].explain()
    assert "Level 1, hand: its row not met, most of all row 0, by 0.5." in text
    assert "box/elbow upper: the cost of level 1 would fall by 1.5 per unit" in text
    assert "proven" in text


def test_what_is_met_is_told() -> None:
    """Nothing binds: the hand is met, and no limit is to blame for the posture."""
    text = HierarchicalQP("daqp")(stack(5.0))[0].explain()
    assert "Level 1, hand: met." in text
    assert "Level 2, posture: 1 of 2 rows not met, most of all row 0, by 2." in text
    assert "No limit and no inequality holds it back." in text


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp", "wqp/daqp"])
def test_a_bound_without_room_is_named(name: str) -> None:
    """A joint whose bounds are equal, and a hard equality, are named; the sentence of none would be false."""
    frozen = stack(0.0)
    text = resolve(frozen, name).explain()
    assert "box/elbow lower = upper, so it cannot move: the cost of level 1 would change by " in text
    assert "No limit and no inequality" not in text
    tied = Hierarchy([Level([[1.0, 0.0]], [2.0])], limits=Level([[1.0, 0.0]], [1.0], name="loop"))
    text = resolve(tied, name).explain()
    assert "loop/row 0 lower = upper" in text
    assert "No limit and no inequality" not in text


def test_both_limits_behind_a_frozen_joint_are_named() -> None:
    """Position leaves no room below and velocity none above; a frozen joint that costs nothing says so."""
    problem = stack(0.0)
    layout = replace(problem.layout, owners=("position", "velocity"))
    problem = Hierarchy.view(layout, problem.buffer, problem.norm)
    problem.owner[1, 0] = 1.0
    assert "position/elbow and velocity/elbow lower = upper" in resolve(problem).explain()
    still = Hierarchy([Level([[1.0, 0.0]], [0.0])], box=([0.0, -1.0], [0.0, 1.0]))
    assert "box/x0 lower = upper, so it cannot move: at no price." in resolve(still).explain()


def test_nothing_negative_is_said_of_an_answer_that_is_not_proven() -> None:
    """The answer of another hierarchy: which limits hold it back was never decided."""
    found = resolve(stack(5.0))
    wrong, _ = answered(found.problem, found.x + [0.1, 0.0], found.multipliers, found.state, Status.SOLVED)
    text = wrong.explain()
    assert "Whether a limit or an inequality holds it back is not known" in text
    assert "No limit and no inequality" not in text


def test_a_closed_form_admits_the_limits_it_breaks() -> None:
    """By name and amount."""
    text = PseudoInverse()(stack(1.5))[0].explain()
    assert "Limit broken: box/elbow, by 0.5." in text
    assert "it is not the optimum inside the limits" in text


def test_no_answer_says_what_to_do() -> None:
    """Contradicting limits: no figures of an x that is not there."""
    hierarchy = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=Level([[1.0]], lower=[2.0]))
    text = HierarchicalQP("daqp")(hierarchy)[0].explain()
    assert "the hard limits contradict each other" in text
    assert "What to do: " in text
    assert "nan" not in text


@pytest.mark.parametrize(("miss", "met"), [(5e-9, True), (1e-7, False)])
@pytest.mark.parametrize("size", [1.0, 1e3])
def test_a_row_counts_as_met_relative_to_what_it_asks_for(miss: float, met: bool, size: float) -> None:
    """x ≤ size holds x = size (1 + miss) back: 5e-9 of it is accuracy of a solver, 1e-7 is not."""
    hierarchy = Hierarchy([Level([[1.0]], [size * (1.0 + miss)], name="hand")], box=([0.0], [size]))
    assert ("Level 1, hand: met." in HierarchicalQP("daqp")(hierarchy)[0].explain()) == met


@pytest.mark.parametrize(("miss", "broken"), [(5e-9, False), (1e-7, True)])
def test_a_limit_counts_as_broken_beyond_the_same_threshold(miss: float, broken: bool) -> None:
    """The closed form passes x ≤ 1 and the row x ≤ 1 by `miss`, and both are named or neither."""
    limits = Level([[1.0]], upper=[1.0], name="wall")
    hierarchy = Hierarchy([Level([[1.0]], [1.0 + miss])], box=([0.0], [1.0]), limits=limits)
    text = PseudoInverse()(hierarchy)[0].explain()
    assert ("Limit broken: box/x0" in text) == broken
    assert ("Limit broken: wall/row 0" in text) == broken
