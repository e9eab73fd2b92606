"""Jacobians of the textbook's arms as the text prints them, of all robots by differences, and their rates."""

from functools import cache

import numpy as np
import pinocchio as pin
import pytest

from taskopt import Configuration, InvalidValue, Robot, UnknownName, planar_arm, scara
from taskopt.kinematics.analysis.jacobians import (
    analytical_jacobian,
    analytical_jacobian_rate,
    geometric_jacobian,
    geometric_jacobian_rate,
    pose_rate_map,
)
from taskopt.kinematics.orientation import RPY, ZYZ, unskew
from taskopt.kinematics.robot.arms import ARMS

COUNTS = pytest.mark.parametrize("count", [200, pytest.param(10_000, marks=pytest.mark.slow)])
STEP = 1e-6  # [rad, m] of central differences
FRAMES = dict.fromkeys(ARMS, "tip") | {
    "panda": "panda_hand",
    "tiago": "arm_tool_link",
    "talos_reduced": "gripper_left_base_link",
}
CHAINS = sorted(set(ARMS) - {"parallelogram", "four_bar"})


@cache
def robot(name: str) -> Robot:
    """The robot of that name."""
    return Robot.load(name)


def random_q(of: Robot, rng: np.random.Generator) -> np.ndarray:
    """A posture that is generic in every coordinate."""
    return of.integrate(of.posture("middle"), rng.normal(size=of.nv), 1.0)


def dh_frames(of: Robot, q: np.ndarray) -> np.ndarray:
    """Frames 0 … n of an arm, (n + 1, 4, 4), by products of its Denavit–Hartenberg transforms."""
    frames = [np.eye(4)]
    at_zero = Configuration(of, np.zeros(of.nq))
    for i in range(1, of.nq + 1):
        before = np.eye(4) if i == 1 else at_zero.pose(f"link{i - 1}")
        A = np.linalg.inv(before) @ at_zero.pose(f"link{i}")
        motion, c, s = np.eye(4), np.cos(q[i - 1]), np.sin(q[i - 1])
        if of.coordinate_units[i - 1] == "m":
            motion[2, 3] = q[i - 1]
        else:
            motion[:2, :2] = [[c, -s], [s, c]]
        frames.append(frames[-1] @ motion @ A)
    return np.array(frames)


def columns(of: Robot, q: np.ndarray) -> np.ndarray:
    """The geometric Jacobian (6, n) by (3.30)."""
    frames, out = dh_frames(of, q), np.zeros((6, of.nq))
    for i in range(of.nq):
        z, arm = frames[i, :3, 2], frames[-1, :3, 3] - frames[i, :3, 3]
        if of.coordinate_units[i] == "m":
            out[:3, i] = z
        else:
            out[:3, i], out[3:, i] = np.cross(z, arm), z
    return out


@pytest.mark.equation("3.1", "3.27", "3.28", "3.29", "3.30", "3.31", "3.32", "3.33")
@pytest.mark.figure("3.2")
@pytest.mark.parametrize("name", CHAINS)
def test_columns_are_those_of_the_text(name: str) -> None:
    """Prismatic: (z, 0). Revolute: (z × (p_e − p), z). At 60 random postures and at the folded one."""
    of, rng = robot(name), np.random.default_rng(1)
    for q in [np.zeros(of.nq), *rng.uniform(-3.0, 3.0, size=(60, of.nq))]:
        at = Configuration(of, q)
        np.testing.assert_allclose(geometric_jacobian(at, "tip"), columns(of, q), atol=1e-12)
        np.testing.assert_allclose(at.pose("tip"), dh_frames(of, q)[-1], atol=1e-12)


