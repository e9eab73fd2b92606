"""What a log tells: when limits were active, what one tick was, why it ended, as text and by commands."""

import re
from itertools import groupby

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt.cli import app
from taskopt.errors import TaskoptError
from taskopt.log import story
from taskopt.log.spans import spans
from tests.log.conftest import DT, run, stack


def command(*words) -> str:
    """Run a command and return what it prints."""
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


@pytest.mark.parametrize("kind", ["active-set", "hqp/daqp"])
def test_spans_are_those_of_the_answers(logged, kind):
    """Begin, length and price of each span are what the answers of the loop say, tick by tick."""
    ran = logged(kind)
    found = {(f"{s.name} {s.side}", s.first, s.last): s for s in spans(ran.log, kind)}
    active = [{str(row): row.multiplier for row in answer.active} for answer in ran.answers]
    expected = {}
    for name in {name for tick in active for name in tick}:
        place = 0
        for on, ticks in groupby(name in tick for tick in active):
            length = len(list(ticks))
            if on:
                prices = [abs(tick[name]) for tick in active[place : place + length]]
                expected[name, place, place + length - 1] = max(prices)
            place += length
    assert set(found) == set(expected)
    assert len(found) > 3
    for key, span in found.items():
        assert span.begin == pytest.approx(key[1] * DT)
        assert span.duration == pytest.approx((key[2] - key[1] + 1) * DT)
        if span.level == 1:
            assert abs(span.price) == pytest.approx(expected[key])
            assert span.unit == "(m/s)² per rad/s"


def test_a_joint_has_its_limits_with_price_and_error(logged):
    """`show --joint` says which limit, when first, how long, the price with its unit, and the error in mm."""
    ran = logged("active-set")
    text = command("show", ran.log.path, "--joint", "joint1")
    first = next(s for s in spans(ran.log, "active-set") if s.name.endswith("joint1"))
    assert f"{first.name} {first.side}: from {first.begin:.6g} s for {first.duration:.4g} s" in text
    assert "(m/s)² per rad/s" in text
    assert re.search(r"meanwhile hand: error up to [\d.]+ mm at ", text)
    assert "joint2" not in text


def test_an_instant_is_explained(logged):
    """`show --at` has what was sent, the proof, and what holds it back, of the tick at that time."""
    ran, k = logged("active-set"), 12
    text = command("show", ran.log.path, "--at", k * DT)
    assert f"tick {k}, t = {k * DT:g} s" in text
    assert ran.answers[k].explain() in text
    size = np.linalg.norm(ran.log.array("error/hand")[k])
    assert f"hand: error {1000 * size:.4g} mm" in text


@pytest.mark.slow
def test_a_summary_and_the_end(logged, tmp_path):
    """`show` counts claims and names limits; `show --why` has the conflict that ended a loop."""
    ran = logged("active-set")
    text = command("show", ran.log.path)
    assert "80 ticks from 0 to 0.395 s; 80 SOLVED" in text
    assert "joint_velocity/joint1" in text
    assert "the log is complete: finished" in command("show", ran.log.path, "--why")

    def pushed(control, k):
        if k == 20:
            control.plan.moved(np.array([2.5, 0.0, 0.0]))

    failed = run(tmp_path / "a.arrow", stack(), on_tick=pushed, ticks=25)
    text = command("show", failed.log.path, "--why")
    assert "raised an error at t = 0.1 s" in text
    assert "these limits exclude each other" in text
    braked = run(tmp_path / "b.arrow", stack(), on_tick=pushed, ticks=25, policy="brake")
    assert "Braking, these limits exclude each other" in story.why(braked.log)


def test_a_log_is_replayed_by_a_command(logged):
    """`replay` solves all ticks to the last bit, or one of them changed."""
    ran = logged("active-set")
    assert "80 of 80 ticks have the same answer to the last bit" in command("replay", ran.log.path)
    text = command("replay", ran.log.path, "--at", 3 * DT, "--without", "joint_acceleration")
    assert "joint_acceleration; of the other limits" in text
    assert "0 of 1" not in text
    changed = command("replay", ran.log.path, "--at", 3 * DT, "--set", "hand.weight=0.1", "-r", "hqp/daqp")
    assert re.search(r"joint1: [-\d.]+ → [-\d.]+", changed)
    with pytest.raises(TaskoptError, match="add --at"):
        CliRunner().invoke(app, ["replay", str(ran.log.path), "--set", "a.weight=1"], catch_exceptions=False)


def test_notes_that_differ_in_numbers_only_are_told_once(logged, monkeypatch):
    """The first one, and how many there are; those of another joint or level are others."""
    log = logged("active-set").log
    notes = [[] for _ in log.t]
    notes[3] = ["joint1 broken by 0.5 rad/s"]
    notes[4] = ["joint1 broken by 1.2e-05 rad/s", "joint2 broken by 0.5 rad/s", "level 1 lost"]
    notes[7] = ["joint1 broken by -3 rad/s", "level 2 lost"]
    monkeypatch.setattr(type(log), "array", lambda *_: np.array(notes, dtype=object))
    assert list(story.noted(log)) == [
        f"at {log.t[3]:.6g} s, first of 3 ticks of this kind: joint1 broken by 0.5 rad/s",
        f"at {log.t[4]:.6g} s: joint2 broken by 0.5 rad/s",
        f"at {log.t[4]:.6g} s: level 1 lost",
        f"at {log.t[7]:.6g} s: level 2 lost",
    ]
