"""A log has every tick to the last bit, and solves it again from its data alone."""

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather

from taskopt import Controller, Status, find_conflict, open_log, solve_again
from taskopt.errors import BadLog, InvalidValue, MissingFile, UnknownName
from taskopt.log import ring
from tests.log.conftest import ARM, DT, START, run, stack

KINDS = ("active-set", "hqp/daqp", "wqp/proxqp", "pinv", "full norm", "damped")


def same(one, other) -> bool:
    return np.array_equal(one, other, equal_nan=True)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_tick_is_there_to_the_last_bit(logged, kind):
    """Hierarchy, answer, active set, claim and sentences of each row are those that the step returned."""
    ran = logged(kind)
    assert len(ran.log) == len(ran.answers)
    assert ran.log.missing == ""
    for k, answer in enumerate(ran.answers):
        tick = ran.log.tick(k)
        declared = answer if answer.undamped is None else answer.undamped
        if kind == "wqp/proxqp":  # one program for all levels
            assert set(map(str, tick.resolution.active)) == set(map(str, answer.active))
        else:
            assert same(tick.hierarchy.buffer, declared.problem.buffer)
            assert same(tick.resolution.answer, answer.answer)
            assert same(tick.resolution.state, answer.state)
        assert (tick.resolution.status, tick.resolution.iterations) == (answer.status, answer.iterations)
        assert same(tick.x, answer.x)
        assert same(tick.values["q"], ran.postures[k])
        if answer.undamped is not None:
            assert same(tick.resolution.undamped.answer, answer.undamped.answer)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_tick_is_solved_again_to_the_last_bit(logged, kind):
    """Any tick, in any order, gives the velocity that was sent, and its active set."""
    ran = logged(kind)
    for k in np.random.default_rng(0).permutation(len(ran.log)):
        again = solve_again(ran.log.tick(int(k)))
        assert again.distance == 0.0
        assert same(again.resolution.answer, ran.answers[k].answer)
        assert same(again.resolution.state, ran.answers[k].state)


def test_limits_bind_and_ticks_are_damped(logged):
    """What the tests above compare is not trivial: sets change, ticks are damped, memory alternates."""
    states = logged("active-set").log.array("state")
    assert len(np.unique(states, axis=0)) > 2
    damped = logged("damped")
    count = sum(answer.undamped is not None for answer in damped.answers)
    assert 0 < count == damped.control.damped_ticks
    assert sum(value is not None for value in damped.log.array("damped")) == count


def test_a_changed_bit_is_noticed(logged):
    """A row whose numbers were changed by one bit does not give the same answer."""
    tick = logged("active-set").log.tick(7)  # where limits hold all joints
    box = np.nextafter(tick.values["box"], np.inf)
    changed = type(tick)(tick.row, dict(tick.values, box=box), tick.layout, tick.damped, tick.norm)
    assert solve_again(changed).distance > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["raise", "relax", "brake"])
def test_a_conflict_is_in_the_log(tmp_path, policy):
    """The tick at which limits exclude each other has its hierarchy, its status and the conflict in words."""

    def pushed(control: Controller, k: int) -> None:
        if k == 20:  # faster than the limit on velocity, and no room to slow down to it
            control.plan.moved(np.array([2.5, 0.0, 0.0]))

    ran = run(tmp_path / "a.arrow", stack(), policy=policy, on_tick=pushed, ticks=25)
    tick = ran.log.tick(20)
    assert find_conflict(tick.hierarchy) is not None
    said = tick.error if policy == "raise" else " ".join(tick.resolution.notes)
    assert "these limits exclude each other" in said
    assert "joint1" in said
    expected = {"raise": Status.INFEASIBLE, "relax": Status.RELAXED, "brake": Status.BRAKED}[policy]
    assert tick.resolution.status is expected
    assert bool(tick.values["failed"]) == (policy == "raise")
    assert len(ran.log) == (21 if policy == "raise" else 25)
    assert same(tick.values["v_before"], [2.5, 0.0, 0.0])
    if policy != "raise":
        assert same(tick.resolution.answer, ran.answers[20].answer)
        assert same(tick.x, ran.answers[20].x)
    assert solve_again(tick).distance == 0.0  # no answer again, the same relaxation, or braking again
    if policy == "brake":
        agreed = dict(tick.values, box=np.array([-9.0] * 3 + [9.0] * 3))  # the planted lie: limits that agree
        assert solve_again(type(tick)(20, agreed, tick.layout, tick.damped, tick.norm)).distance > 0.0


def test_a_tick_with_a_bad_posture_is_in_the_log(tmp_path):
    """A tick that raises an error because a posture is not finite says so in its row."""
    control = Controller(ARM, stack(), dt=DT, log=tmp_path / "a.arrow")
    control.step(START, 0.0)
    control.step(START, DT)
    with pytest.raises(InvalidValue):
        control.step(np.array([0.3, np.nan, 0.0]), 2 * DT)
    control.log.close()
    log = open_log(tmp_path / "a.arrow")
    assert log.array("failed").tolist() == [False, False, True]
    assert "NaN" in log.tick(2).error
    assert np.isnan(log.tick(2).x).all()


