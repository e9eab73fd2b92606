"""Joints whose axes turn with their own coordinates are split, and nothing moves otherwise than before."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import Manipulability
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.geometry.coal import add_capsule
from taskopt.kinematics.robot import Robot
from tests.helpers.differences import STEP


def random_model(seed: int) -> pin.Model:
    """A tree with a composite and a universal joint, Euler angles and a screw, and no frame of a joint."""
    pin.seed(seed)
    model, composite = pin.Model(), pin.JointModelComposite()
    for kind in (pin.JointModelPX(), pin.JointModelRZ(), pin.JointModelSpherical()):
        composite.addJoint(kind, pin.SE3.Random())
    kinds = [
        (composite, "whole"),
        (pin.JointModelUniversal(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])), "cross"),
        (pin.JointModelSphericalZYX(), "euler"),
        (pin.JointModelHX(0.2), "screw"),
    ]
    joint = 0
    for kind, name in kinds:
        joint = model.addJoint(joint, kind, pin.SE3.Random(), name)
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Random())
        model.addFrame(pin.Frame(f"{name}_link", joint, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    rng = np.random.default_rng(seed)
    model.lowerPositionLimit[:] = -rng.uniform(1, 2, model.nq)
    model.upperPositionLimit[:] = rng.uniform(1, 2, model.nq)
    model.upperVelocityLimit[:] = rng.uniform(1, 2, model.nv)
    return model


NAMES = (
    "whole_1", "whole_2", "whole_3.wx", "whole_3.wy", "whole_3.wz", "cross_1", "cross_2",
    "euler_1", "euler_2", "euler_3", "screw",
)  # fmt: skip


@pytest.fixture(params=[1, 2, 3])
def posed(request):
    """A model, its robot, and a configuration."""
    model = random_model(request.param)
    q = pin.normalize(model, np.random.default_rng(request.param).normal(size=model.nq))
    return model, Robot(model), q


def test_coordinates_names_units_and_limits_are_those_of_the_axes(posed):
    """Each velocity bears the name of its axis and its unit; limits stay with their coordinates."""
    model, arm, _ = posed
    assert arm.velocity_names == NAMES
    assert arm.coordinate_units == ("m", *10 * ("rad",))
    has = arm.position_index >= 0
    np.testing.assert_array_equal(arm.position_lower[has], model.lowerPositionLimit[arm.position_index[has]])
    np.testing.assert_array_equal(arm.position_upper[has], model.upperPositionLimit[arm.position_index[has]])
    np.testing.assert_array_equal(arm.velocity_limit, model.upperVelocityLimit)


def test_poses_jacobians_mass_and_steps_are_those_of_the_model(posed):
    """Pinocchio's own results for the model as it was handed in, at every frame."""
    model, arm, q = posed
    data, at = model.createData(), Configuration(arm, q)
    pin.framesForwardKinematics(model, data, q)
    for frame in ("whole_link", "cross_link", "euler_link", "screw_link"):
        index = model.getFrameId(frame)
        np.testing.assert_allclose(at.pose(frame), data.oMf[index].homogeneous, atol=1e-14)
        J = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(at.jacobian(frame), J, atol=1e-13)
    np.testing.assert_allclose(at.centre_of_mass()[0], pin.centerOfMass(model, data, q), atol=1e-14)
    v = np.linspace(-1.0, 1.0, model.nv)
    np.testing.assert_allclose(arm.integrate(q, v, 0.3), pin.integrate(model, q, 0.3 * v), atol=1e-15)


