"""Parameters that change while the stack runs: the outcome is the declaration with that value."""

import pickle
from copy import deepcopy
from functools import partial

import numpy as np
import pytest

from taskopt import (
    AxisAlignmentTask,
    Configuration,
    DampedTask,
    FrameDistanceLimit,
    InvalidValue,
    JointCouplingTask,
    JointTask,
    JointVelocityTask,
    KineticEnergyTask,
    LinearHolonomicTask,
    LowAccelerationTask,
    PositionTask,
    RelativeFrameTask,
    Stack,
    SupportPolygonLimit,
)
from tests.helpers.robots import generic_q, robot

GOAL = (0.4, 0.1, 0.5)
PLAN = {
    "coupling": (
        lambda **k: JointCouplingTask({"panda_joint2": 1.0, "panda_joint4": 1.0}, **k),
        {"offset": 0.3, "gain": 4.0, "weight": 2.0},
    ),
    "linear": (lambda **k: LinearHolonomicTask(np.eye(7)[:2], **k), {"b": [0.1, 0.2], "gain": [1.0, 3.0]}),
    "axis": (
        lambda **k: AxisAlignmentTask("panda_hand", **k),
        {"direction": (0.0, 0.6, 0.8), "gain": 3.0, "weight": (1.0, 2.0)},
    ),
    "velocity": (
        lambda target=0.1, **k: JointVelocityTask(np.full(7, target), **k),
        {"target": 0.4, "weight": 3.0},
    ),
    "damped": (
        lambda factor=0.5, **k: DampedTask(PositionTask("panda_hand", target=GOAL, **k), factor),
        {"factor": 2.0, "gain": 5.0, "weight": 0.2},
    ),
    "damped coupling": (
        lambda gain=1.0: DampedTask(LinearHolonomicTask(np.eye(7)[:2], gain=gain), 0.3),
        {"gain": 6.0},
    ),
}
CHANGES = [(kind, attribute) for kind, (_, values) in PLAN.items() for attribute in values]


def problem(plan, q):
    """All numbers of the hierarchy at q."""
    h = plan.at(q, 0.0)
    return [part.copy() for part in (h.A, h.lower, h.upper, h.weight, h.limits.A, h.limits.lower)]


@pytest.mark.parametrize(("kind", "attribute"), CHANGES)
def test_a_change_is_the_declaration(kind, attribute):
    """Rows, bounds and weights after `set` are those of a stack that was declared so."""
    of = robot("panda")
    q, (make, values) = generic_q(of, 0), PLAN[kind]
    value = values[attribute]
    plan = Stack([[make()], [JointTask()]]).compile(of, 1e-3)
    before = problem(plan, q)
    told = np.full(7, value) if (kind, attribute) == ("velocity", "target") else value
    plan.set({f"{plan.tasks[0].name}.{attribute}": told})
    after = problem(plan, q)
    declared = problem(Stack([[make(**{attribute: value})], [JointTask()]]).compile(of, 1e-3), q)
    assert any((a != b).any() for a, b in zip(before, after, strict=True))
    for a, b in zip(after, declared, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-14)


def test_a_gain_that_is_too_large_for_the_period_is_refused_inside_a_damped_task():
    """The task that is damped knows Δt."""
    plan = Stack([[DampedTask(PositionTask("panda_hand", name="hand"), 1.0)]]).compile(robot("panda"), 1e-2)
    with pytest.raises(InvalidValue, match="too large for dt"):
        plan.set({"hand.gain": 300.0})