@pytest.mark.equation("3.16", "3.17", "3.18", "3.19", "3.20", "3.21", "3.22", "3.23", "3.24", "3.25", "3.26")
@pytest.mark.figure("3.1")
@pytest.mark.parametrize("name", CHAINS)
def test_velocities_of_links_add_up_from_the_base(name: str) -> None:
    """The recursion from link to link gives the velocity of every link that its Jacobian gives."""
    of, rng = robot(name), np.random.default_rng(2)
    for q, v in rng.uniform(-2.0, 2.0, size=(50, 2, of.nq)):
        frames, at = dh_frames(of, q), Configuration(of, q)
        p_dot, omega = np.zeros(3), np.zeros(3)
        for i in range(of.nq):
            z, r = frames[i, :3, 2], frames[i + 1, :3, 3] - frames[i, :3, 3]
            slides = of.coordinate_units[i] == "m"
            omega = omega if slides else omega + v[i] * z
            p_dot = p_dot + np.cross(omega, r) + (v[i] * z if slides else 0.0)
            velocity = geometric_jacobian(at, f"link{i + 1}") @ v
            np.testing.assert_allclose(velocity, np.concatenate([p_dot, omega]), atol=1e-12)


@COUNTS
@pytest.mark.equation("3.35", "3.36")
def test_the_three_link_planar_arm(count: int) -> None:
    """(3.35) at 10⁴ random points; without the orientation, its first two rows (3.36)."""
    a1, a2, a3 = 0.5, 0.3, 0.2
    of, rng = planar_arm((a1, a2, a3)), np.random.default_rng(3)
    at = Configuration(of, np.zeros(3))
    for q in rng.uniform(-np.pi, np.pi, size=(count, 3)):
        s1, s12, s123 = np.sin(np.cumsum(q))
        c1, c12, c123 = np.cos(np.cumsum(q))
        text = np.zeros((6, 3))
        text[0] = [-a1 * s1 - a2 * s12 - a3 * s123, -a2 * s12 - a3 * s123, -a3 * s123]
        text[1] = [a1 * c1 + a2 * c12 + a3 * c123, a2 * c12 + a3 * c123, a3 * c123]
        text[5] = 1.0
        at.update(q)
        assert np.abs(geometric_jacobian(at, "tip") - text).max() < 1e-12


@COUNTS
@pytest.mark.equation("3.37", "3.38")
def test_the_anthropomorphic_arm(count: int) -> None:
    """(3.37) and its upper block (3.38) at 10⁴ random points; s₁ ω_y = −c₁ ω_x whatever the motion."""
    a2, a3 = 0.5, 0.5
    of, rng = robot("anthropomorphic"), np.random.default_rng(4)
    at = Configuration(of, np.zeros(3))
    for q in rng.uniform(-np.pi, np.pi, size=(count, 3)):
        s1, c1, s2, c2 = np.sin(q[0]), np.cos(q[0]), np.sin(q[1]), np.cos(q[1])
        s23, c23 = np.sin(q[1] + q[2]), np.cos(q[1] + q[2])
        reach = a2 * c2 + a3 * c23
        text = np.array(
            [
                [-s1 * reach, -c1 * (a2 * s2 + a3 * s23), -a3 * c1 * s23],
                [c1 * reach, -s1 * (a2 * s2 + a3 * s23), -a3 * s1 * s23],
                [0.0, reach, a3 * c23],
                [0.0, s1, s1],
                [0.0, -c1, -c1],
                [1.0, 0.0, 0.0],
            ]
        )
        at.update(q)
        J = geometric_jacobian(at, "tip")
        assert np.abs(J - text).max() < 1e-12
        assert np.abs(s1 * J[4] + c1 * J[3]).max() < 1e-12


@COUNTS
@pytest.mark.equation("3.40", "3.41")
def test_the_two_link_planar_arm(count: int) -> None:
    """(3.40) and its determinant a₁ a₂ s₂ (3.41) at 10⁴ random points."""
    a1, a2 = 0.7, 0.4
    of, rng = planar_arm((a1, a2)), np.random.default_rng(5)
    at = Configuration(of, np.zeros(2))
    for q in rng.uniform(-np.pi, np.pi, size=(count, 2)):
        (s1, s12), (c1, c12) = np.sin(np.cumsum(q)), np.cos(np.cumsum(q))
        text = [[-a1 * s1 - a2 * s12, -a2 * s12], [a1 * c1 + a2 * c12, a2 * c12]]
        at.update(q)
        J = geometric_jacobian(at, "tip")[:2]
        assert np.abs(J - text).max() < 1e-12
        assert abs(np.linalg.det(J) - a1 * a2 * np.sin(q[1])) < 1e-12