def test_derivatives_are_those_of_the_values(posed):
    """Hessian and gradient of manipulability against central differences."""
    _, arm, q = posed

    def beside(k: int, step: float) -> Configuration:
        return Configuration(arm, arm.integrate(q, step * np.eye(arm.nv)[k], 1.0))

    near = [(beside(k, STEP), beside(k, -STEP)) for k in range(arm.nv)]
    J = [(a.jacobian("screw_link") - b.jacobian("screw_link")) / (2 * STEP) for a, b in near]
    np.testing.assert_allclose(Configuration(arm, q).hessian("screw_link"), np.stack(J, axis=2), atol=1e-7)
    objective = Manipulability("screw_link")
    slope = [(objective.value(a) - objective.value(b)) / (2 * STEP) for a, b in near]
    np.testing.assert_allclose(objective.gradient(Configuration(arm, q)), slope, atol=1e-6)


def test_shapes_stay_on_their_bodies(posed):
    """A shape of the second joint is where Pinocchio places it in the model as it was handed in."""
    model, _, q = posed
    shapes = pin.GeometryModel()
    for joint in range(1, model.njoints):
        add_capsule(shapes, f"rod{joint}", joint, [0.1, 0, 0], [0, 0.2, 0.3], 0.01)
    arm = Robot(model, shapes)
    places = []
    for m, s in ((model, shapes), (arm.model, arm.geometry)):
        data, shape_data = m.createData(), s.createData()
        pin.updateGeometryPlacements(m, data, s, shape_data, q)
        places.append([place.homogeneous for place in shape_data.oMg])
    np.testing.assert_allclose(places[1], places[0], atol=1e-14)


def test_one_axis_of_a_split_joint_can_be_locked(posed):
    """The frames stay, at the poses that they have with that coordinate."""
    _, arm, q = posed
    still = arm.lock(["cross_1", "whole_2"], q)
    rest = np.delete(q, [1, 6])
    np.testing.assert_allclose(
        Configuration(still, rest).pose("screw_link"), Configuration(arm, q).pose("screw_link"), atol=1e-14
    )


def test_a_model_without_such_joints_is_left_alone():
    """The robot's model is the very object that was handed in."""
    model = pin.buildSampleModelManipulator()
    assert Robot(model).model is model


def test_a_model_without_frames_of_joints_can_be_locked():
    """Built joint by joint, as in code; the frame that the user added stays."""
    model, up = pin.Model(), pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.4]))
    first = model.addJoint(0, pin.JointModelRZ(), up, "pan")
    second = model.addJoint(first, pin.JointModelRY(), up, "tilt")
    model.addFrame(pin.Frame("tip", second, 0, up, pin.FrameType.OP_FRAME))
    whole = Robot(model)
    still = whole.lock(["pan"], [0.3, 0.0])
    assert still.joints == ("tilt",)
    np.testing.assert_allclose(
        Configuration(still, [0.2]).pose("tip"), Configuration(whole, [0.3, 0.2]).pose("tip")
    )


def test_a_body_of_an_mjcf_file_that_lost_its_names_is_refused(tmp_path):
    """Pinocchio keeps the name of the first joint only; the message has the way out."""
    joints = '<joint name="along" type="slide" axis="1 0 0"/><joint name="swing" type="hinge" axis="0 1 0"/>'
    body = f'<body name="cart">{joints}<geom size="0.1" mass="1"/></body>'
    (tmp_path / "cart.xml").write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with pytest.raises(InvalidValue, match=r"Composite_along stands for 2 joints.*Robot\.from_mjcf"):
        Robot(pin.buildModelFromMJCF(str(tmp_path / "cart.xml")))


def test_a_model_without_joints_is_refused():
    """As Pinocchio reads an MJCF file that only includes others, or when all joints are locked."""
    with pytest.raises(InvalidValue, match=r"joint that moves.*<include>.*Robot\.from_mjcf"):
        Robot(pin.Model())


def test_a_joint_that_cannot_be_split_is_refused():
    """A joint on an ellipsoid is no chain of axes."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelEllipsoid(0.1, 0.2, 0.3), pin.SE3.Identity(), "shoulder")
    with pytest.raises(InvalidValue, match="joint shoulder is a JointModelEllipsoid, whose axes turn"):
        Robot(model)
