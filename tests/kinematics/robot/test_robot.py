"""Limits by joint type, names, postures, locking, and the manifold."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot, planar_arm
from tests.helpers.robots import FRAMES, random_configuration, robot

FINGERS = ("panda_finger_joint1", "panda_finger_joint2")


def test_the_limits_of_the_panda_are_those_of_its_file():
    """Seven revolute joints in rad, two fingers in m, all with limits of position and velocity."""
    panda = Robot.load("panda")
    assert panda.joints == panda.velocity_names
    assert panda.coordinate_units == ("rad",) * 7 + ("m",) * 2
    np.testing.assert_array_equal(panda.position_index, np.arange(9))
    np.testing.assert_allclose(panda.position_lower[[3, 7]], [-3.0718, 0.0])
    np.testing.assert_allclose(panda.position_upper[[3, 7]], [-0.0698, 0.04])
    np.testing.assert_allclose(panda.velocity_limit[[0, 6]], [2.175, 2.61])


def test_wheels_have_no_position_limit():
    """TIAGo's continuous joints, ±1.01 on cosine and sine in the model, turn without end."""
    tiago = robot("tiago")
    columns = [tiago.velocity_index(f"wheel_{side}_joint").start for side in ("left", "right")]
    assert np.isinf(tiago.position_lower[columns]).all()
    assert np.isinf(tiago.position_upper[columns]).all()
    assert (tiago.position_index[columns] == -1).all()
    rest = np.delete(np.arange(tiago.nv), columns)
    assert np.isfinite(tiago.position_lower[rest]).all()
    assert (tiago.position_index[rest] >= 0).all()
    assert tiago.coordinate_units[0] == "m"  # the lift of its torso


def test_a_floating_base_has_no_limits():
    """TALOS' free-flyer, ±1.8e308 in the model, is unbounded in position and velocity, and named by axis."""
    talos = robot("talos_reduced")
    assert talos.velocity_names[:7] == (
        *(f"root_joint.{axis}" for axis in ("vx", "vy", "vz", "wx", "wy", "wz")),
        "leg_left_1_joint",
    )
    assert talos.coordinate_units[:7] == ("m", "m", "m", "rad", "rad", "rad", "rad")
    for limit in (talos.position_lower, talos.position_upper, talos.velocity_limit):
        assert np.isinf(limit[:6]).all()
        assert np.isfinite(limit[6:]).all()
    np.testing.assert_array_equal(talos.position_index[:8], [-1] * 6 + [7, 8])


def test_a_velocity_limit_of_zero_is_none():
    """The double pendulum's file says 0 and means that nobody wrote a number."""
    assert np.isinf(Robot.load("double_pendulum").velocity_limit).all()


@pytest.mark.parametrize("name", FRAMES)
def test_a_velocity_moves_the_coordinate_that_its_limit_speaks_of(name):
    """position_index[j] is where q changes at rate 1 under velocity j, and the wrong one does not."""
    at = random_configuration(name, 8)
    arm = at.robot
    for j, place in enumerate(arm.position_index):
        if place >= 0:
            moved = arm.integrate(at.q, np.eye(arm.nv)[j], 1e-3) - at.q
            assert moved[place] == pytest.approx(1e-3, rel=1e-9)
            assert np.count_nonzero(np.abs(moved) > 1e-12) == 1


