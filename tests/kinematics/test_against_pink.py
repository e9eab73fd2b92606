"""Each task and limit of pink in a small stack of its own: our velocity is pink's, to 1e-9.

pink weighs all tasks in one program, so that ours stand in one level: cost² is the weight, α = K Δt the gain,
and its damping of 1e-12 a `DampingTask`. Where the two differ by design, a test says in what.
"""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    AxisAlignmentTask,
    BoxTask,
    CentreOfMassTask,
    Configuration,
    DampedTask,
    DampingTask,
    FloatingBaseVelocityLimit,
    FrameTask,
    JointAccelerationLimit,
    JointCouplingTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    JointVelocityTask,
    LinearHolonomicTask,
    LowAccelerationTask,
    Manipulability,
    ObjectiveTask,
    OmniwheelTask,
    RelativeFrameTask,
    RollingTask,
    Stack,
    resolve,
)
from taskopt.testing.sampling import inside
from tests.helpers.robots import FRAMES, robot

pink = pytest.importorskip(
    "pink", reason="pink is not installed; `pip install pin-pink` in an environment with taskopt and quadprog"
)
pytestmark = pytest.mark.slow
DT, GAIN = 5e-3, 0.4  # [s], α of pink; K = α/Δt
K = GAIN / DT
TALOS, PANDA = "talos_reduced", "panda"


def start(name, seed=0):
    """A generic posture inside the limits, as ours and as pink's configuration."""
    of = robot(name)
    v = 0.2 * np.random.default_rng(seed).normal(size=of.nv)
    q = inside(of, of.integrate(of.posture("middle"), v, 1.0))
    return Configuration(of, q), pink.Configuration(of.model, of.model.createData(), q)


def away(pose, seed=5):
    """A pose that is some centimetres and degrees from another."""
    return pin.SE3(pose) * pin.exp6(0.1 * np.random.default_rng(seed).normal(size=6))


def posture(at, of_pink, cost=0.1):
    """A posture in both, which makes every stack of full rank: all zero angles, moved into the limits."""
    goal = inside(at.robot, at.robot.neutral)
    theirs = pink.tasks.PostureTask(cost=cost, gain=GAIN)
    theirs.set_target(goal)
    return JointTask(goal, gain=K, weight=cost**2), theirs


def ours(at, level, limits=(), above=None, last=None):
    """Our velocity of one level, with pink's damping."""
    levels = [*([above] if above else []), [*level, DampingTask(1e-12)]]
    plan = Stack(levels, limits).compile(at.robot, DT)
    plan.start(at.q)
    if last is not None:
        plan.moved(last)
    answer = resolve(plan.at(at.q, 0.0))
    assert answer.kkt_met()
    return answer


def theirs(of_pink, tasks, limits=(), **rest):
    """pink's velocity."""
    return pink.solve_ik(of_pink, tasks, DT, solver="quadprog", limits=list(limits), **rest)


def difference(ours, theirs):
    """Largest difference of two velocities, relative to the largest of pink's and to 1 rad/s or m/s."""
    return float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max()))


def frame(at, of_pink, lm_damping=0.0):
    """The task of a hand in both."""
    name = FRAMES[at.robot.name] if at.robot.name in FRAMES else FRAMES[TALOS]
    name = name if name in at.robot.frames else FRAMES[PANDA]
    goal = away(at.pose(name))
    task = pink.tasks.FrameTask(name, 1.5, 0.7, lm_damping=lm_damping, gain=GAIN)
    task.set_target(goal)
    return FrameTask(name, target=goal, gain=K, weight=(1.5**2, 0.7**2)), task


def relative(at, of_pink):
    """The pose of one hand relative to the other, or to a link before it."""
    first, second = (
        (FRAMES[PANDA], "panda_link3")
        if FRAMES[PANDA] in at.robot.frames
        else (FRAMES[TALOS], "gripper_right_base_link")
    )
    goal = away((pin.SE3(at.pose(second)).inverse() * pin.SE3(at.pose(first))).homogeneous)
    task = pink.tasks.RelativeFrameTask(first, second, 1.5, 0.7, gain=GAIN)
    task.set_target(goal)
    return RelativeFrameTask(first, root=second, target=goal, gain=K, weight=(1.5**2, 0.7**2)), task


def centre_of_mass(at, of_pink):
    """The centre of mass."""
    goal = at.centre_of_mass()[0] + [0.02, -0.03, 0.01]
    task = pink.tasks.ComTask(2.0, gain=GAIN)
    task.set_target(goal)
    return CentreOfMassTask(goal, gain=K, weight=4.0), task


def coupling(at, of_pink):
    """Two joints whose angles add up to zero with the ratios."""
    joints = [at.robot.joints[-2], at.robot.joints[-4]]
    task = pink.tasks.JointCouplingTask(joints, [1.5, -0.5], 3.0, of_pink, gain=GAIN)
    return JointCouplingTask(dict(zip(joints, (1.5, -0.5), strict=True)), gain=K, weight=9.0), task


