"""Comparisons: resolvers take turns on the same scenario, and the figures are what they say."""

import re
from dataclasses import dataclass
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from taskopt import (
    Circle,
    Hierarchy,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    PositionTask,
    Scenario,
    Stack,
)
from taskopt.compare import Comparison
from taskopt.errors import NotSolved
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.geometry import Sphere
from taskopt.kinematics.limit import ObstacleLimit, SelfCollisionLimit
from taskopt.kinematics.robot import planar_arm
from taskopt.loop.run import run
from taskopt.report import show
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.registry import resolver

PATH = Circle(radius=0.15, period=1.0, toward=(-1, 0, 0), along=(0, 1, 0))


def scenario(*limits: object, duration: float = 0.2) -> Scenario:
    return Scenario(
        robot=planar_arm([0.5, 0.5, 0.5], lower=-0.4, upper=0.65, velocity=1.5),
        q0=[0.3, 0.6, 0.5],
        stack=Stack([[PositionTask("tip", target=PATH, gain=50.0, axes="xy")], [JointTask()]], limits),
        duration=duration,
    )


def compared(made: Scenario, *resolvers: Resolver) -> Comparison:
    comparison = Comparison(made, resolvers)
    for _ in comparison:
        pass
    return comparison


@dataclass(frozen=True)
class Broken:
    """The exact resolver, with a lie in every answer, or until the tip is to go left too fast."""

    lie: float = 0.0
    name: str = "broken"
    strict: bool = True

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        resolution, memory = resolver("active-set")(hierarchy, memory)
        if self.lie:
            resolution.answer[0] += self.lie
            return resolution, memory
        if hierarchy.level(1).upper[0] < -0.5:
            resolution = resolution.replaced(Status.FAILED)
        return resolution, memory

    def closed_form(self, hierarchy: Hierarchy) -> np.ndarray:
        return resolver("active-set").closed_form(hierarchy)


def test_resolvers_take_turns_and_start_from_the_same_rows() -> None:
    """Steps come tick by tick in the order of the resolvers, the first ones from bit-equal hierarchies."""
    steps = [*Comparison(scenario(duration=0.01), [resolver("pinv"), resolver("active-set")])]
    assert [(step.index, step.resolver) for step in steps[:4]] == [
        (0, "pinv"),
        (0, "active-set"),
        (1, "pinv"),
        (1, "active-set"),
    ]
    np.testing.assert_array_equal(steps[0].hierarchy.buffer, steps[1].hierarchy.buffer)


@pytest.mark.slow
def test_the_closed_form_leaves_the_limits_and_the_optimiser_does_not() -> None:
    """With limits that bind, `pinv` violates them visibly and `active-set` by less than 1e-9."""
    summaries = compared(
        scenario(JointPositionLimit(), JointVelocityLimit(velocity=0.8)),
        resolver("pinv"),
        resolver("active-set"),
    ).summaries
    assert summaries["pinv"].velocity_violation > 0.1
    assert summaries["active-set"].velocity_violation < 1e-9
    assert summaries["active-set"].position_violation < 1e-9
    assert summaries["active-set"].path_difference > 1e-3
    assert summaries["pinv"].path_difference == 0.0
    assert any("joint_velocity" in name for name in summaries["active-set"].active)


@pytest.mark.slow
def test_without_limits_strict_resolvers_follow_one_path() -> None:
    """Where nothing binds, closed form, cascade and active set give the same path to 1e-8 rad."""
    names = ["pinv", "hqp/daqp", "active-set"]
    summaries = compared(scenario(duration=0.1), *map(resolver, names)).summaries
    for summary in summaries.values():
        assert summary.path_difference < 1e-8
        assert max(summary.closed_form_distances) < 1e-8
        assert len(summary.closed_form_distances) == summary.ticks == 100


@pytest.mark.slow
def test_claims_and_proofs_are_counted_apart() -> None:
    """A closed form claims nothing; a resolver that is wrong claims all, and all are refuted."""
    summaries = compared(scenario(), resolver("pinv"), resolver("active-set"), Broken(lie=1e-3)).summaries
    right = summaries["active-set"]
    assert summaries["pinv"].claimed == 0
    assert (right.claimed, right.judged.ticks, right.judged.proven) == (200, 200, 200)
    assert right.judged.bound is not None
    assert right.judged.bound.value < 1e-10
    lie = summaries["broken"]
    assert lie.claimed == 200
    assert lie.closed_form_distances == pytest.approx([1e-3] * len(lie.closed_form_distances), rel=0.5)
    assert (lie.judged.ticks, lie.judged.proven, lie.judged.refuted, lie.judged.undecided) == (200, 0, 200, 0)
    assert lie.judged.bound is not None
    assert lie.judged.bound.value == pytest.approx(1e-3, rel=0.5)
    assert lie.judged.bound.unit == "rad/s"
    assert "200 ticks refuted, 200 of them claimed, first at 0 s" in lie.judged.sentences(200)[1]
    assert lie.causes["accuracy"] == 200