@pytest.mark.parametrize("name", FRAMES)
def test_integration_and_difference_are_inverse(name):
    """q ⊕ (q₁ ⊖ q) = q₁, with nq ≠ nv and over a quaternion."""
    a, b = random_configuration(name, 1), random_configuration(name, 2)
    v = a.robot.difference(a.q, b.q)
    assert v.shape == (a.robot.nv,)
    np.testing.assert_allclose(a.robot.integrate(a.q, v / 0.01, 0.01), b.q, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", FRAMES)
def test_the_middle_posture_is_inside_the_limits(name):
    """Every robot has it; the neutral one of the Panda is outside, and said to be so by name."""
    assert robot(name).outside(robot(name).posture("middle")) == ()


def test_what_is_outside_is_said_in_a_sentence():
    """Joint, value, unit, range; within the tolerance nothing is said."""
    panda = Robot.load("panda")
    assert panda.outside(panda.neutral) == ("panda_joint4 at 0 rad, allowed -3.0718 to -0.0698",)
    q = panda.posture("default")
    q[8] = 0.04 + 1e-10
    assert panda.outside(q) == ()
    q[8] = 0.05
    assert panda.outside(q) == ("panda_finger_joint2 at 0.05 m, allowed 0 to 0.04",)


@pytest.mark.parametrize(
    ("name", "spoil", "said"),
    [
        ("panda", lambda q: q[:5], "q of panda must have shape 7, got 5"),
        ("panda", lambda q: q + np.nan, "NaN at index 0"),
        ("panda", lambda q: q * np.where(np.arange(7) == 3, np.inf, 1), "not finite at index 3"),
        ("tiago", lambda q: 0 * q, "wheel_left_joint must be cosine and sine, got norm 0"),
        ("talos_reduced", lambda q: 1.001 * q, "root_joint must be a unit quaternion, got norm 1.001"),
    ],
)
def test_a_bad_q_is_refused_by_name(name, spoil, said):
    """Size, NaN, inf, cosine and sine, quaternion."""
    with pytest.raises(InvalidValue, match=said):
        robot(name).checked_q(spoil(robot(name).posture("middle")))


@pytest.mark.parametrize(("missing_q", "missing_v"), [(1, 0), (0, 1)])
def test_a_step_of_the_wrong_size_is_refused(missing_q, missing_v):
    """With the size that the robot has, in place of a page of C++."""
    of = Robot.load("panda")
    q, v = of.posture("default")[missing_q:], np.zeros(of.nv)[missing_v:]
    with pytest.raises(InvalidValue, match=f"{'q' if missing_q else 'v'} of panda must have shape 9, got 8"):
        of.integrate(q, v, 0.1)


HUGE = 10**400  # an integer that no float can hold


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (lambda of: of.integrate(np.zeros(2), np.zeros(2), HUGE), "dt of a step must be numbers below 1.8"),
        (lambda of: of.integrate(np.zeros(2), np.array([HUGE, 0]), 0.1), "v of planar2 must be numbers"),
        (lambda of: of.integrate([0, HUGE], [0, 0], 0.1), "q of planar2 must be numbers below"),
        (lambda of: of.integrate(np.zeros(2), None, 0.1), "v of planar2 must be numbers, got None"),
        (lambda of: of.integrate(np.zeros(2), np.zeros(2), "x"), "dt of a step must be numbers, got 'x'"),
    ],
)
def test_what_no_float_can_hold_is_refused_by_name(step, said):
    """Python's integers have no largest one; neither an OverflowError nor a page of C++ comes out."""
    with pytest.raises(InvalidValue, match=said):
        step(Robot.load("planar2"))


def test_lists_are_numbers_too():
    """A list that Python would repeat instead of multiply gives the step of the same array."""
    of = Robot.load("planar2")
    np.testing.assert_array_equal(of.integrate([0.1, 0.2], [1, 2], 2), [2.1, 4.2])


@pytest.mark.parametrize("name", ["", 3])
def test_a_frame_without_a_name_is_refused(name):
    """Pinocchio would take the first, and answer the second with its C++ signatures."""
    with pytest.raises(InvalidValue, match="a frame needs a name, got"):
        Robot.load("planar2").with_frame(name, "tip", np.eye(4))


def test_a_quaternion_that_drifted_is_normalised():
    """Rounding of 1e-8 is taken away, and the caller's array is left alone."""
    talos = robot("talos_reduced")
    q = talos.posture("half_sitting")
    q[3:7] *= 1.0 + 1e-8
    assert np.linalg.norm(talos.checked_q(q)[3:7]) == pytest.approx(1.0, abs=1e-15)
    assert np.linalg.norm(q[3:7]) > 1.0 + 1e-9


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda r: r.frame_id("panda_hnd"), "no frame named 'panda_hnd'; did you mean panda_hand"),
        (lambda r: r.frame_id("universe"), "no frame named 'universe'"),
        (
            lambda r: r.velocity_index("panda_joint8"),
            "no joint named 'panda_joint8'; did you mean panda_joint",
        ),
        (lambda r: r.posture("ready"), "no posture named 'ready'"),
        (lambda r: r.lock(["finger"]), "no joint named 'finger'"),
    ],
)
def test_unknown_names_get_the_nearest(ask, said):
    """Frame, joint, posture, joint to lock."""
    with pytest.raises(UnknownName, match=said):
        ask(Robot.load("panda"))


