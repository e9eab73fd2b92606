"""Events and the active-set timeline: they tell what happened, when it happened."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskopt.hierarchy.damping import Chiaverini
from taskopt.hierarchy.rank import RankRule
from taskopt.kinematics.limit import JointVelocityLimit
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Line
from taskopt.kinematics.task import JointTask, OrientationTask, PositionTask
from taskopt.loop.run import Step, run, tracking_error
from taskopt.loop.scenario import Scenario
from taskopt.recording.log import Log
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.paths import EVENTS, data_path
from taskopt.resolver.base import Resolver
from taskopt.resolver.closed_form_resolvers import DampedLeastSquares, PseudoInverse
from taskopt.resolver.hqp import HierarchicalQP
from taskopt.resolver.registry import resolver
from tests.helpers.rrd import rows_of

PAST = PositionTask("tip", target=Line(by=(-1.2, 0.0, 0.0), duration=0.6), gain=10.0, axes="xy")


def passing(*limits: object) -> Scenario:
    """Past the base at 3 cm, where two links are almost folded; halfway σ_min falls to 0.03."""
    stack = Stack([[PAST]], limits, damping=None)  # type: ignore[arg-type]
    arm, start = planar_arm([0.5, 0.5]), [-0.8764, 1.8527]
    return Scenario(robot=arm, q0=start, stack=stack, duration=0.5, dt=2e-3, name="passing")


def recorded(made: Scenario, answer: Resolver, folder: Path) -> tuple[list[Step], Path]:
    folder.mkdir(exist_ok=True)
    log = Log(RunInfo(made, (answer.name,)), folder)
    with log:
        steps = list(run(made, answer, judged=1))  # events of verdicts would displace others
        for step in steps:
            log.write(step)
    return steps, log.folder / "run.rrd"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "answer", "words"),
    [
        ("damping", DampedLeastSquares(Chiaverini(0.05, 0.1)), "damping keeps it apart"),
        ("rank", PseudoInverse(RankRule(lost=0.1, regained=0.1)), "a rank that may go either way"),
        ("accuracy", HierarchicalQP("proxqp", accuracy=1e-13), "its accuracy is less than was asked for"),
    ],
)
def test_each_cause_is_an_event_from_its_first_tick_to_its_last(
    kind: str, answer: Resolver, words: str, tmp_path: Path
) -> None:
    """What the review of each tick says begins and ends in the recording at these very ticks."""
    made = passing(JointVelocityLimit(velocity=3.0)) if kind == "accuracy" else passing()
    steps, file = recorded(made, answer, tmp_path / "log")
    reviews = [step.resolution.review for step in steps]
    flag = np.array([any(cause.kind == kind for cause in review.causes) for review in reviews if review])
    assert flag.any()
    assert not flag.all()
    turns = np.flatnonzero(flag != np.concatenate([[False], flag[:-1]]))
    rows = rows_of(file, EVENTS)
    told = [tick for tick, text in zip(rows["tick"], rows["text"], strict=True) if words in text[0]]
    assert told == turns.tolist()


def test_one_row_of_the_timeline_tells_if_any_limit_is_active(tmp_path: Path) -> None:
    """Also where nothing ever does, so that no view is empty."""
    for velocity in (3.0, 1e4):
        made = passing(JointVelocityLimit(velocity=velocity))
        steps, file = recorded(made, resolver("active-set"), tmp_path / f"{velocity:g}")
        binds = np.array([bool(step.resolution.active) for step in steps])
        assert binds.any() == (velocity == 3.0)
        rows = rows_of(file, data_path("active-set", "active", "any_limit"))
        turns = np.flatnonzero(binds != np.concatenate([[not binds[0]], binds[:-1]]))
        assert rows["tick"] == turns.tolist()
        assert [state[0] for state in rows["state"]] == [
            "active" if binds[k] else "none active" for k in turns
        ]


def test_what_is_tracked_is_the_first_frame_with_rows_in_metres() -> None:
    """An orientation or a posture above the path is not what a reader means by tracking error."""
    made = passing()
    for above in (OrientationTask("tip", axes="y"), JointTask()):
        step = next(run(replace(made, stack=Stack([[above], [PAST]])), resolver("active-set")))
        assert tracking_error(step) == np.linalg.norm(step.errors["tip position"])
    alone = next(run(replace(made, stack=Stack([[JointTask([0.0, 0.0])]])), resolver("active-set")))
    assert tracking_error(alone) == np.linalg.norm(alone.errors["posture"])
