"""Changes of parameters while a loop runs: what a log has of them, and what is made of it."""

import json

import numpy as np
import pytest

from taskopt import solve_again
from taskopt.kinematics.changes import Applied
from taskopt.kinematics.target import Line
from taskopt.log import words as words_of_slots
from taskopt.log.slots import TEXT_BYTES
from taskopt.log.story import summary
from taskopt.recording.derived.answers import Answers
from taskopt.recording.derived.events import events
from tests.log.conftest import DT, run, stack

SET = {
    10: {"hand.weight": 0.25},
    20: {"posture.gain": [2.0, 3.0, 4.0], "hand.target": Line(by=(0.1, 0.0, 0.0), duration=0.2)},
    30: {"posture.enabled": False},
}


def changing(control, k) -> None:
    """Set parameters before some ticks, one of them over a time."""
    if k in SET:
        control.set(SET[k])
    if k == 40:
        control.set({"hand.weight": 1.0}, over=0.05)


@pytest.fixture(scope="module", params=["active-set", "hqp/daqp"])
def changed(request, tmp_path_factory):
    """A loop whose parameters change, in one compiled call and in two."""
    folder = tmp_path_factory.mktemp("changes")
    return run(folder / "a.arrow", stack(), request.param, ticks=60, on_tick=changing)


def test_each_change_is_at_its_tick_with_both_values(changed):
    """A log lists what was set, when, from which value, to which, and over which time."""
    found = changed.log.changes()
    told = [(c.row, c.name, c.before, c.after, c.over) for c in found if c.name != "hand.target"]
    assert told == [
        (10, "hand.weight", 1.0, 0.25, 0.0),
        (20, "posture.gain", 1.0, [2.0, 3.0, 4.0], 0.0),
        (30, "posture.enabled", True, False, 0.0),
        (40, "hand.weight", 0.25, 1.0, 0.05),
    ]
    target = next(c for c in found if c.name == "hand.target")
    np.testing.assert_array_equal(target.before, changed.log.array("desired/hand")[19].reshape(4, 4))
    assert (target.row, target.t) == (20, 20 * DT)
    assert target.after.startswith("Line(")


def test_ticks_with_changes_are_solved_again_to_the_last_bit(changed):
    """The hierarchy in the log is that with the changed parameters, so that replay honours them."""
    for k in (9, 10, 20, 30, 40, 45, 59):
        assert solve_again(changed.log.tick(k)).distance == 0.0
    weights = [changed.log.tick(k).hierarchy.weight[:2].tolist() for k in (9, 10, 59)]
    assert weights == [[1.0, 1.0], [0.25, 0.25], [1.0, 1.0]]


def test_changes_are_told(changed):
    """`taskopt show` and the events of a recording have them, each with its values."""
    text = summary(changed.log)
    assert "set at 0.05 s: hand.weight: 1 → 0.25\n" in text
    assert "set at 0.1 s: posture.gain: 1 → [2, 3, 4]\n" in text
    assert "set at 0.2 s: hand.weight: 0.25 → 1, over 0.05 s\n" in text
    found = events(Answers(changed.log, changed.log.resolvers[0]), [])
    assert [e.place for e in found if e.text.startswith("set ")] == [10, 20, 20, 30, 40]


def test_a_loop_without_changes_tells_none(logged):
    """Nothing is made up."""
    ran = logged("active-set")
    assert ran.log.changes() == []
    assert "set at" not in summary(ran.log)


def test_changes_that_do_not_fit_a_slot_are_counted():
    """Words never exceed their slot; the last changes are left out, and their number is said."""
    many = [Applied(f"task{i}.target", np.eye(4), np.eye(4), 0.0) for i in range(40)]
    text = words_of_slots.words("it failed", changes=many)
    told = json.loads(text)
    kept = [json.loads(line) for line in told["changes"]]
    assert len(text) <= TEXT_BYTES < len(json.dumps([str(change) for change in many]))
    assert told["error"] == "it failed"
    assert kept[-1] == {"left_out": 40 - (len(kept) - 1)}
    assert [line["name"] for line in kept[:-1]] == [f"task{i}.target" for i in range(len(kept) - 1)]