def holonomic(at, of_pink):
    """Two linear relations of all velocities."""
    rng = np.random.default_rng(3)
    A, b = rng.normal(size=(2, at.robot.nv)), rng.normal(size=2)
    q0 = at.robot.integrate(at.q, 0.1 * rng.normal(size=at.robot.nv), 1.0)
    task = pink.tasks.LinearHolonomicTask(A, b, q0, cost=2.0, gain=GAIN)
    return LinearHolonomicTask(A, b, q0=q0, gain=K, weight=4.0), task


def damping(at, of_pink):
    """Standing still, of all joints but the root's."""
    moves = np.array([not name.startswith("root_joint") for name in at.robot.velocity_names])
    return DampingTask(0.25 * moves), pink.tasks.DampingTask(cost=0.5)


def rolling(at, of_pink):
    """A frame as a wheel on the floor of the world, 10 cm in radius."""
    name = "left_sole_link" if "left_sole_link" in at.robot.frames else FRAMES[PANDA]
    task = pink.tasks.RollingTask(name, "universe", 0.1, cost=2.0, gain=GAIN)
    return RollingTask(name, 0.1, gain=K, weight=4.0), task


KINDS = [frame, relative, centre_of_mass, coupling, holonomic, damping, rolling]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", [PANDA, TALOS])
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_task_beside_a_posture(kind, name, seed, record_property):
    """The task weighs against a posture, on a fixed arm and on a floating base."""
    at, of_pink = start(name, seed)
    pairs = [kind(at, of_pink), posture(at, of_pink)]
    if name == TALOS:
        pairs.append(frame(at, of_pink) if kind is not frame else centre_of_mass(at, of_pink))
        pairs.append(holding(at, of_pink))
    apart = difference(ours(at, [pair[0] for pair in pairs]).x, theirs(of_pink, [pair[1] for pair in pairs]))
    record_property("apart", apart)
    assert apart < 1e-9


def holding(at, of_pink):
    """The left foot on the ground, so that the floating base has full rank."""
    goal = away(at.pose("left_sole_link"), 8)
    task = pink.tasks.FrameTask("left_sole_link", 1.0, 1.0, gain=GAIN)
    task.set_target(goal)
    return FrameTask("left_sole_link", target=goal, gain=K), task