@pytest.mark.parametrize("name", FRAMES)
def test_locking_leaves_the_other_joints_as_they_were(name):
    """Poses, limits, postures and shapes of the smaller robot are those of the larger one."""
    at = random_configuration(name, 9)
    arm = at.robot
    held = (arm.joints[-1], arm.joints[len(arm.joints) // 2])
    smaller = arm.lock(held, at.q)
    kept = [j for j in arm.joints if j not in held]
    assert list(smaller.joints) == kept
    columns = np.concatenate([np.arange(arm.nv)[arm.velocity_index(j)] for j in kept])
    np.testing.assert_array_equal(smaller.velocity_limit, arm.velocity_limit[columns])
    np.testing.assert_array_equal(smaller.position_lower, arm.position_lower[columns])
    places = np.concatenate([np.arange(j.idx_q, j.idx_q + j.nq) for n, j in _joints(arm) if n in kept])
    near = Configuration(smaller, at.q[places])
    for frame in arm.frames:
        np.testing.assert_allclose(near.pose(frame), at.pose(frame), rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        near.jacobian(FRAMES[name]), at.jacobian(FRAMES[name])[:, columns], rtol=0, atol=1e-12
    )
    assert set(smaller.postures) == set(arm.postures)


def _joints(arm: Robot) -> list:
    return list(zip(arm.model.names, arm.model.joints, strict=True))[1:]


def test_the_shapes_of_a_locked_robot_stay_in_place():
    """Collision shapes move to the joint that is left, and stand where they stood."""
    panda = Robot.load("panda")
    q = panda.posture("default")
    locked = panda.lock(FINGERS, q)
    assert locked.nq == 7
    np.testing.assert_allclose(locked.posture("default"), q[:7])
    placed = []
    for arm, posture in ((panda, q), (locked, q[:7])):
        data, shapes = arm.model.createData(), arm.geometry.createData()
        pin.updateGeometryPlacements(arm.model, data, arm.geometry, shapes, posture)
        placed.append(
            {s.name: M.homogeneous for s, M in zip(arm.geometry.geometryObjects, shapes.oMg, strict=True)}
        )
    assert placed[0].keys() == placed[1].keys()
    for name, T in placed[0].items():
        np.testing.assert_allclose(placed[1][name], T, rtol=0, atol=1e-12)


def test_shapes_without_a_parent_frame_can_be_locked():
    """A GeometryModel as users build it, with a joint and no frame, does not crash Pinocchio."""
    arm = planar_arm()
    shapes = pin.GeometryModel()
    shape = arm.geometry.geometryObjects[2]
    shapes.addGeometryObject(pin.GeometryObject("ball", 3, shape.placement, shape.geometry))
    locked = Robot(arm.model, shapes).lock("joint2")
    assert [s.name for s in locked.geometry.geometryObjects] == ["ball"]
    assert locked.geometry.geometryObjects[0].parentJoint == 2


def test_locking_by_default_holds_joints_inside_their_limits():
    """Panda's joint 4, whose neutral is outside, is held at the nearest limit."""
    locked = Robot.load("panda").lock(["panda_joint4"])
    whole = Robot.load("panda").posture("neutral")
    whole[3] = -0.0698
    expected = Configuration(Robot.load("panda"), whole).pose("panda_hand")
    np.testing.assert_allclose(
        Configuration(locked, locked.neutral).pose("panda_hand"), expected, rtol=0, atol=1e-12
    )


def test_a_model_of_ones_own_is_taken_as_it_is():
    """Robot(model, geometry), as a user of Pinocchio has it, with postures of his own."""
    model = pin.buildSampleModelHumanoidRandom()
    arm = Robot(model, name="sample", postures={"zero": pin.neutral(model)})
    assert (arm.nq, arm.nv, arm.name) == (model.nq, model.nv, "sample")
    assert arm.geometry.ngeoms == arm.visual.ngeoms == 0
    np.testing.assert_array_equal(arm.posture("zero"), arm.neutral)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Robot("panda"), "made from a pin.Model, got 'panda'; for a name use Robot.load"),
        (lambda: Robot(_crossed()), "joint1 has position limits"),
        (lambda: Robot(planar_arm().model, postures={"bent": [1, 2]}), "must have shape 3, got 2"),
    ],
)
def test_a_bad_model_is_refused(make, said):
    """A name in place of a model, limits the wrong way round, a posture of the wrong size."""
    with pytest.raises(InvalidValue, match=said):
        make()


def _crossed() -> pin.Model:
    model = planar_arm(lower=-1, upper=1).model.copy()
    model.lowerPositionLimit = -model.lowerPositionLimit
    model.upperPositionLimit = -model.upperPositionLimit
    return model


def test_a_robot_cannot_be_changed_by_accident():
    """Limits and postures are read-only, or copies."""
    arm = planar_arm()
    with pytest.raises(ValueError, match="read-only"):
        arm.velocity_limit[0] = 1.0
    arm.posture("neutral")[0] = 1.0
    assert arm.posture("neutral")[0] == 0.0