@pytest.mark.slow
def test_why_it_is_not_the_closed_form_is_counted_by_cause() -> None:
    """Limits where they bind, damping where there is any, nothing for the closed form itself; as a table."""
    held = scenario(JointVelocityLimit(velocity=0.8))
    comparison = compared(held, *map(resolver, ["pinv", "dls", "hqp/daqp", "active-set"]))
    summaries = comparison.summaries
    assert summaries["pinv"].causes == {}
    assert summaries["dls"].causes == {"damping": 200}
    for name in ("hqp/daqp", "active-set"):
        assert set(summaries[name].causes) == {"limit"}
        assert summaries[name].causes["limit"] == 200 - len(summaries[name].closed_form_distances) > 0
        assert summaries[name].judged.proven == summaries[name].judged.ticks == 200
    console = Console(width=120, record=True, file=StringIO())
    show(summaries.values(), console, comparison.baseline)
    text = console.export_text()
    assert "differs from the closed form by" in text
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.slow
def test_one_that_fails_does_not_stop_the_others() -> None:
    """It ends with its reason in the summary; alone, its error is raised."""
    summaries = compared(scenario(), Broken(), resolver("active-set")).summaries
    assert "broken at t = " in summaries["broken"].stopped
    assert summaries["broken"].ticks < summaries["active-set"].ticks == 200
    with pytest.raises(NotSolved):
        compared(scenario(), Broken())


@pytest.mark.slow
def test_the_table_fits_120_columns_and_names_what_bound() -> None:
    """Every resolver has its row, no cell is cut off, and the limits that held it are named."""
    names = ["pinv", "wqp/proxqp", "hqp/clarabel", "active-set"]
    comparison = compared(scenario(JointPositionLimit(), JointVelocityLimit()), *map(resolver, names))
    console = Console(width=120, record=True, file=StringIO())
    show(comparison.summaries.values(), console, comparison.baseline, "title")
    text = console.export_text()
    assert all(name in text for name in names)
    assert "…" not in text
    assert "joint_velocity/joint1 upper" in text
    assert max(map(len, text.splitlines())) <= 120


def test_how_times_were_measured_is_said() -> None:
    """The shifted geometric mean of the times, warm starts, the machine and the versions stand below."""
    comparison = compared(scenario(duration=0.02), resolver("pinv"))
    summary = comparison.summaries["pinv"]
    summary.seconds[:] = [90e-6, 390e-6] * 10
    console = Console(width=200, record=True, file=StringIO())
    show([summary], console, comparison.baseline, "title")
    text = console.export_text()
    assert "shifted geometric mean (shift 10 µs): pinv 190.0 µs" in text  # √(100 · 400) − 10
    assert "(warm)" in text
    assert "cores" in text
    assert re.search(r"versions: Python 3\.\d+\.\d+, .*numpy \d", text)


@pytest.mark.slow
def test_the_least_distance_stands_in_the_table_where_something_keeps_one() -> None:
    """By limit, over all ticks; a table too wide for the terminal is turned."""
    ball = Sphere((1.2, 0.75, 0.0), 0.1)
    near = compared(
        scenario(ObstacleLimit(ball, influence=0.3), SelfCollisionLimit()),
        resolver("active-set"),
        resolver("pinv"),
    )
    for summary in near.summaries.values():
        assert list(summary.least_distance) == ["obstacle", "self_collision"]
    own = [step.distances["obstacle"].distance.min() for step in run(near.scenario, resolver("pinv"))]
    assert near.summaries["pinv"].least_distance["obstacle"] == pytest.approx(min(own), abs=1e-12)
    words = shown(near, 120)
    assert "least distance, obstacle [m]" in words
    assert f"{min(own):.3g}" in words
    assert "…" not in words.replace("…", "")
    assert "least" not in shown(compared(scenario(), resolver("active-set")), 120)


def shown(comparison: Comparison, width: int) -> str:
    out = StringIO()
    show(comparison.summaries.values(), Console(file=out, width=width), comparison.baseline)
    return out.getvalue()
