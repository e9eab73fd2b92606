"""Loops of joints in a stack: they stay closed, and the joints move as the loop says."""

import numpy as np
import pytest

from taskopt import (
    Configuration,
    Controller,
    Function,
    InvalidValue,
    JointTask,
    LoopTask,
    PositionTask,
    Stack,
    UnknownName,
    four_bar,
    parallelogram_arm,
)
from taskopt.testing import check_task

LOOP = LoopTask("loop_a", "loop_b", axes="xy")


@pytest.mark.parametrize("axes", ["xy", "xyz", "xyzrpy"])
def test_the_rows_keep_the_contract(axes: str) -> None:
    """A is the derivative of the gap, units and names fit."""
    check_task(LoopTask("loop_a", "loop_b", axes=axes), parallelogram_arm(), count=4)


@pytest.mark.slow
@pytest.mark.equation("3.118")
@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp"])
def test_a_parallelogram_follows_its_tip(resolver: str) -> None:
    """The tip draws a circle, the loop stays closed to 1e-6 m, and ϑ̇₂' = ϑ̇₁'' − ϑ̇₁' at each tick."""
    arm, dt = parallelogram_arm(), 1e-3
    q = arm.posture("closed").copy()
    centre = Configuration(arm, q).pose("tip")[:3, 3]
    circle = Function(
        lambda t: centre + 0.05 * np.array([np.cos(3.0 * t) - 1.0, np.sin(3.0 * t), 0.0]),
        derivative=lambda t: 0.15 * np.array([-np.sin(3.0 * t), np.cos(3.0 * t), 0.0]),
    )
    control = Controller(
        arm, Stack([[LOOP], [PositionTask("tip", target=circle, axes="xy", gain=50.0)]]), resolver, dt
    )
    for tick in range(500):
        v = control.step(q, tick * dt).v
        assert v[1] == pytest.approx(v[3] - v[0], abs=1e-4)
        q = arm.integrate(q, v, dt)
    at = Configuration(arm, q)
    np.testing.assert_allclose(at.pose("loop_a")[:2, 3], at.pose("loop_b")[:2, 3], atol=1e-6)
    np.testing.assert_allclose(at.pose("tip")[:3, 3], circle.value(0.5), atol=1e-4)


@pytest.mark.slow
@pytest.mark.equation("3.117", "3.118")
def test_a_four_bar_turns_as_its_loop_says() -> None:
    """The crank goes round once; coupler and rocker follow the two circles that meet, to 1e-5 rad."""
    linkage, dt, speed = four_bar((0.2, 0.5, 0.45, 0.55)), 2e-3, np.pi
    q = linkage.posture("closed").copy()
    turn = Function(lambda t: {"joint1": 1.0 + speed * t}, derivative=lambda t: {"joint1": speed})
    stack = Stack(
        [
            [LoopTask("loop_a", "loop_b", axes="xy", gain=50.0)],
            [JointTask(turn, joints=("joint1",), gain=50.0)],
        ]
    )
    control = Controller(linkage, stack, "active-set", dt)
    for tick in range(1000):
        q = linkage.integrate(q, control.step(q, tick * dt).v, dt)
        crank = 0.2 * np.exp(1j * q[0])
        gap = 0.55 - crank
        turned = np.angle(gap) + np.arccos((0.5**2 + abs(gap) ** 2 - 0.45**2) / (2.0 * 0.5 * abs(gap)))
        rocker = np.angle(crank + 0.5 * np.exp(1j * turned) - 0.55)
        np.testing.assert_allclose(np.exp(1j * (q[0] + q[1])), np.exp(1j * turned), atol=1e-3)
        np.testing.assert_allclose(np.exp(1j * q[2]), np.exp(1j * rocker), atol=1e-3)
    assert q[0] == pytest.approx(1.0 + 2.0 * np.pi, abs=1e-6)


def test_links_that_do_not_close_are_refused() -> None:
    """A rocker that is too short to meet the coupler."""
    with pytest.raises(InvalidValue, match="do not close with the crank at 1 rad"):
        four_bar((0.2, 0.1, 0.1, 0.9))


def test_an_open_loop_closes() -> None:
    """A gap of a few centimetres shrinks by 1 − K Δt a tick."""
    arm, dt = parallelogram_arm(), 1e-3
    q = arm.posture("closed") + [0.05, -0.04, 0.03, 0.02]
    control = Controller(arm, Stack([[LOOP], [JointTask()]]), "active-set", dt)
    gaps = []
    for tick in range(200):
        at = Configuration(arm, q)
        gaps.append(float(np.linalg.norm((at.pose("loop_a") - at.pose("loop_b"))[:2, 3])))
        q = arm.integrate(q, control.step(q, tick * dt).v, dt)
    np.testing.assert_allclose(np.array(gaps[1:]) / gaps[:-1], 0.99, atol=1e-4)


def test_what_is_no_loop_is_refused() -> None:
    """One frame twice, a frame that is not there, no axes."""
    with pytest.raises(InvalidValue, match="two frames that meet, got 'tip' twice"):
        LoopTask("tip", "tip")
    with pytest.raises(UnknownName, match="loop_c"):
        LoopTask("loop_a", "loop_c").bind(parallelogram_arm(), "loop")
    with pytest.raises(InvalidValue, match="axes"):
        LoopTask("loop_a", "loop_b", axes="")