def test_names_and_units_are_in_the_file(logged):
    """Columns have names, units and descriptions, and the metadata says what the robot can do."""
    log = logged("active-set").log
    assert log.names("x") == log.layout.unknowns == ("joint1", "joint2", "joint3")
    assert (log.unit("q"), log.unit("x"), log.unit("error/hand"), log.unit("t")) == ("rad", "rad/s", "m", "s")
    assert log.facts["robot"]["position_upper"] == [3.0, 3.0, 3.0]
    assert log.facts["parameters"]["hand.weight"] == 1.0
    assert log.facts["tolerances"]["KKT_MET"] == 1e-8
    assert log.facts["versions"]["numpy"] == np.__version__
    assert [task["name"] for task in log.facts["stack"]] == ["hand", "posture"]
    assert log.resolvers == ("active-set",)
    with pytest.raises(UnknownName, match="did you mean error/hand"):
        log.array("error/hnd")


def test_other_readers_open_it(logged):
    """A closed log is an ordinary Arrow file, with lists of one length and without extension types."""
    ran = logged("active-set")
    table = feather.read_table(ran.log.path)
    assert table.num_rows == len(ran.answers)
    assert table.column("q").type == pa.list_(pa.float64(), 3)
    assert table.equals(ran.log.table())


def test_a_time_leads_to_its_tick(logged):
    """`at` finds the last tick at or before a time, and refuses times outside."""
    log = logged("active-set").log
    assert [log.at(k * DT) for k in (0, 7, 79)] == [0, 7, 79]
    assert log.at(7.5 * DT) == 7
    with pytest.raises(InvalidValue, match=r"from 0 to 0\.395 s"):
        log.at(9.0)


@pytest.mark.parametrize(
    "changes", [{"hand.weight": 0.25}, {"posture.enabled": False}, {"hand.weight": [0.0, 2.0]}]
)
def test_a_changed_tick_is_that_of_a_changed_loop(logged, changes):
    """Solving a tick again with other weights gives what a controller gives there whose weights were set."""
    ran, k = logged("active-set"), 12
    control = Controller(ARM, stack(), dt=DT)
    control.start(START)
    control.plan.moved(ran.answers[k - 1].x)
    control.set(
        {name: np.array(value) if isinstance(value, list) else value for name, value in changes.items()}
    )
    expected = control.step(ran.postures[k], k * DT)
    again = solve_again(ran.log.tick(k), changes=changes)
    np.testing.assert_allclose(again.resolution.x, expected.x, atol=1e-9)


def test_a_limit_that_is_taken_out_leaves_the_others(tmp_path, logged):
    """Without the limit on acceleration a tick is that of a stack without it; others stay."""
    ran, k = logged("active-set"), 3
    tick = ran.log.tick(k)
    assert solve_again(tick).resolution.active
    again = solve_again(tick, without=["joint_acceleration"])
    free = Controller(ARM, stack(acceleration=None), dt=DT)
    np.testing.assert_allclose(again.resolution.x, free.step(ran.postures[k], k * DT).x, atol=1e-9)
    assert "joint_acceleration" in again.notes[0]
    with pytest.raises(UnknownName, match="joint_velocity"):
        solve_again(tick, without=["joint_velociy"])
    with pytest.raises(InvalidValue, match="only weights"):
        solve_again(tick, changes={"hand.gain": 2.0})


def test_another_resolver_gives_the_same_optimum(logged):
    """A tick that is solved again by a cascade of programs has the same answer within its accuracy."""
    tick = logged("active-set").log.tick(15)
    assert solve_again(tick, "hqp/daqp").distance < 1e-7
    assert solve_again(tick, "pinv").distance > 1e-2


@pytest.mark.slow
def test_a_full_ring_waits_and_drops_nothing(tmp_path, monkeypatch):
    """A loop that is faster than the writer waits for it; the log counts that and has every tick."""
    monkeypatch.setattr(ring, "BYTES", 0)  # the least number of slots
    ran = run(tmp_path / "a.arrow", stack(), ticks=400)
    assert ran.log.end.waits > 0
    assert ran.log.end.waited > 0.0
    assert ran.log.array("tick").tolist() == list(range(400))
    assert [solve_again(ran.log.tick(k)).distance for k in (63, 64, 399)] == [0.0, 0.0, 0.0]


def test_what_is_no_log_is_refused(tmp_path):
    """A missing file, another file and an Arrow file of something else each have one clear error."""
    with pytest.raises(MissingFile, match=r"log="):
        open_log(tmp_path / "none.arrow")
    with pytest.raises(MissingFile, match="no log in"):
        open_log(tmp_path)
    (tmp_path / "text.arrow").write_text("not a log")
    with pytest.raises(BadLog, match="does not begin as an Arrow file"):
        open_log(tmp_path / "text.arrow")
    feather.write_feather(pa.table({"tick": [1, 2]}), tmp_path / "other.arrow", compression="uncompressed")
    with pytest.raises(BadLog, match="no log of taskopt"):
        open_log(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "spared"), [("taskopt.loop.controller", "pyarrow"), ("taskopt.log.writer", "numba")]
)
def test_neither_side_loads_what_only_the_other_needs(module: str, spared: str) -> None:
    """A controller without a log starts without Arrow, and the writer without what compiles kernels."""
    code = f"import sys, {module}; print('{spared}' in sys.modules, 'numpy' in sys.modules)"
    words = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert words.split() == ["False", "True"]