@pytest.mark.parametrize("seed", range(3))
def test_an_omniwheel_whose_axle_is_along_y_of_the_floor(seed):
    """pink lets it slip along y of the floor, ours along its axle; the two are the same there."""
    at, of_pink = start(PANDA, seed)
    axle = at.pose("panda_hand")[:3, :3].T @ [0.0, 1.0, 0.0]
    mine = OmniwheelTask("panda_hand", 0.1, axle=axle, gain=K, weight=4.0)
    task = pink.tasks.OmniwheelTask("panda_hand", "universe", 0.1, cost=2.0, gain=GAIN)
    rest = posture(at, of_pink)
    assert difference(ours(at, [mine, rest[0]]).x, theirs(of_pink, [task, rest[1]])) < 1e-9
    turned = OmniwheelTask("panda_hand", 0.1, axle=(1.0, 0.3, 0.0), gain=K, weight=4.0)
    assert difference(ours(at, [turned, rest[0]]).x, theirs(of_pink, [task, rest[1]])) > 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_given_joint_velocities_have_the_other_sign(seed):
    """pink 4.4 moves joints at minus the velocity that is set; so it is given minus ours."""
    at, of_pink = start(PANDA, seed)
    wanted = np.random.default_rng(seed).normal(size=7)
    task = pink.tasks.JointVelocityTask(cost=0.6)
    task.set_target(-wanted, DT)
    hand = frame(at, of_pink)
    mine = ours(at, [hand[0], JointVelocityTask(wanted, weight=0.36)])
    assert difference(mine.x, theirs(of_pink, [hand[1], task])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_low_acceleration(seed):
    """The last velocity is told to both."""
    at, of_pink = start(PANDA, seed)
    last = np.random.default_rng(seed).normal(size=7)
    task = pink.tasks.LowAccelerationTask(cost=0.6)
    task.set_last_integration(last, DT)
    hand = frame(at, of_pink)
    mine = ours(at, [hand[0], LowAccelerationTask(0.36)], last=last)
    assert difference(mine.x, theirs(of_pink, [hand[1], task])) < 1e-9


@pytest.mark.parametrize("name", [PANDA, TALOS])
def test_damping_of_one_task(name):
    """μ = lm_damping · α² in `DampedTask`, since pink squares the error times the gain."""
    at, of_pink = start(name)
    hand, rest = frame(at, of_pink, lm_damping=0.8), posture(at, of_pink)
    mine = ours(at, [DampedTask(hand[0], 0.8 * GAIN**2), rest[0]])
    assert difference(mine.x, theirs(of_pink, [hand[1], rest[1]])) < 1e-9
    assert difference(ours(at, [hand[0], rest[0]]).x, theirs(of_pink, [hand[1], rest[1]])) > 1e-6


@pytest.mark.parametrize(("mask", "axes"), [(None, "xyz rpy"), ("position", "xyz")])
@pytest.mark.parametrize("seed", range(3))
def test_manipulability_that_is_to_grow_at_a_rate(seed, mask, axes):
    """pink asks for ∇w·Δq = rate; ours for ∇w·v ≥ K (w_min − w), with w_min set to ask for the same."""
    at, of_pink = start(PANDA, seed)
    task = pink.tasks.ManipulabilityTask(
        "panda_hand", at.robot.model, cost=2.0, manipulability_rate=1e-3, mask=mask, gain=1.0
    )
    w = Manipulability("panda_hand", axes)
    mine = ObjectiveTask(w, at_least=w.value(at) + 1e-3 / (DT * K), gain=K, weight=4.0)
    rest = damping(at, of_pink)
    assert difference(ours(at, [mine, rest[0]]).x, theirs(of_pink, [task, rest[1]])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("limit", ["configuration", "velocity", "both", "acceleration"])
def test_limits_of_joints_that_bind(limit, seed):
    """A hand that is sent far away; the limit on acceleration away from the ends of the ranges."""
    at, of_pink = start(PANDA, seed)
    model, slow, a = at.robot.model, np.full(7, 0.4), np.full(7, 30.0)
    theirs_of = {
        "configuration": [pink.limits.ConfigurationLimit(model, 0.02)],
        "velocity": [pink.limits.VelocityLimit(model, slow)],
        "acceleration": [pink.limits.AccelerationLimit(model, a)],
    }
    ours_of = {
        "configuration": [JointPositionLimit(0.02)],
        "velocity": [JointVelocityLimit(velocity=slow)],
        "acceleration": [JointAccelerationLimit(a, velocity=np.inf)],
    }
    theirs_of["both"] = theirs_of["configuration"] + theirs_of["velocity"]
    ours_of["both"] = ours_of["configuration"] + ours_of["velocity"]
    hand, rest = frame(at, of_pink), posture(at, of_pink)
    mine = ours(at, [hand[0], rest[0]], ours_of[limit], last=np.zeros(7))
    assert mine.active
    assert difference(mine.x, theirs(of_pink, [hand[1], rest[1]], theirs_of[limit])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_the_velocity_of_a_floating_base(seed):
    """Bounds on its linear and angular velocity in the axes of the base bind in both."""
    at, of_pink = start(TALOS, seed)
    limit = pink.limits.FloatingBaseVelocityLimit(at.robot.model, "base_link", 0.05, [0.1, np.inf, 0.2])
    hand, rest, foot = frame(at, of_pink), posture(at, of_pink), holding(at, of_pink)
    pairs = [hand, rest, foot]
    base = FloatingBaseVelocityLimit(0.05, angular=(0.1, np.inf, 0.2), frame="base_link")
    mine = ours(at, [pair[0] for pair in pairs], [base])
    assert mine.active
    assert difference(mine.x, theirs(of_pink, [pair[1] for pair in pairs], [limit])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_task_as_constraint_is_a_level_above(seed):
    """`constraints=[task]` of pink is the first level of a stack."""
    at, of_pink = start(PANDA, seed)
    hand, rest = frame(at, of_pink), posture(at, of_pink)
    mine = ours(at, [rest[0]], above=[hand[0]])
    assert difference(mine.x, theirs(of_pink, [rest[1]], constraints=[hand[1]])) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_position_barrier_is_a_box_above(seed):
    """`PositionBarrier` without safe displacement is a `BoxTask` on the level above, while it can be met."""
    at, of_pink = start(PANDA, seed)
    p = at.pose("panda_hand")[:3, 3]
    barrier = pink.barriers.PositionBarrier("panda_hand", p_min=p - 0.001, p_max=p + 0.002, gain=K)
    hand, rest = frame(at, of_pink), posture(at, of_pink)
    box = BoxTask("panda_hand", p - 0.001, p + 0.002, gain=K)
    mine = ours(at, [hand[0], rest[0]], above=[box])
    assert mine.active
    assert difference(mine.x, theirs(of_pink, [hand[1], rest[1]], barriers=[barrier])) < 1e-9


def test_another_task_is_told_apart():
    """The comparison sees a task that is not the same: the tilt of an axis instead of the whole pose."""
    at, of_pink = start(PANDA)
    hand, rest = frame(at, of_pink), posture(at, of_pink)
    other = AxisAlignmentTask("panda_hand", gain=K)
    assert difference(ours(at, [other, rest[0]]).x, theirs(of_pink, [hand[1], rest[1]])) > 1e-3
