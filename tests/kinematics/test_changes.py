"""Parameters that change while a stack runs: the next tick is that of a stack declared with the values."""

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskopt import (
    Circle,
    Configuration,
    Controller,
    DampingTask,
    FrameTask,
    GradientTask,
    InvalidValue,
    JointAccelerationLimit,
    JointPositionLimit,
    JointRange,
    JointTask,
    JointVelocityLimit,
    Latest,
    Limit,
    Line,
    ObstacleLimit,
    PositionTask,
    SelfCollisionLimit,
    Sphere,
    Stack,
    UnknownName,
)
from taskopt.arrays import Array
from taskopt.kinematics.limit import BoundLimit
from taskopt.kinematics.redirection import Blend
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import PoseSpace
from tests.helpers.robots import FRAMES, generic_q, robot

DT = 1e-2


def goal(at: Configuration, frame: str) -> Array:
    """A pose 5 cm beside that of a frame."""
    pose = at.pose(frame)
    pose[:3, 3] += [0.03, 0.04, 0.0]
    return pose


def hand(name: str, **changed: object) -> FrameTask:
    """The task of the hand, with a weight and a target far from the present pose."""
    at = Configuration(robot(name), generic_q(robot(name), 3))
    declared = {"target": goal(at, FRAMES[name]), "gain": 2.0, "name": "hand"}
    axes = {"axes": "xy"} if name == "planar" else {}
    return FrameTask(FRAMES[name], **(axes | declared | changed))


def rest(name: str) -> JointTask:
    """The task of the joints, with a target far from the present posture."""
    return JointTask(generic_q(robot(name), 12), name="rest", gain=1.5)


SLOW = DampingTask(0.5, name="slow")  # without it a floating base lets hand and rest have both what they want
PAIR = (("hand", "weight", 0.1), ("hand", "gain", 4.0), ("rest", "gain", 0.3), ("rest", "weight", 3.0))


def velocity(stack: Stack, name: str, resolver: str = "active-set") -> Array:
    """The velocity of the first tick of a stack that is declared and compiled as it stands."""
    q = generic_q(robot(name), 7)
    control = Controller(robot(name), stack, resolver, dt=DT)
    control.start(q)
    return control.step(q, 0.0).v


def changed_velocity(
    stack: Stack, name: str, changes: dict[str, object], resolver: str = "active-set"
) -> Array:
    """The velocity of a tick after a change, in a loop that has run for two ticks without it."""
    q = generic_q(robot(name), 7)
    control = Controller(robot(name), stack, resolver, dt=DT)
    control.start(q)
    before = [control.step(q, 0.0), control.step(q, 0.0)][1].v.copy()
    control.set(changes)
    after = control.step(q, 0.0).v
    assert np.abs(after - before).max() > 1e-6, "the change must change something, or the test says nothing"
    return after


