"""How far a run is from its limits: zero inside, exact outside."""

from dataclasses import replace

import numpy as np
import pytest

from taskopt.kinematics.limit import JointAccelerationLimit, JointVelocityLimit
from taskopt.kinematics.stack import Stack
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.violation import LimitGauge


def test_the_limits_in_force_are_those_of_the_stack(info):
    """0.9 rad/s was declared; two velocity limits give the tighter one."""
    np.testing.assert_array_equal(LimitGauge(info).velocity_box, [[-0.9] * 3, [0.9] * 3])
    stack = info.scenario.stack
    both = [*stack.limits, JointVelocityLimit(velocity={"joint2": 0.5}), JointVelocityLimit(velocity=2.0)]
    tighter = replace(info.scenario, stack=Stack(stack.levels, both))
    box = LimitGauge(RunInfo(tighter, info.resolvers)).velocity_box
    np.testing.assert_array_equal(box[1], [0.9, 0.5, 0.9])


def test_a_limit_on_accelerations_holds_positions_and_velocities_too(info, steps):
    """Where it stands alone, what leaves the range or is too fast is measured, too."""
    stack = Stack(info.scenario.stack.levels, [JointAccelerationLimit(5.0, velocity=0.9)])
    gauge = LimitGauge(RunInfo(replace(info.scenario, stack=stack), info.resolvers))
    np.testing.assert_array_equal(gauge.velocity_box, [[-0.9] * 3, [0.9] * 3])
    assert gauge.keeps_positions
    fast = replace(steps["pinv"][0], v=np.array([1.0, -0.3, 0.9]))
    assert gauge.velocity_violation(Batch((fast,)))[0] == pytest.approx(0.1)
    both = Stack(stack.levels, [*stack.limits, JointVelocityLimit(velocity={"joint2": 0.5})])
    tighter = LimitGauge(RunInfo(replace(info.scenario, stack=both), info.resolvers))
    np.testing.assert_array_equal(tighter.velocity_box[1], [0.9, 0.5, 0.9])


def test_no_velocity_limit_is_no_plot_and_no_violation(info, steps):
    """Without a declared limit nothing is exceeded, and no joint is normalised."""
    free = replace(info.scenario, stack=Stack(info.scenario.stack.levels))
    gauge = LimitGauge(RunInfo(free, info.resolvers))
    assert not gauge.bounded.any()
    assert not gauge.keeps_positions
    assert gauge.velocity_violation(Batch(tuple(steps["pinv"]))).max() == 0.0


def test_violations_are_measured_after_the_step(info, steps):
    """q_next beyond ±3 rad by 0.25, v beyond 0.9 rad/s by 0.1: those are the figures."""
    step = steps["pinv"][0]
    out = replace(step, q_next=np.array([0.0, -3.25, 3.1]), v=np.array([1.0, -0.3, 0.9]))
    batch = Batch((out,))
    gauge = LimitGauge(info)
    assert gauge.position_violation(batch)[0] == pytest.approx(0.25)
    assert gauge.velocity_violation(batch)[0] == pytest.approx(0.1)
    np.testing.assert_allclose(gauge.position_share(batch.q_next), [[0.0, -3.25 / 3, 3.1 / 3]])
