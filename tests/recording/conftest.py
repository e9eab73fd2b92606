"""A short run of a small arm whose velocity limit binds on the way."""

from pathlib import Path

import pytest

from taskopt.kinematics.limit import JointPositionLimit, JointVelocityLimit
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Circle
from taskopt.kinematics.task import JointTask, PositionTask
from taskopt.loop.run import Step, run
from taskopt.loop.scenario import Scenario
from taskopt.recording.log import Log
from taskopt.recording.run_info import RunInfo
from taskopt.resolver.registry import resolver

NAMES = ("active-set", "wqp/daqp", "pinv")


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    """150 ticks around a circle; 0.9 rad/s is too little for a part of it."""
    tip = PositionTask(
        "tip",
        target=Circle(radius=0.2, period=1.0, toward=(-1, 0, 0), along=(0, 1, 0)),
        gain=50.0,
        axes="xy",
    )
    limits = [JointPositionLimit(), JointVelocityLimit(velocity=0.9)]
    return Scenario(
        robot=planar_arm([0.5, 0.4, 0.3], lower=-3.0, upper=3.0),
        q0=[0.3, 0.8, -0.5],
        stack=Stack(levels=[[tip], [JointTask(gain=1.0)]], limits=limits),
        duration=0.75,
        dt=5e-3,
        name="short",
        description="A short run.",
    )


@pytest.fixture(scope="session")
def info(scenario: Scenario) -> RunInfo:
    return RunInfo(scenario, NAMES, Path(__file__), seed=7)


@pytest.fixture(scope="session")
def steps(scenario: Scenario) -> dict[str, list[Step]]:
    """The steps of each resolver."""
    return {name: list(run(scenario, resolver(name))) for name in NAMES}


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory, info: RunInfo, steps: dict[str, list[Step]]) -> Path:
    """The log of all three runs, interleaved."""
    place = tmp_path_factory.mktemp("logs") / "one"
    place.mkdir()
    log = Log(info, place)
    with log:
        for ticks in zip(*steps.values(), strict=True):
            for step in ticks:
                log.write(step)
    return log.folder
