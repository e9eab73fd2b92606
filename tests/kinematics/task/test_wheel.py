"""Wheels: the velocity of the contact, a cart that rolls, omniwheels that slip sideways only."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Configuration,
    Controller,
    InvalidValue,
    JointVelocityTask,
    OmniwheelTask,
    Robot,
    RollingTask,
    Stack,
    UnknownName,
    resolve,
)
from taskopt.kinematics.task.wheel import Wheel
from taskopt.testing import check_task
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot

RADIUS = 0.1


def cart(angles, places):
    """A base that moves in the plane, on wheels with the given headings [rad] and places (k, 2) [m]."""
    model = pin.Model()
    base = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "base")
    model.addFrame(pin.Frame("chassis", base, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    for k, (angle, place) in enumerate(zip(angles, places, strict=True)):
        turn = pin.utils.rotate("z", angle)
        joint = model.addJoint(
            base, pin.JointModelRUBY(), pin.SE3(turn, np.append(place, RADIUS)), f"spin{k}"
        )
        model.addFrame(pin.Frame(f"wheel{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return Robot(model, name="cart")


PAIR = cart([0.0, 0.0], [(0.0, 0.2), (0.0, -0.2)])
THREE = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
OMNI = cart(THREE + np.pi / 2.0, 0.3 * np.column_stack([np.cos(THREE), np.sin(THREE)]))


@pytest.mark.slow
@pytest.mark.parametrize("name", FRAMES)
def test_wheels_keep_the_contract(name):
    """The height is a row with an error that dies out, the others ask for a velocity outright."""
    root = {"planar": "link1", "panda": "panda_link2", "tiago": "base_link", "talos_reduced": "base_link"}
    for floor in (None, root[name]):
        check_task(RollingTask(FRAMES[name], 0.2, floor, gain=3.0, weight=2.0), robot(name), count=5)
        check_task(OmniwheelTask(FRAMES[name], 0.2, floor, gain=3.0, weight=(1.0, 2.0)), robot(name), count=5)


def material_velocity(of, q, v, hub, floor, radius, h=1e-6):
    """Velocity in the floor of the point of the wheel below the hub, by differences of its place."""

    def seen(q, frame):
        return pin.SE3(Configuration(of, q).pose(frame))

    now = seen(q, floor).actInv(seen(q, hub))
    in_wheel = now.actInv(now.translation - [0.0, 0.0, radius])
    ends = [seen(of.integrate(q, v, s), floor).actInv(seen(of.integrate(q, v, s), hub)) for s in (-h, h)]
    return (ends[1].act(in_wheel) - ends[0].act(in_wheel)) / (2.0 * h)


@pytest.mark.parametrize(
    ("name", "hub", "floor"),
    [
        ("tiago", "wheel_left_link", "head_2_link"),
        ("panda", "panda_hand", "panda_link2"),
        ("talos_reduced", FRAMES["talos_reduced"], "base_link"),
    ],
)
def test_rows_are_the_velocity_of_the_wheel_where_it_touches_the_floor(name, hub, floor):
    """A v is the velocity of that point of the wheel, seen from a floor that moves itself."""
    of = robot(name)
    q = generic_q(of, 1)
    _, rows = bound(RollingTask(hub, 0.2, floor), Configuration(of, q))
    for v in np.random.default_rng(2).normal(size=(3, of.nv)):
        np.testing.assert_allclose(rows.A @ v, material_velocity(of, q, v, hub, floor, 0.2), atol=1e-7)


def test_a_contact_above_the_hub_is_caught(monkeypatch):
    """The check above fails if the contact is on the wrong side of the wheel."""
    right = Wheel.contact
    monkeypatch.setattr(Wheel, "contact", lambda w, at: right(w._replace(radius=-w.radius), at))
    with pytest.raises(AssertionError):
        test_rows_are_the_velocity_of_the_wheel_where_it_touches_the_floor(
            "tiago", "wheel_left_link", "head_2_link"
        )


@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp"])
@pytest.mark.parametrize(("left", "right"), [(1.0, 1.0), (1.0, -1.0), (0.5, 2.0)])
def test_a_cart_goes_where_its_wheels_roll(left, right, resolver):
    """Two driven wheels: forward speed ρ (ω_l + ω_r)/2, turning ρ (ω_r − ω_l)/0.4, and no slip sideways."""
    rolling = [RollingTask(f"wheel{k}", RADIUS) for k in range(2)]
    drive = JointVelocityTask({"spin0": left, "spin1": right})
    at = Configuration(PAIR, PAIR.integrate(PAIR.neutral, np.array([0.3, -0.2, 0.7, 0.4, -2.0]), 1.0))
    v = resolve(Stack([rolling, [drive]]).at(at, dt=1e-3), resolver).x
    forward, turning = RADIUS * (left + right) / 2.0, RADIUS * (right - left) / 0.4
    np.testing.assert_allclose(v, [forward, 0.0, turning, left, right], atol=1e-9)


def test_a_turn_of_the_wheels_is_a_circumference():
    """Driven for one turn, the cart has moved by 2 π ρ along its heading."""
    rolling = [RollingTask(f"wheel{k}", RADIUS) for k in range(2)]
    stack = Stack([rolling, [JointVelocityTask({"spin0": 2.0 * np.pi, "spin1": 2.0 * np.pi})]])
    q, dt = PAIR.integrate(PAIR.neutral, np.array([0.0, 0.0, 0.5, 0.0, 0.0]), 1.0), 1e-2
    start, control = Configuration(PAIR, q).pose("chassis"), Controller(PAIR, stack, dt=dt)
    for k in range(100):
        q = PAIR.integrate(q, control.step(q, k * dt).v, dt)
    moved = start[:3, :3].T @ (Configuration(PAIR, q).pose("chassis")[:3, 3] - start[:3, 3])
    np.testing.assert_allclose(moved, [2.0 * np.pi * RADIUS, 0.0, 0.0], atol=1e-9)


def test_omniwheels_let_a_base_go_sideways():
    """Three of them: each turns as fast as its rolling direction says, at any velocity of the base."""
    wheels = [OmniwheelTask(f"wheel{k}", RADIUS) for k in range(3)]
    base = np.array([0.3, -0.4, 0.5])
    whole = np.concatenate([base, np.zeros(3)])
    at = Configuration(OMNI, OMNI.integrate(OMNI.neutral, np.array([0.1, 0.2, 0.8, 1.0, 2.0, 3.0]), 1.0))
    go = JointVelocityTask(whole, joints=("base",))
    v = resolve(Stack([[go], wheels]).at(at, dt=1e-3)).x
    np.testing.assert_allclose(v[:3], base, atol=1e-9)
    for k, angle in enumerate(THREE):
        along = np.array([-np.sin(angle), np.cos(angle)])
        hub = base[:2] + base[2] * 0.3 * along
        assert v[3 + k] == pytest.approx(hub @ along / RADIUS, abs=1e-9)


def test_wheels_that_roll_cannot_go_sideways():
    """The same three wheels without rollers let the base turn about its centre, and nothing else."""
    wheels = [RollingTask(f"wheel{k}", RADIUS) for k in range(3)]
    go = JointVelocityTask(np.ones(6), joints=("base",))
    v = resolve(Stack([wheels, [go]]).at(Configuration(OMNI, OMNI.neutral), dt=1e-3)).x
    np.testing.assert_allclose(v[:3], [0.0, 0.0, 1.0], atol=1e-9)


def test_a_wheel_above_its_floor_comes_down():
    """The height is off by 5 cm and shrinks by 1 − K Δt a tick, on a floating base."""
    of, dt = robot("talos_reduced"), 1e-2
    q = of.posture("half_sitting")
    height = Configuration(of, q).pose("base_link")[2, 3]
    control = Controller(of, Stack([[RollingTask("base_link", height - 0.05, gain=10.0)]]), dt=dt)
    gaps = []
    for k in range(20):
        gaps.append(Configuration(of, q).pose("base_link")[2, 3] - (height - 0.05))
        q = of.integrate(q, control.step(q, k * dt).v, dt)
    np.testing.assert_allclose(np.array(gaps[1:]) / gaps[:-1], 0.9, atol=2e-3)


def test_a_wheel_that_lies_flat_has_no_rolling_direction():
    """Its first row is zero, as its docstring says."""
    at = Configuration(OMNI, OMNI.neutral)
    _, rows = bound(OmniwheelTask("wheel0", RADIUS, axle=(0.0, 0.0, 1.0)), at)
    assert not rows.A[0].any()


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: RollingTask("wheel0", 0.0), InvalidValue, "radius must be > 0"),
        (lambda: RollingTask("wheel0", 0.1, "wheel0"), InvalidValue, "'wheel0' twice"),
        (lambda: OmniwheelTask("wheel0", 0.1, axle=np.zeros(3)), InvalidValue, "axle must be a direction"),
        (lambda: RollingTask("wheel7", 0.1).bind(PAIR, "t"), UnknownName, "wheel7"),
        (lambda: OmniwheelTask("wheel0", 0.1, "ground").bind(PAIR, "t"), UnknownName, "ground"),
    ],
)
def test_what_makes_no_sense_is_refused(make, error, words):
    """No radius, one frame twice, no axle, frames that are not there."""
    with pytest.raises(error, match=words):
        make()
