"""Stacks: what a plan fills, when targets start, which limits own the box, and refusals."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry import Sphere
from taskopt.kinematics.limit import (
    BoundLimit,
    JointPositionLimit,
    JointVelocityLimit,
    Limit,
    ObstacleLimit,
    RowLimit,
)
from taskopt.kinematics.objective import JointRange
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Circle, Function, Hold, Latest, Line
from taskopt.kinematics.task import (
    BoundTask,
    DampingTask,
    FrameTask,
    GradientTask,
    JointTask,
    PositionTask,
    Task,
)
from tests.helpers.moving import bound, tumbling
from tests.helpers.robots import FRAMES, generic_q, robot

DT = 1e-3


def stack_of_everything(name, target=None):
    """A stack with every kind of task, in three levels."""
    frame = FRAMES[name]
    return Stack(
        levels=[
            [FrameTask(frame, target=target or Hold(), gain=10.0, weight=(1.0, 0.1))],
            [PositionTask(frame, axes="xy", gain=5.0), JointTask(gain=2.0, weight=1e-3)],
            [GradientTask(JointRange()), DampingTask(1e-6)],
        ],
        limits=[JointPositionLimit(0.5), JointVelocityLimit()],
    )


class Wall(Limit):
    """A limit with hard rows, one number above and one below."""

    name = "wall"

    def bind(self, robot, dt):
        return BoundWall("wall", ("near", "far"), ("m/s", "m/s"), (-1, 3))


class BoundWall(RowLimit):
    """Two rows, of which the second is a unit vector."""

    def prepare(self, rows):
        rows.A[1, 3] = 1.0

    def fill(self, configuration, t, rows):
        rows.A[0, :2] = configuration.q[0], t
        rows.lower[:], rows.upper[:] = -np.inf, 0.5


class Corridor(Task):
    """An inequality task: −0.1 ≤ v_1 ≤ 0.2."""

    def bind(self, robot, name):
        return BoundCorridor(name, ("one",), ("rad/s",), gain=0.0, column=(0,))


class BoundCorridor(BoundTask):
    """One row, a unit vector."""

    def prepare(self, rows):
        rows.A[0, 0] = 1.0

    def fill(self, configuration, t, rows):
        rows.lower[:], rows.upper[:] = -0.1, 0.2


class Caution(Limit):
    """A limit that Python narrows on every tick, beside those that are compiled."""

    name = "caution"

    def bind(self, robot, dt):
        return BoundCaution("caution")


class BoundCaution(BoundLimit):
    """v_1 ≤ 0.001."""

    def narrow(self, configuration, bounds, owner):
        bounds[1, 0], bounds[3, 0] = 1e-3, owner


@pytest.mark.parametrize("name", FRAMES)
def test_the_compiled_tick_fills_what_each_task_fills_alone(name):
    """One kernel over all parts gives the rows of the parts, at generic q and t, tick after tick."""
    of = robot(name)
    q0 = generic_q(of, 0)
    target = tumbling(Configuration(of, q0).pose(FRAMES[name]), 1)
    stack = stack_of_everything(name, target)
    plan = stack.compile(of, DT)
    plan.start(q0, 0.0)
    tasks = [task for level in stack.levels for task in level]
    for tick in range(3):
        q, t = generic_q(of, tick), 0.1 * tick
        hierarchy = plan.at(q, t)
        for task, ready, block in zip(tasks, plan.tasks, plan.layout.blocks, strict=True):
            alone, rows = bound(task, Configuration(of, q0))
            alone.fill(Configuration(of, q), t, rows)
            np.testing.assert_allclose(hierarchy.A[block.rows], rows.A, atol=1e-14)
            np.testing.assert_allclose(hierarchy.lower[block.rows], rows.lower, atol=1e-13)
            np.testing.assert_allclose(hierarchy.upper[block.rows], rows.upper, atol=1e-13)
            np.testing.assert_array_equal(hierarchy.weight[block.rows], alone.weight)
            np.testing.assert_allclose(ready.error, alone.error, atol=1e-14)
            if alone.desired is not None:
                np.testing.assert_allclose(ready.desired, alone.desired)
                np.testing.assert_allclose(ready.actual, alone.actual)


def test_the_rows_stand_level_by_level_under_their_names():
    """Layout: offsets, names, units, and the columns of rows that are unit vectors."""
    layout = stack_of_everything("planar").compile(robot("planar"), DT).layout
    assert layout.offsets.tolist() == [0, 0, 6, 11, 17]
    assert [block.name for block in layout.blocks] == [
        "tip",
        "tip position",
        "posture",
        "gradient",
        "damping",
    ]
    assert layout.row_names[:7] == ("tip/x", "tip/y", "tip/z", "tip/rx", "tip/ry", "tip/rz", "tip position/x")
    assert layout.column[6:] == (-1, -1, 0, 1, 2, 0, 1, 2, 0, 1, 2)
    assert layout.owners == ("box", "joint_position", "joint_velocity")


@pytest.mark.parametrize("name", FRAMES)
def test_the_box_is_the_narrowest_of_all_limits_on_every_tick(name):
    """The bounds of the last tick leave nothing behind."""
    of = robot(name)
    plan = stack_of_everything(name).compile(of, DT)
    columns = np.flatnonzero(np.isfinite(of.position_upper))
    places = of.position_index[columns]
    q = of.posture("middle")
    for gap in (1e-6, 10.0, 1e-4, -0.1):
        q[places] = np.maximum(of.position_upper[columns] - gap, of.posture("middle")[places])
        hierarchy = plan.at(q, 0.0)
        damper = np.maximum(0.5 / DT * (of.position_upper[columns] - q[places]), 0.0)
        want = np.minimum(damper, of.velocity_limit[columns])
        np.testing.assert_allclose(hierarchy.box_upper[columns], want, rtol=1e-12)
        owners = np.array(plan.layout.owners)[hierarchy.owner[1, columns].astype(int)]
        assert (owners[damper < of.velocity_limit[columns]] == "joint_position").all()
        assert (owners[damper > of.velocity_limit[columns]] == "joint_velocity").all()


def test_limits_that_only_python_knows_have_their_place():
    """Hard rows stand first, at level 0; a bound narrowed from Python comes after the compiled ones."""
    of = robot("panda")
    plan = Stack([[JointTask()]], limits=[Wall(), JointVelocityLimit(), Caution()]).compile(of, DT)
    q = generic_q(of, 0)
    for t in (0.0, 0.7):
        hierarchy = plan.at(q, t)
        assert hierarchy.limits.A[0, :2].tolist() == [q[0], t]
        assert hierarchy.limits.A[1].tolist() == np.eye(7)[3].tolist()
        assert plan.layout.row_names[:2] == ("wall/near", "wall/far")
        assert hierarchy.box_upper[0] == 1e-3
        assert hierarchy.name_of(0, upper=True) == "caution/panda_joint1"
        assert hierarchy.name_of(0, upper=False) == "joint_velocity/panda_joint1"


@pytest.mark.parametrize("t", [np.nan, np.inf])
def test_a_row_that_is_not_finite_names_its_limit(t):
    """NaN or inf in A alone is found too."""
    of = robot("panda")
    plan = Stack([[JointTask()]], limits=[Wall()]).compile(of, DT)
    plan.at(generic_q(of, 0), 0.0)
    with pytest.raises(InvalidValue, match="wall"):
        plan.at(generic_q(of, 0), t)


def test_inequality_tasks_have_their_place():
    """A task writes lower and upper; it stands at its level like any other."""
    of = robot("panda")
    hierarchy = Stack([[JointTask()], [Corridor()]]).compile(of, DT).at(generic_q(of, 0), 0.0)
    assert isinstance(hierarchy.levels[1], LevelRows)
    assert (hierarchy.levels[1].lower, hierarchy.levels[1].upper) == (-0.1, 0.2)


def test_references_start_with_the_plan():
    """At the start e = 0; `start` anchors again, and the first `at` does so by itself."""
    of = robot("panda")
    circle = Circle(radius=0.1, period=2.0)
    plan = Stack([[FrameTask("panda_hand", target=circle)]]).compile(of, DT)
    for q, t in ((generic_q(of, 0), 0.0), (generic_q(of, 1), 5.0)):
        if t:
            plan.start(q, t)
        hierarchy = plan.at(q, t)
        np.testing.assert_allclose(plan.tasks[0].error, 0.0, atol=1e-14)
        speed = np.linalg.norm(hierarchy.levels[0].lower)
        assert speed == pytest.approx(0.1 * np.pi)


def test_one_declaration_serves_two_plans():
    """Two robots, or two runs, share a stack and nothing else."""
    stack = Stack([[JointTask(Line(by={"panda_joint1": 1.0}, duration=1.0), joints=("panda_joint1",))]])
    of = robot("panda")
    first, second = stack.compile(of, DT), stack.compile(of, DT)
    first.start(generic_q(of, 0), 0.0)
    second.start(generic_q(of, 1), 0.0)
    first.at(generic_q(of, 0), 0.5)
    second.at(generic_q(of, 1), 0.0)
    assert first.tasks[0].error == pytest.approx(0.5)
    assert second.tasks[0].error == pytest.approx(0.0)


def test_a_look_is_a_copy():
    """`stack.at` gives a hierarchy of its own, with targets begun there at time 0."""
    of = robot("planar")
    at = Configuration(of, generic_q(of, 0))
    stack = stack_of_everything("planar", Circle(radius=0.1, period=2.0, toward=(1, 0, 0), along=(0, 1, 0)))
    look, later = stack.at(at, DT), stack.at(at, DT, t=0.5)
    assert not np.shares_memory(look.buffer, later.buffer)
    assert np.linalg.norm(later.levels[0].lower - look.levels[0].lower) > 0.5


def test_a_latest_target_moves_between_ticks():
    """b = K e with the value set last, and with its velocity as feedforward."""
    of = robot("panda")
    target = Latest()
    task = PositionTask("panda_hand", target=target, gain=10.0)
    plan = Stack([[task]]).compile(of, DT)
    q = generic_q(of, 0)
    np.testing.assert_allclose(plan.at(q, 0.0).lower, 0.0, atol=1e-13)
    p = plan.tasks[0].actual[:3, 3]
    target.set(np.add(p, [0.1, 0.0, 0.0]))
    np.testing.assert_allclose(plan.at(q, 0.0).lower, [1.0, 0.0, 0.0], atol=1e-12)
    target.set(np.add(p, [0.1, 0.0, 0.0]), velocity=[0.0, 2.0, 0.0])
    np.testing.assert_allclose(plan.at(q, 0.0).lower, [1.0, 2.0, 0.0], atol=1e-12)


def test_names_that_clash_are_numbered():
    """Every task keeps a name of its own, also where a number is taken."""
    tasks = [JointTask(), JointTask(), JointTask(name="posture 2"), DampingTask()]
    plan = Stack([tasks]).compile(robot("planar"), DT)
    assert [task.name for task in plan.tasks] == ["posture", "posture 2", "posture 2 2", "damping"]


@pytest.mark.parametrize("norm", [None, [1.0, 2.0, 3.0], np.diag([1.0, 2.0, 3.0]) + 0.1])
def test_the_norm_goes_to_the_hierarchy(norm):
    """W as declared, the identity by default."""
    plan = Stack([[JointTask()]], norm=norm).compile(robot("planar"), DT)
    want = np.eye(3) if norm is None else np.diag(norm) if np.ndim(norm) == 1 else norm
    np.testing.assert_array_equal(plan.at(np.zeros(3), 0.0).norm_matrix(), want)


@pytest.mark.parametrize(
    ("velocity", "rate"), [(None, None), ([np.nan] * 6, None), (None, lambda t: np.full(6, np.inf))]
)
def test_a_target_that_is_not_finite_names_its_task(velocity, rate):
    """NaN in a value, in a velocity, or inf in a rate stops the tick with the name of the task."""
    of = robot("panda")
    target = Latest()
    moving = target if rate is None else Function(lambda t: [0.4, 0.0, 0.4], rate)
    plan = Stack([[JointTask()], [FrameTask("panda_hand", target=moving)]]).compile(of, DT)
    q = generic_q(of, 0)
    if rate is None:
        plan.at(q, 0.0)
        pose = np.full((4, 4), np.nan) if velocity is None else plan.tasks[1].actual.copy()
        target.set(pose, velocity and np.array(velocity))
    with pytest.raises(InvalidValue, match="panda_hand"):
        plan.at(q, 0.1)


@pytest.mark.parametrize("q", [np.full(7, np.nan), np.zeros(6)])
def test_a_posture_that_is_none_is_refused(q):
    """NaN and a wrong size, at the start and later."""
    of = robot("panda")
    plan = Stack([[FrameTask("panda_hand")]]).compile(of, DT)
    with pytest.raises(InvalidValue, match="q of panda"):
        plan.at(q, 0.0)
    plan.at(generic_q(of, 0), 0.0)
    with pytest.raises(InvalidValue, match="q of panda"):
        plan.at(q, 0.0)


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: Stack([]), InvalidValue, "at least one level"),
        (lambda: Stack([[]]), InvalidValue, "at least one task"),
        (lambda: Stack([JointTask()]), InvalidValue, "a level must be a list of tasks"),
        (lambda: Stack([[JointVelocityLimit()]]), InvalidValue, "list of tasks"),
        (lambda: Stack([[JointTask()]], limits=JointVelocityLimit()), InvalidValue, "list of limits"),
        (lambda: Stack([[JointTask()]], limits=[DampingTask()]), InvalidValue, "list of limits"),
    ],
)
def test_what_is_no_stack_is_refused_where_it_is_written(make, error, says):
    """Levels are lists of tasks, limits are limits."""
    with pytest.raises(error, match=says):
        make()


@pytest.mark.parametrize(
    ("stack", "dt", "error", "says"),
    [
        (Stack([[JointTask()]]), 0.0, InvalidValue, "dt must be > 0"),
        (Stack([[JointTask()]]), -1e-3, InvalidValue, "dt must be > 0"),
        (Stack([[JointTask()]]), np.nan, InvalidValue, "dt"),
        (Stack([[FrameTask("panda_hnd")]]), DT, UnknownName, "panda_hand"),
        (Stack([[JointTask(joints=["panda_joint12"])]]), DT, UnknownName, "panda_joint1"),
        (Stack([[JointTask()]], norm=np.zeros(7)), DT, InvalidValue, "positive definite"),
        (Stack([[JointTask()]], norm=np.ones(3)), DT, InvalidValue, "norm"),
        (Stack([[JointTask(gain=2.0 / DT)]]), DT, InvalidValue, "too large for dt"),
    ],
)
def test_what_does_not_fit_robot_or_period_is_refused_when_compiled(stack, dt, error, says):
    """dt, names, norm, and Euler's K dt < 2."""
    with pytest.raises(error, match=says):
        stack.compile(robot("panda"), dt)


