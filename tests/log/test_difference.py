"""Where two logs come apart, why, and how far, against the loops that were run."""

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt import planar_arm
from taskopt.cli import app
from taskopt.errors import InvalidValue
from taskopt.log.difference import difference
from tests.log import conftest
from tests.log.conftest import DT, run, stack


def heavier(control, k):
    """Make the posture ten times heavier from tick 20 on."""
    if k == 20:
        control.set({"hand.weight": 3.0})


@pytest.mark.slow
def test_a_log_is_the_same_as_that_of_the_same_loop(logged, tmp_path):
    """Two runs of one loop differ nowhere, whatever the clock said, and the exit code is 0."""
    ran, again = logged("active-set"), run(tmp_path / "a.arrow", stack())
    found = difference(ran.log, again.log)
    assert found.same
    assert str(found) == "all 80 ticks that both have are the same"
    assert CliRunner().invoke(app, ["diff", str(ran.log.path), str(again.log.path)]).exit_code == 0


@pytest.mark.slow
def test_the_first_tick_apart_has_its_cause(logged, tmp_path):
    """A target that was changed at tick 5 is told as the cause there, with the largest Δq and Δv after."""
    ran, other = logged("active-set"), run(tmp_path / "a.arrow", stack((0.3, 0.8, 0.0)), ticks=60)

    found = difference(ran.log, other.log)
    expected_v = np.abs([a.x - b.x for a, b in zip(ran.answers, other.answers, strict=False)])
    expected_q = np.abs(np.array(ran.postures[:60]) - np.array(other.postures))
    first = int(np.flatnonzero(expected_v.any(axis=1))[0])
    assert (found.first, found.ticks, found.lengths) == (first, 60, (80, 60))
    assert found.causes[0].startswith("bounds of the hierarchy (bounds) at hand/")
    np.testing.assert_array_equal(found.dv, expected_v.max(axis=0))
    np.testing.assert_array_equal(found.dq, expected_q.max(axis=0))
    np.testing.assert_allclose(found.v_at, DT * expected_v.argmax(axis=0))
    done = CliRunner().invoke(app, ["diff", str(ran.log.path), str(other.log.path)])
    assert done.exit_code == 1
    assert f"apart from tick {first}" in done.output
    assert "Δv of joint" in done.output


@pytest.mark.slow
def test_a_weight_that_is_changed_later_is_the_cause_at_its_tick(logged, tmp_path):
    """The logs are the same until the tick at which a weight is set, and that weight is the cause."""
    ran = logged("active-set")
    other = run(tmp_path / "a.arrow", stack((2.0, 0.3, 0.0)), on_tick=heavier)
    base = run(tmp_path / "b.arrow", stack((2.0, 0.3, 0.0)))
    found = difference(base.log, other.log, tolerance=0.0)
    apart = [not np.array_equal(a.x, b.x) for a, b in zip(base.answers, other.answers, strict=True)]
    assert found.first == apart.index(True) >= 20
    assert found.causes[0].startswith("weight of the hierarchy (weight) at hand/x: 1, and 3")
    assert difference(ran.log, other.log, tolerance=100.0).first is None


def test_logs_of_other_robots_are_refused(logged, tmp_path, monkeypatch):
    """Logs with other unknowns cannot be compared, and the error names them."""
    ran = logged("active-set")  # with the arm as it is
    monkeypatch.setattr(conftest, "ARM", planar_arm([0.5, 0.4]))
    monkeypatch.setattr(conftest, "START", np.array([0.3, 0.8]))
    other = run(tmp_path / "a.arrow", stack(), ticks=2)
    with pytest.raises(InvalidValue, match="joint1, joint2, joint3, and joint1, joint2;"):
        difference(ran.log, other.log)