def test_the_stanford_manipulator() -> None:
    """Points and axes of Sect. 3.2.3, as printed, at 300 random points."""
    d2, d6 = 0.2, 0.1
    of, rng = robot("stanford"), np.random.default_rng(6)
    for q in rng.uniform(-np.pi, np.pi, size=(300, 6)):
        (s1, s2, _, s4, s5, _), (c1, c2, _, c4, c5, _), d3 = np.sin(q), np.cos(q), q[2]
        wrist = np.array([c1 * s2 * d3 - s1 * d2, s1 * s2 * d3 + c1 * d2, c2 * d3])
        z1 = np.array([-s1, c1, 0.0])
        z2 = z3 = np.array([c1 * s2, s1 * s2, c2])
        z4 = np.array([-c1 * c2 * s4 - s1 * c4, -s1 * c2 * s4 + c1 * c4, s2 * s4])
        z5 = np.array(
            [
                c1 * (c2 * c4 * s5 + s2 * c5) - s1 * s4 * s5,
                s1 * (c2 * c4 * s5 + s2 * c5) + c1 * s4 * s5,
                -s2 * c4 * s5 + c2 * c5,
            ]
        )
        tip, z0, zero = wrist + d6 * z5, np.array([0.0, 0.0, 1.0]), np.zeros(3)
        linear = [np.cross(z0, tip), np.cross(z1, tip), z2, *(np.cross(z, tip - wrist) for z in (z3, z4, z5))]
        text = np.vstack([np.column_stack(linear), np.column_stack([z0, z1, zero, z3, z4, z5])])
        np.testing.assert_allclose(geometric_jacobian(Configuration(of, q), "tip"), text, atol=1e-12)


@pytest.mark.slow
@pytest.mark.problem("3.2")
def test_the_cylindrical_arm() -> None:
    """p = (−d₃ s₁, d₃ c₁, d₂): columns (−d₃ c₁, −d₃ s₁, 0), z₀, (−s₁, c₁, 0); at d₃ = 0, too."""
    of, rng = robot("cylindrical"), np.random.default_rng(7)
    for q in [*rng.uniform(-2.0, 2.0, size=(1000, 3)), np.array([0.3, 0.5, 0.0])]:
        s, c, reach = np.sin(q[0]), np.cos(q[0]), q[2]
        J = np.zeros((6, 3))
        J[:3] = np.column_stack([[-reach * c, -reach * s, 0.0], [0.0, 0.0, 1.0], [-s, c, 0.0]])
        J[5, 0] = 1.0
        np.testing.assert_allclose(geometric_jacobian(Configuration(of, q), "tip"), J, atol=1e-12)


@pytest.mark.slow
@pytest.mark.problem("3.3")
def test_the_scara_manipulator() -> None:
    """Rows x, y as for two planar links, z of the quill, ω_z of the three revolute joints."""
    a1, a2, of, rng = 0.5, 0.4, scara(0.5, 0.4), np.random.default_rng(8)
    for q in rng.uniform(-np.pi, np.pi, size=(1000, 4)):
        (s1, s12), (c1, c12) = np.sin(np.cumsum(q[:2])), np.cos(np.cumsum(q[:2]))
        J = np.zeros((6, 4))
        J[0, :2], J[1, :2] = [-a1 * s1 - a2 * s12, -a2 * s12], [a1 * c1 + a2 * c12, a2 * c12]
        J[2, 2], J[5, [0, 1, 3]] = 1.0, 1.0
        at = Configuration(of, q)
        np.testing.assert_allclose(geometric_jacobian(at, "tip"), J, atol=1e-12)
        np.testing.assert_allclose(
            at.pose("tip")[:3, 3], [a1 * c1 + a2 * c12, a1 * s1 + a2 * s12, 1.0 + q[2]]
        )