@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp", "pinv"])
@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.parametrize(("task", "attribute", "value"), PAIR)
def test_a_change_of_a_task_is_the_declaration(
    name: str, task: str, attribute: str, value: float, resolver: str
) -> None:
    """Weight or gain set at run time gives the velocity of a stack declared with it, in one level."""
    tasks = {"hand": hand(name), "rest": rest(name)}
    stack = Stack([[*tasks.values(), SLOW]])
    declared = Stack([[*(tasks | {task: replace(tasks[task], **{attribute: value})}).values(), SLOW]])
    found = changed_velocity(stack, name, {f"{task}.{attribute}": value}, resolver)
    np.testing.assert_allclose(found, velocity(declared, name, resolver), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", FRAMES)
def test_a_new_target_is_held(name: str) -> None:
    """A pose set at run time gives the velocity of a task declared with it; so does a posture."""
    at = Configuration(robot(name), generic_q(robot(name), 11))
    new = goal(at, FRAMES[name])
    stack = Stack([[hand(name)], [rest(name)]])
    declared = Stack([[hand(name, target=new)], [rest(name)]])
    found = changed_velocity(stack, name, {"hand.target": new})
    np.testing.assert_allclose(found, velocity(declared, name), rtol=1e-9, atol=1e-9)
    posture = generic_q(robot(name), 13)
    declared = Stack([[hand(name)], [replace(rest(name), target=posture)]])
    found = changed_velocity(stack, name, {"rest.target": posture})
    np.testing.assert_allclose(found, velocity(declared, name), rtol=1e-9, atol=1e-9)


def test_a_target_that_moves_begins_at_the_change() -> None:
    """A circle set at t = 1 s asks at once for its speed 2πr/T along its first direction."""
    q = generic_q(robot("panda"), 7)
    control = Controller(robot("panda"), Stack([[PositionTask("panda_hand", name="hand")]]), dt=DT)
    control.start(q)
    assert np.abs(control.step(q, 0.0).v).max() < 1e-12
    control.set({"hand.target": Circle(radius=0.1, period=4.0)})
    v = control.step(q, 1.0).v
    speed = Configuration(robot("panda"), q).jacobian("panda_hand")[:3] @ v
    np.testing.assert_allclose(speed, [0.0, 2.0 * np.pi * 0.1 / 4.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp", "pinv"])
def test_rows_that_are_out_are_as_good_as_not_declared(resolver: str) -> None:
    """Axes, weights of zero, a task and a level that are out give the velocity of the stack without them."""
    full, name = Stack([[hand("panda")], [rest("panda")]]), "panda"
    cases = {
        "hand.axes": ("xyz", Stack([[hand("panda", axes="xyz")], [rest("panda")]])),
        "hand.weight": (
            [1.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            Stack([[hand("panda", axes="xy y")], [rest("panda")]]),
        ),
        "hand.enabled": (False, Stack([[rest("panda")]])),
        "level 1.enabled": (False, Stack([[rest("panda")]])),
        "rest.enabled": (False, Stack([[hand("panda")]])),
    }
    for address, (value, declared) in cases.items():
        found = changed_velocity(full, name, {address: value}, resolver)
        np.testing.assert_allclose(found, velocity(declared, name, resolver), atol=1e-9, err_msg=address)


@pytest.mark.parametrize("what", [DampingTask(name="slow"), GradientTask(JointRange(), name="slow")])
def test_a_task_comes_back_as_it_was(what: DampingTask | GradientTask) -> None:
    """Out and in again gives the first velocity bit by bit, also where the rows are written once only."""
    q = generic_q(robot("panda"), 7)
    control = Controller(robot("panda"), Stack([[hand("panda"), what]]), dt=DT)
    control.start(q)
    first = control.step(q, 0.0).v.copy()
    control.set({"slow.enabled": False})
    assert np.abs(control.step(q, 0.0).v - first).max() > 1e-4
    control.set({"slow.enabled": True})
    control.step(q, 0.0)
    np.testing.assert_array_equal(control.step(q, 0.0).v, first)
    control.step(q, 0.0)
    assert not control.plan.altered


BALL = Sphere(goal(Configuration(robot("panda"), generic_q(robot("panda"), 7)), "panda_hand")[:3, 3], 0.02)
TOUCHING = [("panda_hand", "panda_link5")]
LIMITS = (
    (
        "obstacle.margin",
        ObstacleLimit(BALL, margin=0.001),
        ObstacleLimit(BALL, margin=0.01, influence=0.109),
        0.01,
    ),
    ("obstacle.gain", ObstacleLimit(BALL), ObstacleLimit(BALL, gain=0.01), 0.01),
    (
        "self_collision.margin",
        SelfCollisionLimit(pairs=TOUCHING, influence=0.4),
        SelfCollisionLimit(pairs=TOUCHING, margin=0.2, influence=0.59),
        0.2,
    ),
    ("joint_position.margin", JointPositionLimit(0.02), JointPositionLimit(0.02, margin=1.4), 1.4),
    ("joint_position.gain", JointPositionLimit(), JointPositionLimit(gain=0.01), 0.01),
    ("joint_velocity.scale", JointVelocityLimit(), JointVelocityLimit(scale=0.05), 0.05),
    ("joint_acceleration.acceleration", JointAccelerationLimit(50.0), JointAccelerationLimit(3.0), 3.0),
    (
        "joint_acceleration.velocity",
        JointAccelerationLimit(90.0),
        JointAccelerationLimit(90.0, velocity=0.1),
        0.1,
    ),
)


@pytest.mark.parametrize(("address", "before", "after", "value"), LIMITS)
def test_a_change_of_a_limit_is_the_declaration(
    address: str, before: Limit, after: Limit, value: float
) -> None:
    """A limit that is tightened at run time bounds as one declared so."""
    fast = hand("panda", gain=60.0)
    q = generic_q(robot("panda"), 7)
    controls = [
        Controller(robot("panda"), Stack([[fast], [rest("panda")]], [limit]), dt=DT)
        for limit in (before, after)
    ]
    for control in controls:
        control.start(q)
    controls[0].set({address: value})
    found, declared = (control.step(q, 0.0) for control in controls)
    np.testing.assert_allclose(found.v, declared.v, rtol=1e-9, atol=1e-9)
    untouched = Controller(robot("panda"), Stack([[fast], [rest("panda")]], [before]), dt=DT)
    assert np.abs(untouched.step(q, 0.0).v - found.v).max() > 1e-3


@pytest.mark.parametrize(
    "limit", [found[1] for found in LIMITS[::2]] + [ObstacleLimit(Sphere([0.5, 0.1, 0.4], 0.2))]
)
def test_another_period_is_the_declaration(limit: Limit) -> None:
    """A step with another dt bounds as a loop compiled with it, and so do the steps after it."""
    q, other = generic_q(robot("panda"), 7), 3e-3
    stack = Stack([[hand("panda", gain=80.0)], [rest("panda")]], [limit])
    changed, declared = Controller(robot("panda"), stack, dt=DT), Controller(robot("panda"), stack, dt=other)
    changed.start(q)
    declared.start(q)
    for _ in range(2):
        found, right = changed.step(q, 0.0, dt=other), declared.step(q, 0.0)
        np.testing.assert_allclose(found.v, right.v, rtol=1e-7, atol=1e-9)


class Fixed(Limit):
    """A limit from outside that does not know another Δt."""

    name = "fixed"

    def bind(self, robot: Robot, dt: float) -> BoundLimit:
        """Return bounds that change with the posture."""

        class Bound(BoundLimit):
            def narrow(self, configuration: Configuration, bounds: Array, owner: int) -> None:
                pass

        return Bound(self.name)


def test_what_cannot_change_is_refused_by_name() -> None:
    """Unknown addresses, wrong values, a limit without `retime`: one clear error, and nothing has changed."""
    q = generic_q(robot("panda"), 7)
    control = Controller(robot("panda"), Stack([[hand("panda")], [rest("panda")]], [Fixed()]), dt=DT)
    first = control.step(q, 0.0).v.copy()
    wrong: list[tuple[dict[str, object], str]] = [
        ({"rest.weight": 2.0, "hand.weigth": 1.0}, "did you mean hand.weight"),
        ({"rest.weight": 2.0, "hand.weight": -1.0}, "weight of 'hand' must be ≥ 0"),
        ({"hand.weight": [1.0, 2.0, 3.0]}, "weight of 'hand'"),
        ({"hand.weight": float("nan")}, "weight of 'hand'"),
        ({"hand.gain": 2.0 / DT}, "too large for dt"),
        ({"hand.axes": "xq"}, "axes"),
        ({"rest.axes": ["elbow"]}, "panda_joint1"),
        ({"hand.enabled": 2}, "True or False"),
        ({"hand.target": "there"}, "target of 'hand'"),
    ]
    for changes, message in wrong:
        with pytest.raises((InvalidValue, UnknownName), match=message):
            control.set(changes)
    with pytest.raises(InvalidValue, match="over"):
        control.set({"hand.weight": 1.0}, over=-1.0)
    with pytest.raises(InvalidValue, match="time of its own"):
        control.set({"hand.target": Circle(radius=0.1, period=4.0)}, over=1.0)
    with pytest.raises(InvalidValue, match="'fixed' cannot take another Δt: Bound lacks retime"):
        control.step(q, 0.0, dt=1e-3)
    np.testing.assert_array_equal(control.step(q, 0.0).v, first)


def largest_jump(change: Callable[[Controller], None]) -> float:
    """The largest change of a velocity from tick to tick in 1 s, with a change after 0.1 s."""
    arm, q, h = robot("panda"), generic_q(robot("panda"), 7), 2e-3
    control = Controller(arm, Stack([[hand("panda")], [rest("panda")]], [JointVelocityLimit()]), dt=h)
    path = []
    for i in range(500):
        if i == 50:
            change(control)
        path.append(control.step(q, i * h).v.copy())
        q = arm.integrate(q, path[-1], h)
    return float(np.abs(np.diff(path, axis=0)).max())


@pytest.mark.parametrize(
    "changes",
    [
        {"hand.enabled": False},
        {"hand.axes": "xyz"},
        {"hand.weight": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]},
        {"hand.gain": 20.0},
        {"hand.target": goal(Configuration(robot("panda"), generic_q(robot("panda"), 5)), "panda_hand")},
        {"joint_velocity.scale": 0.05},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_a_blended_change_does_not_jump(changes: dict[str, object]) -> None:
    """Over half a second the largest change from tick to tick is a fraction of that of a switch."""
    at_once = largest_jump(lambda control: control.set(changes))
    blended = largest_jump(lambda control: control.set(changes, over=0.5))
    nothing = largest_jump(lambda control: None)
    assert nothing < blended < 0.5 * at_once


@pytest.mark.parametrize(
    ("changes", "levels"),
    [
        ({"hand.enabled": False}, [[rest("panda")]]),
        ({"hand.axes": "xyz"}, [[hand("panda", axes="xyz")], [rest("panda")]]),
        ({"hand.weight": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}, [[hand("panda", axes="xyz")], [rest("panda")]]),
        ({"level 2.enabled": False}, [[hand("panda")]]),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_after_the_blend_rows_are_out(changes: dict[str, object], levels: list) -> None:
    """Then the velocity is that of the stack without the rows; back again, it is that with them."""
    q = generic_q(robot("panda"), 7)
    control = Controller(robot("panda"), Stack([[hand("panda")], [rest("panda")]]), dt=DT)
    first = control.step(q, 0.0).v.copy()
    control.set(changes, over=0.1)
    path = [control.step(q, 0.01 * i).v.copy() for i in range(1, 20)]
    without = Controller(robot("panda"), Stack(levels), dt=DT).step(q, 0.0).v
    assert np.abs(first - without).max() > 0.01
    np.testing.assert_allclose(path[-1], without, atol=1e-9)
    assert np.abs(path[8] - first).max() > 1e-6
    back = {name: [1.0] * 6 if name == "hand.weight" else True for name in changes}
    control.set({"hand.axes": "xyzrpy"} if "hand.axes" in changes else back, over=0.1)
    path = [control.step(q, 0.2 + 0.01 * i).v.copy() for i in range(20)]
    np.testing.assert_allclose(path[-1], first, atol=1e-9)
    assert not control.plan.altered


def test_weights_are_blended_by_equal_ratios_and_gains_by_equal_steps() -> None:
    """Half-way between 1 and 0.01 a weight is 0.1; half-way between 1 and 3 a gain is 2; then they stay."""
    q = generic_q(robot("panda"), 7)
    control = Controller(robot("panda"), Stack([[hand("panda", gain=1.0)], [rest("panda")]]), dt=DT)
    control.step(q, 0.0)
    control.set({"hand.weight": 0.01, "hand.gain": 3.0}, over=2.0)
    for t, weight, gain in ((1.0, 1.0, 1.0), (2.0, 0.1, 2.0), (3.0, 0.01, 3.0), (4.0, 0.01, 3.0)):
        control.step(q, t)
        now = control.parameters
        assert now["hand.weight"] == pytest.approx(weight, rel=1e-12)
        assert now["hand.gain"] == pytest.approx(gain, rel=1e-12)
    assert not control.plan.changes.waiting


def test_a_change_on_its_way_can_be_turned_back() -> None:
    """A task that is called back half-way out is in force again after half of the time, without a jump."""
    arm, q = robot("panda"), generic_q(robot("panda"), 7)
    control = Controller(arm, Stack([[hand("panda")], [rest("panda")]]), dt=DT)
    control.step(q, 0.0)
    control.set({"hand.enabled": False}, over=1.0)
    control.step(q, 1.0)
    gate = control.plan._gates["hand"]
    assert gate.openness(1.5) == pytest.approx(np.full(6, 0.5))
    control.set({"hand.enabled": True}, over=1.0)
    control.step(q, 1.5)
    assert gate.openness(1.5) == pytest.approx(np.full(6, 0.5))
    assert gate.openness(1.75) == pytest.approx(np.full(6, 0.25))
    control.step(q, 2.0)
    control.step(q, 2.01)
    assert not control.plan.altered


def test_changes_that_are_set_together_are_applied_together() -> None:
    """While another thread sets gain and target in pairs, no tick sees one of a pair without the other."""
    q, arm = generic_q(robot("panda"), 7), robot("panda")
    control = Controller(arm, Stack([[hand("panda")], [rest("panda")]]), dt=DT)
    pairs = [{"hand.gain": 1.0, "rest.gain": 3.0}, {"hand.gain": 4.0, "rest.gain": 12.0}]
    control.set(pairs[0])
    control.step(q, 0.0)
    stop, seen = threading.Event(), set()

    def other() -> None:
        k = 0
        while not stop.is_set():
            k += 1
            control.set(pairs[k % 2])

    thread = threading.Thread(target=other)
    thread.start()
    try:
        for i in range(400):
            control.step(q, 1e-3 * i)
            now = control.parameters
            assert now["rest.gain"] == 3.0 * now["hand.gain"]
            seen.add(now["hand.gain"])
    finally:
        stop.set()
        thread.join()
    assert seen == {1.0, 4.0}


def test_nothing_is_compiled_and_the_next_tick_starts_warm() -> None:
    """A change keeps the working set: with limits that bind, the tick after it needs no second search."""
    q, arm = generic_q(robot("panda"), 7), robot("panda")
    control = Controller(
        arm,
        Stack([[hand("panda", gain=60.0)], [rest("panda")]], [JointVelocityLimit()], damping=None),
        dt=DT,
    )
    control.start(q)
    cold = control.step(q, 0.0)
    for name, value in (("hand.gain", 60.5), ("rest.weight", 0.9), ("joint_velocity.scale", 0.99)):
        control.set({name: value})
        warm = control.step(q, 0.0)
        assert warm.kkt_met()
        assert warm.iterations < cold.iterations
        np.testing.assert_array_equal(warm.state, cold.state)


def test_a_change_that_is_no_mapping_is_told_the_way_out() -> None:
    """`set("hand.gain", 2.0)`, as many would write it first."""
    of = robot("panda")
    control = Controller(of, Stack([[JointTask(name="rest")]]))
    with pytest.raises(InvalidValue, match=r"changes must be a mapping such as .*got 'rest.gain'"):
        control.set("rest.gain", 2.0)  # type: ignore[arg-type]
    control.set({"rest.gain": 2.0})
    control.step(of.posture("default"), 0.0)
    assert control.parameters["rest.gain"] == 2.0


@pytest.mark.parametrize("moving", [{5: (0.0, 0.0, 0.0)}, {-1: (0.0, 0.0, 0.0)}, {"bal": (0.0, 0.0, 0.0)}])
def test_an_obstacle_that_is_none_does_not_move(moving: dict) -> None:
    """By number as by name."""
    with pytest.raises(UnknownName, match="no obstacle named"):
        ObstacleLimit(Sphere((1.0, 0.0, 0.0), 0.1, name="ball"), moving=moving)


def retargeted(arm: Robot, first: float, second: float, dt: float) -> np.ndarray:
    """Velocities of a still arm whose hand gets two targets, blended over 0.3 s, the second on the way."""
    q = generic_q(arm, 3)
    control = Controller(arm, Stack([[hand("panda")], [rest("panda")]]), dt=dt)
    control.start(q)
    pose = Configuration(arm, q).pose("panda_hand")
    ahead, aside = pose.copy(), pose[:, [1, 0, 2, 3]] * [1.0, -1.0, 1.0, 1.0]  # a quarter turn
    ahead[:3, 3] += [0.3, -0.2, 0.1]
    path = []
    for i in range(round(0.8 / dt)):
        if i == round(first / dt):
            control.set({"hand.target": ahead}, over=0.3)
        if i == round((first + second) / dt):
            control.set({"hand.target": aside}, over=0.3)
        path.append(control.step(q, i * dt).v.copy())
    return np.array(path)


@pytest.mark.slow
@given(first=st.floats(0.05, 0.2), second=st.floats(0.02, 0.28))
@settings(max_examples=5, deadline=None)
def test_a_new_target_during_a_blend_does_not_jump(first: float, second: float) -> None:
    """The largest change from tick to tick is proportional to the step, whenever the second target comes."""
    jumps = [
        float(np.abs(np.diff(retargeted(robot("panda"), first, second, dt), axis=0)).max())
        for dt in (4e-3, 1e-3)
    ]
    assert jumps[1] < 0.3 * jumps[0]


def test_a_blend_goes_on_from_a_target_that_was_set_with_a_velocity() -> None:
    """The rate of a `Latest` is taken over at the first tick of the blend, and the blend ends at rest."""
    of, q = robot("panda"), generic_q(robot("panda"), 3)
    pose = Configuration(of, q).pose("panda_hand")
    latest = Latest()
    stack = Stack([[FrameTask("panda_hand", target=latest, gain=2.0, name="hand")]])
    jumps = []
    for dt in (4e-3, 1e-3):
        latest.set(pose, velocity=[0.3, 0.0, -0.2])
        control = Controller(of, stack, dt=dt)
        control.start(q)
        control.step(q, 0.0)
        before = control.step(q, dt).v.copy()
        control.set({"hand.target": pose}, over=0.3)
        jumps.append(float(np.abs(control.step(q, 2.0 * dt).v - before).max()))
        assert np.abs(before).max() > 0.1
        control.step(q, 1.0)
        np.testing.assert_allclose(control.step(q, 1.1).v, 0.0, atol=1e-9)
    assert max(jumps) < 1e-6


def test_a_blend_that_begins_at_rest_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """A target that forgets the rate on the way to the first one makes the velocities jump at any step."""
    monkeypatch.setattr(Blend, "go_on", lambda self, space, start, rate, t: self.start(space, start, t))
    monkeypatch.setattr(
        Blend, "start", lambda self, space, start, t: Line(to=self._to, duration=0.3).start(space, start, t)
    )
    jumps = [
        float(np.abs(np.diff(retargeted(robot("panda"), 0.1, 0.15, dt), axis=0)).max()) for dt in (4e-3, 1e-3)
    ]
    assert jumps[1] > 0.8 * jumps[0]


@given(
    turn=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6),
    rate=st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6),
    u=st.floats(0.0, 0.99),
)
@settings(max_examples=50, deadline=None)
def test_the_rate_of_a_blend_is_the_derivative_of_its_value(turn: list, rate: list, u: float) -> None:
    """By central differences of the value; it begins with the rate that was given, and ends at the goal."""
    space, start, duration = PoseSpace("pose"), np.eye(4), 0.4
    end = np.empty((4, 4))
    space.move(start, np.array(turn), end)
    course = Blend(end, duration).go_on(space, start, np.array(rate), 1.0)
    value, given_rate, before, after = np.eye(4), np.zeros(6), np.eye(4), np.eye(4)
    course(1.0, value, given_rate)
    np.testing.assert_allclose(given_rate, rate, atol=1e-6)
    t, h = 1.0 + (0.01 + u * 0.98) * duration, 1e-4
    course(t, value, given_rate)
    course(t - h, before, np.zeros(6))
    course(t + h, after, np.zeros(6))
    course(t, value, given_rate)
    np.testing.assert_allclose(given_rate, space.difference(before, after) / (2.0 * h), atol=1e-3)
    course(1.0 + duration, value, given_rate)
    np.testing.assert_allclose(value, end, atol=1e-12)
    np.testing.assert_allclose(given_rate, 0.0, atol=1e-9)
