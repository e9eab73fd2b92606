"""One row that serves several pairs in turn: batch, timeline and events name the pair of each tick.

Which pair an active row keeps apart is found without labels: by the gradient of each distance of a planar
arm, whose links are segments with a radius, from differences of the closed form.
"""

from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from taskopt.arrays import Array, Mask
from taskopt.kinematics.geometry import Sphere
from taskopt.kinematics.limit import JointVelocityLimit, ObstacleLimit
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Circle
from taskopt.kinematics.task import PositionTask
from taskopt.loop.run import Step, run
from taskopt.loop.scenario import Scenario
from taskopt.recording.batch import Batch
from taskopt.recording.log import Log
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.paths import EVENTS, data_path, plain_part
from taskopt.resolver.registry import resolver
from tests.helpers.rrd import rows_of

LENGTHS, THICK, BALL = (0.5, 0.4, 0.3), 0.02, 0.1  # [m]
CENTRES = {"below": (0.85, -0.02), "above": (0.7, 0.65)}  # [m]
PAIRS = [f"link{link} – {ball}" for ball in CENTRES for link in (1, 2, 3)]


@pytest.fixture(scope="module")
def made() -> Scenario:
    """A circle that leads into two balls, one after the other, with one row for six pairs."""
    tip = PositionTask(
        "tip", target=Circle(radius=0.25, period=0.5, toward=(-1, 0, 0), along=(0, 1, 0)), axes="xy", gain=20
    )
    balls = [Sphere((*centre, 0.0), BALL, name=name) for name, centre in CENTRES.items()]
    return Scenario(
        robot=planar_arm(LENGTHS, radius=THICK),
        q0=[0.6, -0.9, 0.8],
        stack=Stack(
            [[tip]], [ObstacleLimit(balls, 0.02, influence=0.15, rows=1), JointVelocityLimit(velocity=12.0)]
        ),
        duration=0.5,
        dt=5e-3,
        name="labelled",
    )


@pytest.fixture(scope="module")
def steps(made: Scenario) -> list[Step]:
    return list(run(made, resolver("active-set")))


def distances(q: Array) -> Array:
    """The distance of each link to each ball [m], in closed form."""
    angle = np.cumsum(q)
    ends = np.cumsum(np.array(LENGTHS) * [np.cos(angle), np.sin(angle)], axis=1).T
    starts, out = np.vstack([np.zeros(2), ends[:-1]]), []
    for centre in CENTRES.values():
        for start, end in zip(starts, ends, strict=True):
            along = end - start
            share = np.clip((centre - start) @ along / (along @ along), 0.0, 1.0)
            out.append(np.linalg.norm(start + share * along - centre) - THICK - BALL)
    return np.array(out)


def gradients(q: Array) -> Array:
    """∂d/∂q of each pair, (6, 3), by central differences."""
    small = 1e-6 * np.eye(3)
    return np.array([distances(q + e) - distances(q - e) for e in small]).T / 2e-6


def kept_apart(steps: list[Step]) -> Mask:
    """True for the pair whose gradient the active row holds, (k, 6)."""
    out = np.zeros((len(steps), len(PAIRS)), dtype=bool)
    for k, step in enumerate(steps):
        if step.resolution.state[3]:
            off = np.abs(gradients(step.q) - step.hierarchy.A[0]).max(axis=1)
            out[k, off.argmin()] = True
            assert off.min() < 1e-6 < np.partition(off, 1)[1]
    return out


def other_pair(steps: list[Step]) -> list[Step]:
    """The same steps with the planted lie that each row with a label serves the next pair."""
    lies = deepcopy(steps)
    for step in lies:
        label = step.hierarchy.label
        label[label > 0.0] = label[label > 0.0] % len(PAIRS) + 1.0
    return lies


def test_the_pairs_held_off_are_those_of_the_rows(steps: list[Step]) -> None:
    """Both balls are met by the same row; with the labels of other pairs, `held_off` is wrong."""
    batch, kept = Batch(tuple(steps)), kept_apart(steps)
    assert batch.pairs("obstacle") == tuple(PAIRS)
    np.testing.assert_allclose(batch.distance("obstacle")[-1].min(), distances(steps[-1].q).min(), atol=1e-9)
    assert kept.any(axis=0).sum() >= 2
    np.testing.assert_array_equal(batch.held_off("obstacle"), kept)
    assert (Batch(tuple(other_pair(steps))).held_off("obstacle") != kept).any()


def test_an_active_row_has_the_name_of_its_pair(steps: list[Step]) -> None:
    """In the batch and in the answer, word for word; the row has no name of its own in them."""
    for taken, right in ((steps, True), (other_pair(steps), False)):
        batch, names = Batch(tuple(taken)), []
        for k, pairs in enumerate(kept_apart(taken)):
            if not pairs.any():
                continue
            name = f"obstacle/{PAIRS[pairs.argmax()]} lower"
            told = [str(active) for active in taken[k].resolution.active]
            code = int(batch.active_code[k, 3])
            names.append(name in told and batch.active_name(3, code) == name)
            names[-1] &= batch.code_words(3, code) == f"{PAIRS[pairs.argmax()]} lower"
            assert not any("row 1" in word for word in told)
        assert names
        assert all(names) == right


def recorded(made: Scenario, steps: list[Step], folder: Path) -> tuple[list[tuple[int, str]], set[str]]:
    """The states of the row in the timeline with their ticks, and the events."""
    folder.mkdir()
    log = Log(RunInfo(made, ("active-set",)), folder)
    with log:
        for step in steps:
            log.write(step)
    path = data_path("active-set", "active", "obstacle", plain_part("row 1"))
    rows = rows_of(log.folder / "run.rrd", path)
    events = rows_of(log.folder / "run.rrd", EVENTS)["text"]
    return [(k, state[0]) for k, state in zip(rows["tick"], rows["state"], strict=True)], {
        e[0] for e in events
    }


@pytest.mark.slow
def test_the_timeline_names_the_pair_of_each_tick(made: Scenario, steps: list[Step], tmp_path: Path) -> None:
    """A state begins at the tick at which another pair, or none, is kept apart; events name them."""
    words = [f"{PAIRS[pairs.argmax()]} lower" if pairs.any() else "free" for pairs in kept_apart(steps)]
    begins = [0, *(k for k in range(1, len(words)) if words[k] != words[k - 1])]
    expected = [(k, words[k]) for k in begins]
    states, events = recorded(made, steps, tmp_path / "right")
    assert states == expected
    named = {f"active-set: obstacle/{word} is active" for word in {*words} - {"free"}}
    assert named & events
    states, events = recorded(made, other_pair(steps), tmp_path / "wrong")
    assert [k for k, _ in states] == begins
    assert states != expected
    assert not named & events
