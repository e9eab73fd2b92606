"""The measure of what two workers of a sweep gain."""

import pytest
from sweep_speed import Cost, Round, compare, verdict

FINE = Round(Cost(10.0, 10.0), Cost(11.0, 6.0))


@pytest.mark.parametrize(
    ("two", "kept"), [(Cost(11.0, 6.0), True), (Cost(11.2, 6.0), False), (Cost(11.0, 6.4), False)]
)
def test_both_bars_count(two: Cost, kept: bool) -> None:
    """1.12 times the processor time, or a gain of 1.56, is too little."""
    assert verdict([Round(Cost(10.0, 10.0), two)])[1] is kept


def test_the_best_round_counts() -> None:
    """A round beside other work does not hide one that keeps the bars."""
    slow = Round(Cost(10.0, 10.0), Cost(15.0, 20.0))
    text, kept = verdict([slow, FINE, slow])
    assert kept
    assert "best of 3: processor time × 1.10 (at most 1.1), wall clock 1.67 times faster" in text


@pytest.mark.slow
def test_all_processes_are_counted() -> None:
    """Two workers spend at least half of what one does: their time is not lost with them."""
    found = compare(1)
    assert found.two.cpu > 0.5 * found.one.cpu > 0.5
    assert found.one.wall >= 0.9 * found.one.cpu