@pytest.mark.equation("3.2", "3.3", "3.4", "3.5", "3.34", "3.39")
@pytest.mark.parametrize("name", sorted(FRAMES))
def test_velocities_of_any_point_in_any_frame(name: str) -> None:
    """(ṗ, ω) = J v by central differences of poses, for a point beside a link, along the axes of another."""
    of, frame, rng = robot(name), FRAMES[name], np.random.default_rng(9)
    for _ in range(20):
        q, v, point = random_q(of, rng), rng.normal(size=of.nv), rng.normal(size=3)
        at, other = Configuration(of, q), of.frames[int(rng.integers(len(of.frames)))]
        ahead, behind = (Configuration(of, of.integrate(q, v, s * STEP)).pose(frame) for s in (1.0, -1.0))
        p_dot = (ahead @ [*point, 1.0] - behind @ [*point, 1.0])[:3] / (2.0 * STEP)
        omega = unskew((ahead - behind)[:3, :3] / (2.0 * STEP) @ at.pose(frame)[:3, :3].T)
        tolerance = 1e-8 * max(1.0, float(np.abs(p_dot).max()))
        np.testing.assert_allclose(geometric_jacobian(at, frame, point) @ v, [*p_dot, *omega], atol=tolerance)
        R = at.pose(other)[:3, :3]
        turned = geometric_jacobian(at, frame, point, expressed_in=other) @ v
        np.testing.assert_allclose(turned, [*(R.T @ p_dot), *(R.T @ omega)], atol=tolerance)


@pytest.mark.equation("3.15", "3.16", "3.18", "3.20", "3.22", "3.23", "3.25", "3.26")
@pytest.mark.parametrize("name", ["panda", "tiago", "talos_reduced"])
def test_velocities_of_a_tree_add_up_from_the_base(name: str) -> None:
    """The recursion along the tree gives what Pinocchio's velocities and the Jacobian of each joint give.

    Poses and axes of the joints are Pinocchio's. A base that floats starts the recursion with its velocity,
    which is given along its own axes.
    """
    of, rng = robot(name), np.random.default_rng(12)
    model, data = of.model, of.model.createData()
    for _ in range(10):
        q, v = random_q(of, rng), rng.normal(size=of.nv)
        pin.forwardKinematics(model, data, q, v)
        at, p_dot, omega = Configuration(of, q), [np.zeros(3)], [np.zeros(3)]
        for i in range(1, model.njoints):
            parent, joint, place = model.parents[i], model.joints[i], data.oMi[i]
            R, local = (
                place.rotation,
                data.joints[i].S.reshape(6, -1) @ v[joint.idx_v : joint.idx_v + joint.nv],
            )
            r = place.translation - data.oMi[parent].translation
            omega.append(omega[parent] + R @ local[3:])
            p_dot.append(p_dot[parent] + np.cross(omega[parent], r) + R @ local[:3])
            recursion, twist = (
                np.concatenate([p_dot[i], omega[i]]),
                pin.getVelocity(model, data, i, pin.LOCAL_WORLD_ALIGNED).vector,
            )
            np.testing.assert_allclose(recursion, twist, atol=1e-12)
            np.testing.assert_allclose(geometric_jacobian(at, model.names[i]) @ v, twist, atol=1e-12)


@pytest.mark.equation("3.34")
@pytest.mark.parametrize("name", sorted(FRAMES))
def test_every_frame_carries_points_and_lends_its_axes(name: str) -> None:
    """For each frame of a robot, J^u against differences of positions and against Pinocchio's own axes.

    Along the axes of the frame itself and at its origin, it is the Jacobian that Pinocchio calls local.
    """
    of, rng = robot(name), np.random.default_rng(13)
    q, v, point = random_q(of, rng), rng.normal(size=of.nv), rng.normal(size=3)
    at, ahead, behind = (Configuration(of, of.integrate(q, v, s * STEP)) for s in (0.0, 1.0, -1.0))
    data = of.model.createData()
    pin.computeJointJacobians(of.model, data, q)
    for frame, other in zip(of.frames, reversed(of.frames), strict=True):
        own = pin.getFrameJacobian(of.model, data, of.model.getFrameId(frame), pin.LOCAL)
        np.testing.assert_allclose(geometric_jacobian(at, frame, expressed_in=frame), own, atol=1e-12)
        p_dot = ((ahead.pose(frame) - behind.pose(frame)) @ [*point, 1.0])[:3] / (2.0 * STEP)
        along = geometric_jacobian(at, frame, point, expressed_in=other)[:3] @ v
        tolerance = 1e-8 * max(1.0, float(np.abs(p_dot).max()))
        np.testing.assert_allclose(along, at.pose(other)[:3, :3].T @ p_dot, atol=tolerance)


