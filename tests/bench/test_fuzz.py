"""Random ticks: proven or reported, limits kept; and the judge sees what is neither."""

from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from taskopt import Hierarchy, Level, Robot
from taskopt.arrays import Array
from taskopt.bench.fuzz import Floor, Reached, Tally, _judge, fuzz, table
from taskopt.bench.random_stacks import FRAMES, fuzz_robot
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.shapes import Sphere
from taskopt.kinematics.limit import ObstacleLimit
from taskopt.kinematics.robot import planar_arm
from taskopt.resolver.active_set.resolver import ActiveSet

SLOW = ("tiago", "talos")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in FRAMES]
)
def test_every_answer_is_proven_or_reported_and_keeps_every_limit(name: str) -> None:
    """500 ticks a robot, 2,000 in all: certified to 1e-8, positions, velocities, distances within 1e-9."""
    *_, tally = fuzz(name, 500, seed=7)
    assert tally.ticks == 500
    assert tally.bound > 200
    assert tally.near > 20
    assert tally.clean, tally
    assert (tally.reported, tally.fallbacks) == (0, 0), tally


@pytest.mark.parametrize(
    ("fault", "figure"), [("x", "missed"), ("velocity", "velocity"), ("position", "position")]
)
def test_the_judge_sees_a_wrong_answer_and_a_broken_limit(tmp_path: Path, fault: str, figure: str) -> None:
    """An x that is off by 1e-6, a velocity above its limit, a joint outside its range."""
    arm = planar_arm([0.5, 0.5], lower=-1.0, upper=1.0, velocity=2.0)
    hierarchy = Hierarchy([Level(np.eye(2), [0.5, 3.0])], box=([-2.0, -2.0], [2.0, 2.0]))
    resolution, tally = ActiveSet()(hierarchy)[0], Tally("planar", ticks=1)
    _judge(tally, resolution, _reached(arm, np.zeros(2), resolution.v), [], tmp_path)
    assert tally.clean
    spoilt = Hierarchy([Level(np.eye(2), [0.5 + 1e-6 * (fault == "x"), 3.0])], box=([-2.0, -2.0], [2.0, 2.0]))
    if fault == "x":
        from taskopt.hierarchy.certificate import certify

        worst = certify(spoilt, resolution.x, resolution.multipliers)
        resolution.answer[2 + resolution.multipliers.size :][: worst.residuals.size] = worst.residuals.ravel()
        resolution.answer[-spoilt.buffer.size :] = spoilt.buffer
        resolution = type(resolution)(spoilt, resolution.answer, resolution.state, resolution.status)
    elif fault == "velocity":
        resolution.x[1] = 2.1
    q = np.array([0.0, 1.1 if fault == "position" else 0.0])
    _judge(tally, resolution, _reached(arm, q, resolution.v), [], tmp_path)
    assert not tally.clean
    assert getattr(tally, figure) > 0.0
    if fault == "x":
        np.testing.assert_array_equal(Hierarchy.load(tmp_path / "planar-1.npz").A, hierarchy.A)


def _reached(arm: Robot, q: Array, v: Array, strongest: Array | None = None) -> Reached:
    return Reached(q, v, Configuration(arm, q), strongest)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in FRAMES]
)
def test_accelerations_are_proven_or_reported_and_keep_every_limit(name: str) -> None:
    """300 ticks a robot at order 2: positions, velocities, accelerations, distances within 1e-9."""
    *_, tally = fuzz(name, 300, seed=7, order=2)
    assert tally.ticks == 300
    assert tally.bound > 50
    assert tally.clean, tally


def test_the_judge_sees_an_acceleration_beyond_its_limit(tmp_path: Path) -> None:
    """2 rad/s² are allowed; an answer of 2.1 is not clean."""
    arm = planar_arm([0.5, 0.5], lower=-1.0, upper=1.0, velocity=5.0)
    for wrong, clean in ((2.0, True), (2.1, False)):
        hierarchy = Hierarchy([Level(np.eye(2), [0.5, wrong])])
        resolution, tally = ActiveSet()(hierarchy)[0], Tally("planar", ticks=1)
        reached = _reached(arm, np.zeros(2), np.zeros(2), np.full(2, 2.0))
        _judge(tally, resolution, reached, [], tmp_path)
        assert tally.clean is clean
        assert tally.acceleration == pytest.approx(wrong - 2.0)


def test_the_judge_sees_a_distance_below_its_margin() -> None:
    """0.01 m kept at the start and 1 mm lost after; one that starts inside may lose a tenth of its depth."""
    arm = planar_arm([0.5, 0.5], radius=0.02)
    start, nearer = Configuration(arm, [0.0, 0.0]), Configuration(arm, [0.0, 0.002])
    for gap, outside in ((0.01 + 1e-9, True), (0.005, False)):
        ball = Sphere([1.0, 0.02 + 0.1 + gap, 0.0], 0.1)
        floor = Floor(ObstacleLimit([ball], margin=0.01).bind(arm, 1e-3))
        assert floor.start(start) is outside
        assert floor.missing(start) <= 1e-9
        assert floor.missing(nearer) == pytest.approx(0.001 if outside else 0.0005, abs=1e-5)


def test_the_same_seed_draws_the_same_ticks() -> None:
    """A failure can be drawn again."""
    assert fuzz_robot("planar").nv == 4
    first, second = ([*fuzz("planar", 60, seed=3)][-1] for _ in range(2))
    assert first == second


def test_answers_of_a_fallback_are_counted(tmp_path: Path) -> None:
    """They are proven like others, and stand in a column of their own."""
    arm = planar_arm([0.5, 0.5], lower=-1.0, upper=1.0, velocity=2.0)
    resolution, _ = ActiveSet()(Hierarchy([Level(np.eye(2), [0.5, 0.3])], box=([-2.0] * 2, [2.0] * 2)))
    tally = Tally("planar", ticks=1)
    for answer in (resolution, resolution.replaced(fallback="hqp/daqp")):
        _judge(tally, answer, _reached(arm, np.zeros(2), resolution.v), [], tmp_path)
    assert (tally.fallbacks, tally.missed) == (1, 0)
    console = Console(width=120, record=True, file=StringIO())
    console.print(table([tally]))
    text = console.export_text()
    assert "fallback" in text
    assert "…" not in text
