"""Runs that begin at a moment of a log: the same velocities, or what another weight would have done."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt import (
    Circle,
    Controller,
    During,
    JointTask,
    LogStart,
    PositionTask,
    RestDamping,
    Scenario,
    Stack,
    open_log,
    run,
)
from taskopt.cli import app
from taskopt.errors import InvalidValue, UnknownName
from taskopt.loop.scenario import load_scenario, scenario_files
from tests.log.conftest import ARM, DT, START, stack

TICKS = 120


def scenario(declared: Stack | None = None, **changes) -> Scenario:
    settings = {"robot": ARM, "q0": START, "duration": TICKS * DT, "dt": DT, "stack": declared or stack()}
    return Scenario(**{**settings, **changes})


def switched() -> Stack:
    """A target that moves, and a second one that replaces it from 0.2 to 0.4 s; limits bind on the way."""
    circle = Circle(radius=0.2, period=0.5, toward=(-1, 0, 0), along=(0, 1, 0), turns=2)
    hand = PositionTask("tip", target=circle, gain=10.0, axes="xy", name="hand")
    other = During(
        PositionTask("tip", target=(0.2, 0.9, 0.0), gain=5.0, axes="xy"), begin=0.2, end=0.4, blend=0.1
    )
    return Stack([[hand], [other, JointTask(gain=1.0)]], stack().limits)


DECLARED = {
    "limits": lambda: scenario(),
    "switched": lambda: scenario(switched()),
    "settings": lambda: scenario(settings={"hand.gain": 4.0, "posture.weight": 2.0}),
    "damped": lambda: scenario(
        stack((2.0, 0.3, 0.0), damping=RestDamping(), acceleration=None), duration=500 * DT
    ),
}


def onward(declared: Scenario, log, index: int, resolver: str = "active-set", changes=None):
    """The velocities of a run that begins at a tick of a log."""
    steps = list(run(declared, resolver, judged=1, start=LogStart(log, index * declared.dt, changes)))
    assert [step.index for step in steps] == list(range(index, declared.ticks))
    return np.array([step.x for step in steps])


@pytest.mark.parametrize("kind", DECLARED)
@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp"])
def test_an_unchanged_run_goes_on_to_the_last_bit(tmp_path, kind, resolver):
    """From any tick on, the velocities are those of the log, where limits bind and ticks are damped, too."""
    declared = DECLARED[kind]()
    sent = np.array([step.x for step in run(declared, resolver, judged=1, log=tmp_path / "a.arrow")])
    log = open_log(tmp_path / "a.arrow")
    damped = [k for k, value in enumerate(log.array("damped")) if value is not None] if log.damped else [0]
    for index in {0, 1, 61, declared.ticks - 1, damped[-1] if damped else 0}:
        assert np.array_equal(onward(declared, log, index, resolver), sent[index:])
    assert kind != "damped" or damped[-1] > 100


def test_the_velocity_before_matters(logged):
    """The planted lie: a loop that begins at the same posture, but at rest, sends other velocities."""
    ran, k = logged("active-set"), 12
    control = Controller(ARM, stack(), dt=DT)
    control.start(START)
    assert np.abs(control.step(ran.postures[k], k * DT).x - ran.answers[k].x).max() > 1e-2
    assert np.array_equal(onward(scenario(duration=80 * DT), ran.log, k)[0], ran.answers[k].x)


def test_a_change_is_what_a_loop_does_that_changes_there(tmp_path):
    """Weights that change at 0.1 s give the velocities of a controller whose weights were set there."""
    declared, k = scenario(stack((2.0, 0.3, 0.0))), 20
    changes = {"hand.weight": [0.1, 1.0], "posture.target": [1.0, 1.0, 1.0]}
    list(run(declared, log=tmp_path / "a.arrow"))
    control, q, expected = Controller(ARM, declared.stack, dt=DT), START, []
    control.start(START)
    for i in range(TICKS):
        if i == k:
            control.set(changes)
        expected.append(control.step(q, i * DT).x)
        q = ARM.integrate(q, expected[-1], DT)
    log = open_log(tmp_path / "a.arrow")
    found = onward(declared, log, k, changes=changes)
    np.testing.assert_allclose(found, expected[k:], atol=1e-9)
    assert np.abs(found - log.array("x")[k:]).max() > 1e-3


def test_another_resolver_begins_there_without_memory(logged):
    """A resolver that the log does not have goes on from posture and velocity, to the same optimum."""
    ran = logged("active-set")
    found = onward(scenario(duration=80 * DT), ran.log, 30, "hqp/clarabel")
    np.testing.assert_allclose(found, ran.log.array("x")[30:], atol=1e-5)


def test_what_is_no_moment_of_the_scenario_is_refused(tmp_path):
    """Another target, robot, time or parameter, and the log of such a run, each have one clear error."""
    declared, path = scenario(), tmp_path / "a.arrow"
    list(run(declared, log=path))

    def refused(kind, match, other=declared, t=0.1, changes=None):
        with pytest.raises(kind, match=match):
            next(run(other, start=LogStart(path, t, changes)))

    refused(InvalidValue, "at 0 s it differs in bounds of hand/", scenario(stack((0.21, 0.9, 0.0))))
    refused(InvalidValue, "joint_acceleration", scenario(stack(acceleration=None)))
    refused(InvalidValue, "from 0 to", t=9.0)
    refused(InvalidValue, "the scenario ends at 0.05 s", replace(declared, duration=0.05))
    refused(UnknownName, "did you mean hand.weight", changes={"hnd.weight": 1.0})
    list(run(declared, log=tmp_path / "b.arrow", start=LogStart(path, 0.1)))
    with pytest.raises(InvalidValue, match=r"b\.arrow itself begins at 0\.1 s of .*a\.arrow"):
        LogStart(tmp_path / "b.arrow", 0.2)


def test_a_command_runs_onward(tmp_path):
    """`run --from` logs the ticks from there on, which `diff` finds to be the same, or apart by --set."""
    words, log = ["tasks/planar_circle.py", "--no-record", "--duration", "0.1"], str(tmp_path / "a.arrow")

    def command(*words):
        done = CliRunner().invoke(app, list(words), catch_exceptions=False)
        return done.output

    command("run", *words, "--set", "tip position.gain=400", "--log", log)
    same, other = str(tmp_path / "b.arrow"), str(tmp_path / "c.arrow")
    total = len(open_log(log))
    begin = open_log(log).t[total // 2]
    assert f"{total - total // 2} ticks of" in command(
        "run", *words, "--from", f"{log}@{begin}", "--log", same
    )
    ticks = open_log(same).array("tick").tolist()
    assert ticks == list(range(total // 2, total))
    assert f"all {len(ticks)} ticks that both have are the same" in command("diff", log, same)
    command("compare", *words, "-r", "active-set,pinv", "--from", f"{log}@{begin}", "--set",
            "tip position.gain=300", "--log", other)  # fmt: skip
    assert open_log(other).facts["from"]["changes"] == {"tip position.gain": 300.0}
    assert "apart from tick" in command("diff", log, other)
    for bad, match in ((["--from", log], "LOG@SECONDS"), (["--from", f"{log}@0.05", "--dt", "0.1"], "--dt")):
        with pytest.raises(InvalidValue, match=match):
            command("run", *words, *bad)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("path", scenario_files(), ids=lambda path: path.stem)
def test_every_scenario_goes_on_to_the_last_bit(tmp_path, path):
    """Each scenario of tasks/, for half a second at most, from its middle on."""
    declared = load_scenario(path)
    declared = replace(declared, duration=min(declared.duration, 0.5))
    sent = np.array([step.x for step in run(declared, judged=1, log=tmp_path / "a.arrow")])
    middle = declared.ticks // 2
    assert np.array_equal(onward(declared, open_log(tmp_path / "a.arrow"), middle), sent[middle:])
