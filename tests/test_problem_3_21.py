"""Problem 3.21 as the text states it: the limit keeps every link out, the pseudo-inverse does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskopt import Configuration, Stack
from taskopt.loop.run import run
from taskopt.loop.scenario import load_scenario
from taskopt.resolver.registry import resolver
from tests.helpers.near import circle_clearance

LENGTHS, CENTRE, RADIUS = np.array([0.5, 0.3, 0.3]), np.array([0.3, 0.0]), 0.1
SCENARIO = load_scenario(Path(__file__).parents[1] / "tasks" / "problem_3_21.py")


def start(degrees, elbow):
    """The posture with the tip at (0.8, 0.2) for a first joint and a sign of the elbow."""
    first = np.radians(degrees)
    span = 0.8 + 0.2j - 0.5 * np.exp(1j * first)
    bend = elbow * np.arccos(abs(span) / 0.6)
    return np.array([first, np.angle(span) - bend - first, 2.0 * bend])


def outcome(scenario, name):
    """Least distance of any bare link to the circle, largest error of the tip, and where the tip ends."""
    least, error = np.inf, 0.0
    for step in run(scenario, resolver(name)):
        least = min(least, circle_clearance(LENGTHS, step.q_next, CENTRE, RADIUS).min())
        error = max(error, *(np.linalg.norm(e) for e in step.errors.values()), 0.0)
    return least, error, Configuration(scenario.robot, step.q_next).pose("tip")[:2, 3]


@pytest.mark.problem("3.21")
def test_the_scenario_is_the_problem():
    """Lengths, start of the line, duration and period are those of the text."""
    arm = SCENARIO.robot
    np.testing.assert_allclose(Configuration(arm, [0, 0, 0]).pose("tip")[:2, 3], [LENGTHS.sum(), 0.0])
    np.testing.assert_allclose(Configuration(arm, SCENARIO.start).pose("tip")[:2, 3], [0.8, 0.2], atol=1e-12)
    assert (SCENARIO.duration, SCENARIO.dt) == (2.0, 1e-3)
    assert circle_clearance(LENGTHS, SCENARIO.start, CENTRE, RADIUS).min() > 0.0


@pytest.mark.problem("3.21")
@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "elbow"), [(30, 1), (30, -1), (20, 1), (-25, -1)])
def test_with_the_limit_every_link_stays_clear_and_the_tip_tracks(degrees, elbow):
    """From far, from nearer than the margin (20°: 2.6 mm), and past the other side of the object."""
    least, error, end = outcome(replace(SCENARIO, q0=start(degrees, elbow)), "active-set")
    assert least > 0.0
    assert error < 1e-5
    np.testing.assert_allclose(end, [0.8, -0.2], atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("elbow", [1, -1])
def test_the_plain_pseudo_inverse_goes_through_the_object(elbow):
    """The same run without the limit ends up inside: what the test above would say of a collision."""
    bare = replace(SCENARIO, q0=start(30, elbow), stack=Stack(SCENARIO.stack.levels, damping=None))
    least, error, _ = outcome(bare, "pinv")
    assert least < -0.05
    assert error < 1e-5