@pytest.mark.equation("3.98")
@pytest.mark.parametrize("name", sorted(FRAMES))
def test_the_rate_of_the_jacobian(name: str) -> None:
    """J̇ by central differences of J along a motion, for a point beside the frame."""
    of, frame, rng = robot(name), FRAMES[name], np.random.default_rng(10)
    for _ in range(10):
        q, v, point = random_q(of, rng), rng.normal(size=of.nv), 0.3 * rng.normal(size=3)
        rate = geometric_jacobian_rate(Configuration(of, q), frame, v, point)
        ahead, behind = (
            geometric_jacobian(Configuration(of, of.integrate(q, v, s * STEP)), frame, point)
            for s in (1.0, -1.0)
        )
        np.testing.assert_allclose(rate, (ahead - behind) / (2.0 * STEP), atol=1e-7)


@pytest.mark.equation("3.60", "3.61", "3.62", "3.63", "3.65", "3.66")
@pytest.mark.parametrize("angles", [ZYZ, RPY], ids=lambda angles: angles.name)
@pytest.mark.parametrize("name", ["spherical_wrist", "stanford", "panda", "tiago", "talos_reduced"])
def test_the_analytical_jacobian_is_the_derivative_of_the_angles(name: str, angles) -> None:
    """(ṗ, φ̇) = J_A v by central differences of the pose in angles, J = T_A J_A, and J̇_A likewise."""
    of, frame, rng = robot(name), FRAMES[name], np.random.default_rng(11)
    for _ in range(10):
        q, v = random_q(of, rng), rng.normal(size=of.nv)
        at = Configuration(of, q)
        phi = angles.angles(at.pose(frame)[:3, :3])
        if abs(angles.determinant(phi)) < 0.2:
            q = of.integrate(q, rng.normal(size=of.nv), 0.3)
            at = Configuration(of, q)
            phi = angles.angles(at.pose(frame)[:3, :3])
        sides = [Configuration(of, of.integrate(q, v, s * STEP)) for s in (1.0, -1.0)]
        ahead, behind = (
            np.concatenate([side.pose(frame)[:3, 3], angles.angles(side.pose(frame)[:3, :3], near=phi)])
            for side in sides
        )
        J_A, scale = analytical_jacobian(at, frame, angles), 1.0 / abs(angles.determinant(phi)) ** 3
        np.testing.assert_allclose(J_A @ v, (ahead - behind) / (2.0 * STEP), atol=1e-8 * scale)
        np.testing.assert_allclose(pose_rate_map(angles, phi) @ J_A, at.jacobian(frame), atol=1e-12)
        difference = (
            analytical_jacobian(sides[0], frame, angles) - analytical_jacobian(sides[1], frame, angles)
        ) / (2.0 * STEP)
        np.testing.assert_allclose(
            analytical_jacobian_rate(at, frame, angles, v), difference, atol=1e-7 * scale
        )


def test_the_planar_arm_has_one_jacobian() -> None:
    """Where all rotations are about one axis, J_A is J without its null rows (end of Sect. 3.6)."""
    of = robot("planar3")
    at = Configuration(of, [0.3, 0.7, -0.4])
    np.testing.assert_allclose(
        analytical_jacobian(at, "tip", RPY), geometric_jacobian(at, "tip")[[0, 1, 2, 5, 3, 4]]
    )


def test_what_cannot_be_computed_is_named() -> None:
    """A frame that is not there, a point of two numbers, a representation singularity."""
    at = Configuration(robot("anthropomorphic"), [0.1, 0.2, 0.3])
    with pytest.raises(UnknownName, match="tipp"):
        geometric_jacobian(at, "tipp")
    with pytest.raises(InvalidValue, match="point must have shape 3"):
        geometric_jacobian(at, "tip", point=[1.0, 2.0])
    with pytest.raises(InvalidValue, match="v must have shape 3, got 2"):
        geometric_jacobian_rate(at, "tip", [1.0, 2.0])
    flat = Configuration(robot("planar3"), [0.1, 0.2, 0.3])
    with pytest.raises(InvalidValue, match="representation singularity, sin ϑ = 0"):
        analytical_jacobian(flat, "tip", ZYZ)
