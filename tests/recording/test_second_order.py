"""Runs of second order as they are recorded: accelerations with their units beside velocities."""

import json
from pathlib import Path

import numpy as np
import pytest

from taskopt import JointAccelerationLimit, JointTask, PositionTask, Scenario, Stack, planar_arm
from taskopt.compare import Comparison
from taskopt.loop.run import Step
from taskopt.recording.log import Log
from taskopt.recording.reading import read_table
from taskopt.recording.run_info import RunInfo
from taskopt.report import show, terminal
from tests.helpers.rrd import rows_of

NAMES = ("active-set", "pinv")
STRONGEST = 3.0  # [rad/s²], less than the closed form takes


@pytest.fixture(scope="module")
def compared(tmp_path_factory) -> tuple[Comparison, list[Step], Path]:
    """A comparison whose acceleration limit binds, with its steps and its log."""
    tip = PositionTask("tip", target=(0.6, 0.7, 0.0), gain=8.0, axes="xy")
    stack = Stack([[tip], [JointTask(gain=2.0)]], [JointAccelerationLimit(STRONGEST)], order=2)
    of = Scenario(
        robot=planar_arm([0.5, 0.4, 0.3], lower=-3.0, upper=3.0, velocity=2.0),
        q0=[0.3, 0.8, -0.5],
        stack=stack,
        duration=0.3,
        dt=5e-3,
        name="second",
    )
    comparison, folder = Comparison(of, NAMES), tmp_path_factory.mktemp("second")
    with Log(RunInfo(of, NAMES), folder) as log:
        steps = list(comparison)
        for step in steps:
            log.write(step)
    return comparison, steps, folder


def test_the_table_has_the_accelerations(compared):
    """a is the answer, v the velocity after it, and the closed form is compared with a."""
    _, steps, folder = compared
    table = read_table(folder).to_pylist()
    by_place = {(row["resolver"], row["tick"]): row for row in table}
    v = dict.fromkeys(NAMES, np.zeros(3))
    for step in steps:
        row = by_place[step.resolver, step.index]
        assert row["a"] == step.resolution.a.tolist()
        assert np.allclose(row["v"], v[step.resolver] + 5e-3 * np.array(row["a"]), atol=1e-14)
        assert row["closed_form_distance"] == np.abs(row["a"] - step.closed_form).max()
        v[step.resolver] = np.array(row["v"])
    assert any("joint_acceleration" in name for row in table for name in row["active"])


def test_the_manifest_tells_order_and_units(compared):
    """A reader learns that the unknowns are accelerations."""
    facts = json.loads((compared[2] / "manifest.json").read_text())
    assert facts["order"] == 2
    assert set(facts["unknowns"].values()) == {"rad/s²"}


def test_the_recording_has_the_accelerations_in_their_limits(compared):
    """The answer with limits ends at ±1, the closed form beyond."""
    recording = compared[2] / "run.rrd"
    share = {
        name: np.abs(rows_of(recording, f"/resolver/{name}/a_normalised")["scalars"]).max() for name in NAMES
    }
    assert share["active-set"] == pytest.approx(1.0, abs=1e-12)
    assert share["pinv"] > 2.0
    a = rows_of(recording, "/resolver/active-set/a")["scalars"]
    assert np.abs(a).max() == pytest.approx(STRONGEST)


def test_the_report_is_in_units_of_accelerations(compared, monkeypatch):
    """No figure of an answer is called rad/s, and the excess over acceleration limits is told."""
    comparison, _, _ = compared
    monkeypatch.setenv("COLUMNS", "300")
    console = terminal()
    for chosen in (comparison.summaries.values(), [comparison.summaries["active-set"]]):
        with console.capture() as capture:
            show(chosen, console, comparison.baseline)
        text = capture.get()
        assert "rad/s²" in text
        assert "rad/s of" not in text
    assert "change of an acceleration in one tick, largest [rad/s²]" in text
    assert comparison.summaries["active-set"].acceleration_violation < 1e-9
    assert comparison.summaries["pinv"].acceleration_violation > 1.0
    assert str(comparison.summaries["active-set"].judged.bound).split()[1] == "rad/s²"
