"""Logs of stacks of second order: the same promises as at first order, with accelerations as unknowns."""

import numpy as np
import pytest

from taskopt import (
    Controller,
    JointAccelerationLimit,
    JointTask,
    JointVelocityLimit,
    LogStart,
    PositionTask,
    RestDamping,
    Scenario,
    Stack,
    open_log,
    run,
    solve_again,
)
from taskopt.log import story
from taskopt.log.claims import claims
from taskopt.log.difference import difference
from taskopt.log.report import markdown
from tests.log.conftest import ARM, DT, START

TICKS = 120


def second(target=(0.2, 0.9, 0.0), damping=None) -> Stack:
    """A hand that goes for a target within limits on velocity and acceleration, which bind on the way."""
    hand = PositionTask("tip", target=target, gain=10.0, axes="xy", name="hand")
    limits = [JointVelocityLimit(velocity=0.9), JointAccelerationLimit(8.0)]
    return Stack([[hand], [JointTask(gain=1.0, name="posture")]], limits, order=2, damping=damping)


@pytest.fixture(scope="module", params=["active-set", "hqp/daqp", "damped"])
def looped(request, tmp_path_factory):
    """A controller that was logged, its answers, its postures and velocities, and the log."""
    path = tmp_path_factory.mktemp("second") / "a.arrow"
    name = "active-set" if request.param == "damped" else request.param
    declared = second((2.0, 0.3, 0.0), RestDamping()) if request.param == "damped" else second()
    control = Controller(ARM, declared, name, DT, log=path)
    q, v, states, answers = START, np.zeros(3), [], []
    for k in range(6 * TICKS if request.param == "damped" else TICKS):
        states.append((q, v))
        answers.append(control.step(q, k * DT))
        q, v = control.after()
    control.log.close()
    return request.param, control, answers, states, open_log(path)


def test_every_tick_is_there_and_is_solved_again_to_the_last_bit(looped):
    """Accelerations, postures, velocities before and hierarchies are those of the step."""
    kind, control, answers, states, log = looped
    assert len(log) == len(answers)
    for k, (answer, (q, v)) in enumerate(zip(answers, states, strict=True)):
        tick = log.tick(k)
        plain = answer if answer.undamped is None else answer.undamped
        assert np.array_equal(tick.x, answer.a)
        assert np.array_equal(tick.values["q"], q)
        assert np.array_equal(tick.values["v_before"], v)
        assert np.array_equal(tick.hierarchy.buffer, plain.problem.buffer)
        assert np.array_equal(tick.resolution.answer, answer.answer)
        assert solve_again(tick).distance == 0.0
    assert any(answer.active for answer in answers)
    assert (control.damped_ticks > 0) == (kind == "damped")


def test_units_are_those_of_accelerations(looped):
    """Names and units say rad/s² where accelerations stand, and rad/s for the velocity before."""
    _, _, _, _, log = looped
    assert (log.unit("x"), log.unit("v_before"), log.unit("q")) == ("rad/s²", "rad/s", "rad")
    assert log.unit("error/hand") == "m"
    assert [task["name"] for task in log.facts["stack"]] == ["hand", "posture", "self-motion"]
    assert "joint1 " in story.of_tick(log, 3)
    assert "rad/s²" in story.of_tick(log, 3)
    assert "(m/s²)² per rad/s²" in markdown(log, claims(log))
    assert "joint_acceleration/joint1" in story.summary(log)
    assert not any(len(claim.rows) for claim in claims(log) if claim.name in ("violation", "error"))


def test_a_run_goes_on_from_its_log_to_the_last_bit(tmp_path):
    """A run of second order is logged, and goes on from any tick; another weight sends it elsewhere."""
    scenario = Scenario(
        robot=ARM, q0=START, stack=second((2.0, 0.3, 0.0)), duration=TICKS * DT, dt=DT, name="second"
    )
    sent = np.array([step.x for step in run(scenario, log=tmp_path / "a.arrow")])
    log = open_log(tmp_path / "a.arrow")
    for k in (1, 50):
        steps = run(scenario, start=LogStart(log, k * DT), log=tmp_path / "b.arrow")
        assert np.array_equal([step.x for step in steps], sent[k:])
        assert difference(log, open_log(tmp_path / "b.arrow")).first is None
    other = LogStart(log, 50 * DT, {"hand.weight": [0.1, 1.0]})
    list(run(scenario, start=other, log=tmp_path / "c.arrow"))
    found = difference(log, open_log(tmp_path / "c.arrow"))
    assert found.first == 50
    assert "Δq̈ of joint" in str(found)
    assert "rad/s² at" in str(found)
