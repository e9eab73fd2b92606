"""The motions of `pink_motions` in pink and in ours: pieces of two, and a stack that is not the same."""

from collections import Counter

import numpy as np
import pytest
from motions_of_pink import ROBOTS, Outcome, difference, outcomes

from taskopt import FrameTask

NEEDED = "pink_motions, pin-pink and quadprog in an environment with taskopt; `pip install` them to run this"


@pytest.fixture
def installed() -> None:
    """Skip where one of them is missing."""
    for name in ("pink", "pink_motions", "quadprog"):
        pytest.importorskip(name, reason=f"{name} is not installed: this test needs {NEEDED}")


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("name", ["ur5", "bolt"])
def test_the_first_ticks_of_a_motion_have_the_velocities_of_pink(name: str) -> None:
    """An arm and a walking robot; every tick is proven, and pink solves it, too."""
    found = outcomes(name, 60)
    assert not isinstance(found, str)
    assert (found[0].ticks, found[0].claimed, found[0].solved) == (60, 60, 60)
    assert found[0].apart.max() < 1e-8


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_another_weight_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted lie: ours weighs orientation ten times less, which shows where a limit is active."""

    def lighter(frame: str, *, weight: np.ndarray, **rest: object) -> FrameTask:
        return FrameTask(frame, weight=weight * [1.0, 1.0, 1.0, 0.1, 0.1, 0.1], **rest)  # type: ignore[arg-type]

    monkeypatch.setattr("motions_of_pink.FrameTask", lighter)
    found = outcomes("ur5", 60)
    assert not isinstance(found, str)
    assert found[0].apart.max() > 1e-3


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_motions_whose_robot_is_not_at_hand_say_so() -> None:
    """Nothing is fetched; the reason names the robot."""
    assert "edo_description" not in ROBOTS
    assert "not run: edo_description" in str(outcomes("edo"))


def test_the_line_of_an_outcome_states_what_each_did() -> None:
    """Numbers of ticks, differences of both ways, and the reasons."""
    out = Outcome("from its start", 10, 9, 8, np.full((8, 2), 1e-3), Counter(a=1), Counter(b=2))
    assert "ours claimed 9 of 10, pink solved 8; in one level 1e-03" in str(out)
    assert "ours, 1 ticks: a" in str(out)
    assert difference(np.array([1.0, 2.0]), np.array([1.0, 4.0])) == 0.5