def test_an_euler_loop_without_feedforward_lags_and_with_it_does_not():
    """ẋ_d is used: at gain K a circle is followed to O(dt), not with the lag ẋ_d/K."""
    of, dt, gain = robot("planar"), 1e-3, 20.0
    circle = Circle(radius=0.25, period=2.0, toward=(1, 0, 0), along=(0, 1, 0))
    plan = Stack([[PositionTask("tip", target=circle, axes="xy", gain=gain)]]).compile(of, dt)
    q = np.array([np.pi, -np.pi / 2, -np.pi / 2])
    worst = 0.0
    for i in range(1000):
        level = plan.at(q, i * dt).levels[0]
        worst = max(worst, float(np.abs(plan.tasks[0].error).max()))
        q = of.integrate(q, np.linalg.pinv(level.A) @ level.lower, dt)
    lag = 0.25 * np.pi / gain
    assert worst < 0.01 * lag


def test_limits_of_one_name_get_numbers_and_their_rows_stay_apart():
    """Two obstacle limits: "obstacle" and "obstacle 2", in layout, owners and distances alike."""
    limits = [ObstacleLimit(Sphere((0.5, y, 0.0), 0.1)) for y in (0.4, -0.4)]
    arm = planar_arm([0.5, 0.4, 0.3])
    plan = Stack([[JointTask()]], limits).compile(arm, DT)
    assert list(plan.distance_limits) == ["obstacle", "obstacle 2"]
    assert plan.layout.owners == ("box", "obstacle", "obstacle 2")
    assert len(set(plan.layout.row_names)) == plan.layout.row_count
    plan.at(np.array([0.3, 0.4, 0.2]), 0.0)
    apart = [limit.distances.distance for limit in plan.distance_limits.values()]
    assert apart[0].min() < apart[1].min()