def test_a_direction_that_is_blended_keeps_its_length():
    """Half way between two directions at right angles it is their bisector, of length 1."""
    of = robot("panda")
    plan = Stack([[AxisAlignmentTask("panda_hand", direction=(1.0, 0.0, 0.0), name="axis")]]).compile(
        of, 1e-3
    )
    q = of.posture("default")
    plan.at(q, 0.0)
    plan.set({"axis.direction": (0.0, 1.0, 0.0)}, over=1.0)
    plan.at(q, 0.0)
    half = plan.at(q, 0.5).A.copy()
    bisector = AxisAlignmentTask("panda_hand", direction=(1.0, 1.0, 0.0))
    np.testing.assert_allclose(half, Stack([[bisector]]).compile(of, 1e-3).at(q, 0.0).A, atol=1e-12)


def test_velocities_that_are_set_replace_a_function_of_time():
    """From then on they are the target."""
    of = robot("panda")
    plan = Stack([[JointVelocityTask(lambda t: np.full(7, t), name="go")]]).compile(of, 1e-3)
    q = of.posture("default")
    np.testing.assert_array_equal(plan.at(q, 0.5).lower, 0.5)
    plan.set({"go.target": np.full(7, 0.2)})
    np.testing.assert_array_equal(plan.at(q, 0.6).lower, 0.2)
    assert "low acceleration.gain" not in Stack([[LowAccelerationTask()]]).compile(of, 1e-3).changes.read()


@pytest.mark.parametrize("kind", ["distance", "support"])
def test_gain_and_period_of_a_limit_may_change(kind):
    """Rows and shares after a change are those of the limit that was bound so."""
    of = robot("panda")
    at = Configuration(of, of.posture("default"))
    d = float(np.linalg.norm(at.pose("panda_hand")[:3, 3]))
    corners = at.centre_of_mass()[0][:2] + 0.03 * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])

    def limit(gain):
        if kind == "support":
            return SupportPolygonLimit(corners, gain=gain, name="keep")
        return FrameDistanceLimit("panda_hand", "panda_link0", d - 0.02, d + 0.01, gain=gain, name="keep")

    plan = Stack([[JointTask()]], [limit(0.1)]).compile(of, 1e-3)
    plan.set({"keep.gain": 0.4})
    plan.retime(2e-2)
    other = Stack([[JointTask()]], [limit(0.4)]).compile(of, 2e-2)
    for a, b in zip(problem(plan, at.q), problem(other, at.q), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)
    np.testing.assert_allclose(plan.limits[0].share, other.limits[0].share, rtol=1e-12)


@pytest.mark.parametrize("copied", [deepcopy, lambda plan: pickle.loads(pickle.dumps(plan))])
def test_a_copy_of_a_plan_goes_on_as_the_plan_does(copied):
    """After changes and a tick all numbers at the next posture are the same; the last velocity is known."""
    of = robot("panda")
    axis = AxisAlignmentTask("panda_hand", direction=(1.0, 1.0, 1.0))
    damped = DampedTask(PositionTask("panda_hand", target=GOAL, name="hand"), 0.5)
    corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
    stack = Stack(
        [
            [RelativeFrameTask("panda_hand", root="panda_link3"), axis, damped],
            [JointCouplingTask({"panda_joint2": 1.0, "panda_joint4": 1.0}), LowAccelerationTask()],
            [JointVelocityTask(partial(np.full, 7), name="go"), KineticEnergyTask()],
        ],
        [SupportPolygonLimit(corners), FrameDistanceLimit("panda_hand", "panda_link0", 0.1)],
    )
    for changes in (
        {},
        {"hand.weight": 0.3, "hand.axes": ("x",), "hand.factor": 2.0, "hand.target": np.ones(3)},
        {"go.target": np.arange(7.0), "joint coupling.offset": 0.2, "support_polygon.gain": 0.3},
    ):
        plan = stack.compile(of, 1e-3)
        plan.at(of.posture("default"), 0.0)
        plan.set(changes)
        plan.at(of.posture("default"), 0.0)
        plan.moved(np.arange(7.0))
        other = copied(plan)
        for a, b in zip(problem(plan, generic_q(of, 1)), problem(other, generic_q(of, 1)), strict=True):
            np.testing.assert_array_equal(a, b)
