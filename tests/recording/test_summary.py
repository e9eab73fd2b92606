"""How smoothly a run goes: jumps by transition, and alternation, in the report and on the panel."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskopt import JointTask, JointVelocityLimit, PositionTask, Scenario, Stack
from taskopt.compare import Comparison
from taskopt.hierarchy.status import Status
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.task import During
from taskopt.loop.continuity import Continuity
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario
from taskopt.recording.batch import Batch
from taskopt.recording.viewer.summary_panel import SummaryPanel
from taskopt.report import show, terminal
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.transpose import Transpose

DT = 2e-3


def scenario(blend: float) -> Scenario:
    """An arm whose tip is sent aside at 0.1 s."""
    arm = planar_arm([0.5, 0.5, 0.5], velocity=2.0)
    aside = During(PositionTask("tip", target=(0.5, 0.9, 0.0), axes="xy"), begin=0.1, blend=blend)
    stack = Stack([[aside], [JointTask()]], [JointVelocityLimit()])
    return Scenario(robot=arm, q0=[0.3, 0.5, 0.4], stack=stack, duration=0.5, dt=DT, name="aside")


@pytest.mark.parametrize("blend", [0.0, 0.2])
def test_the_jump_is_that_of_the_path_and_is_told_with_its_transition(blend):
    """The figure is the largest difference of successive velocities; the sentence says when it was."""
    of = scenario(blend)
    watch, path = Continuity(of.stack.compile(of.robot, DT)), []
    for step in run(of, ActiveSet()):
        watch.add(step.t, step.resolution)
        path.append(step.v)
    assert watch.jump == pytest.approx(np.abs(np.diff(path, axis=0)).max())
    told = watch.sentences()
    assert len(told) == 1
    assert f"while tip position comes (0.1 to {0.1 + blend:g} s)" in told[0]
    assert "elsewhere" in told[0]
    assert watch.jump > 0.3 if blend == 0.0 else watch.jump < 0.1


def test_a_run_without_transitions_that_is_smooth_has_nothing_to_tell():
    """No sentence, and a small figure."""
    arm = planar_arm([0.5, 0.5])
    of = Scenario(robot=arm, q0=[0.3, 0.5], stack=Stack([[JointTask([0.4, 0.5])]]), duration=0.2, dt=DT)
    watch = Continuity(of.stack.compile(arm, DT))
    for step in run(of, ActiveSet()):
        watch.add(step.t, step.resolution)
    assert watch.sentences() == []
    assert watch.jump < 1e-3


@pytest.mark.slow
def test_alternation_is_in_the_report_and_on_the_panel(monkeypatch):
    """A target out of reach: three limits by name, with the cause and what to do, and how many more."""
    arm = planar_arm([0.5, 0.5, 0.5], velocity=2.0)
    far = PositionTask("tip", target=(1.8, 1.2, 0.0), gain=20.0, axes="xy")
    stack = Stack([[far], [JointTask()]], [JointVelocityLimit()], damping=None)
    of = Scenario(robot=arm, q0=[0.3, 0.5, 0.4], stack=stack, duration=0.6, dt=DT, name="far")
    comparison = Comparison(of, [ActiveSet()])
    steps = list(comparison)
    gauge = comparison.summaries["active-set"].gauge
    panel = SummaryPanel(gauge.info, gauge)
    panel.take(Batch(tuple(steps)))
    monkeypatch.setenv("COLUMNS", "300")
    console = terminal()
    with console.capture() as capture:
        show(comparison.summaries.values(), console, "active-set")
    for text in (capture.get(), panel.text("finished")):
        assert text.count("alternates: joint_velocity/joint") == 3
        assert "rank: a level is near a loss of rank" in text
        assert "more limit" in text


def test_ticks_that_the_policy_settles_are_counted_and_the_first_is_quoted():
    """A conflict of limits is named with its time, not only seen in the share that is proven."""
    of = replace(load_scenario(Path(__file__).parents[2] / "tasks" / "planar_conflict.py"), duration=0.6)
    watch, braked = Continuity(of.stack.compile(of.robot, of.dt)), 0
    for step in run(of, ActiveSet()):
        watch.add(step.t, step.resolution)
        braked += step.resolution.status is Status.BRAKED
    assert braked > 10
    assert watch.sentences()[0].startswith(f"{braked} ticks braked, first at 0.5")
    assert "obstacle" in watch.sentences()[0]


def test_ticks_that_are_stuck_are_counted_and_named():
    """A stretched arm whose target lies ahead: the transpose stays, and the report says why."""
    arm = planar_arm([0.5, 0.5])
    ahead = PositionTask("tip", target=(0.7, 0.0, 0.0), gain=10.0, axes="xy")
    of = Scenario(robot=arm, q0=[0.0, 0.0], stack=Stack([[ahead]]), duration=0.1, dt=DT, name="ahead")
    watch = Continuity(of.stack.compile(arm, DT))
    for step in run(of, Transpose()):
        watch.add(step.t, step.resolution)
    assert len(watch.sentences()) == 1
    assert watch.sentences()[0].startswith("50 ticks stuck, first at 0 s: The transposed Jacobian is stuck")
    assert "tip position/x, tip position/y" in watch.sentences()[0]


def test_a_task_out_of_force_has_no_error_to_show():
    """Before it begins its error is a gap in the series; from then on it is there."""
    of = scenario(0.1)
    batch = Batch(tuple(run(of, ActiveSet())))
    begun = batch.t > 0.1
    np.testing.assert_array_equal(batch.in_force("tip position")[~begun], np.zeros((~begun).sum(), bool))
    assert batch.in_force("tip position")[begun].all()
    assert batch.in_force("posture").all()


def test_what_binds_does_not_depend_on_where_a_run_is_cut_into_batches():
    """A row that is an equality later and an inequality while it comes is judged tick by tick."""
    steps = tuple(run(scenario(0.1), ActiveSet()))
    whole = Batch(steps).state
    for cut in (60, 90, 120):
        np.testing.assert_array_equal(np.vstack([Batch(steps[:cut]).state, Batch(steps[cut:]).state]), whole)
