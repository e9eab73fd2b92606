"""The cost of a change of parameters."""

import numpy as np
import pytest
from parameters import KINDS, Loop, measured, table

COUNT = 3


@pytest.fixture(scope="module")
def loop() -> Loop:
    """The loop that is measured, with few tasks and limits."""
    return Loop(COUNT, COUNT)


@pytest.mark.parametrize("kind", KINDS)
def test_the_two_sets_of_values_differ_and_reach_the_plan(loop: Loop, kind: str) -> None:
    """What is measured is a change: after a tick the parameters are those that were set, none is left out."""
    control = loop.control
    for changes in loop.changes(kind, COUNT):
        assert len(changes) == COUNT
        control.set(changes)
        control.step(loop.q, 0.0)
        present = control.parameters
        for address, value in changes.items():
            if kind == "axes":
                assert present[address] == tuple(str(value))
            else:
                np.testing.assert_array_equal(present[address], value)
    one, two = loop.changes(kind, COUNT)
    assert all(not np.array_equal(one[address], two[address]) for address in one)


def test_both_parts_are_timed(loop: Loop) -> None:
    """Checking and applying three changes takes longer than reading the clock."""
    cost = measured(loop, "gain of each row", COUNT, 20)
    assert cost.set > 0.0
    assert cost.apply > 0.0


@pytest.mark.slow
def test_the_table_has_a_line_for_each_kind() -> None:
    """Six numbers in each, and the time of a tick below."""
    _, _, *lines, tick = table(2, 5)
    assert [line.split("|")[1].strip() for line in lines] == list(KINDS)
    assert all(len(line.split("|")) == 9 for line in lines)
    assert "A tick without a change takes" in tick
