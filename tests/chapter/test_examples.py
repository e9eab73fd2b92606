"""The examples of the chapter that no other test works through, named by number."""

import numpy as np
import pytest

from taskopt import Configuration, Controller, PositionTask, Robot, Stack, subspaces
from taskopt.kinematics.orientation import angle_axis, skew, unskew
from taskopt.kinematics.pose import exp3


@pytest.mark.example("3.1")
@pytest.mark.equation("3.6", "3.9")
def test_example_3_1_a_rotation_about_z() -> None:
    """Ṙ_z(α) R_z(α)ᵀ = S((0, 0, α̇)), with Ṙ as the text prints it."""
    for angle, rate in np.random.default_rng(1).normal(size=(100, 2)):
        s, c = np.sin(angle), np.cos(angle)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        R_dot = rate * np.array([[-s, -c, 0.0], [c, -s, 0.0], [0.0, 0.0, 0.0]])
        np.testing.assert_allclose(R_dot @ R.T, skew([0.0, 0.0, rate]), atol=1e-15)
        np.testing.assert_allclose(unskew(R_dot @ R.T), [0.0, 0.0, rate], atol=1e-15)


@pytest.mark.example("3.3")
@pytest.mark.figure("3.10")
def test_example_3_3_the_integral_of_omega_is_no_orientation() -> None:
    """Both laws have ∫ω dt = (π/2, π/2, 0), and end in orientations 120° apart."""
    laws = [[[np.pi / 2, 0.0, 0.0], [0.0, np.pi / 2, 0.0]], [[0.0, np.pi / 2, 0.0], [np.pi / 2, 0.0, 0.0]]]
    ends = []
    for first, second in laws:
        np.testing.assert_allclose(np.add(first, second), [np.pi / 2, np.pi / 2, 0.0])
        R, dt = np.eye(3), 1e-3
        for tick in range(2000):  # Ṙ = S(ω) R, ω along the axes of the world
            R = exp3(dt * np.array(first if tick < 1000 else second)) @ R
        ends.append(R)
    np.testing.assert_allclose(ends[0], [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(ends[1], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)
    assert angle_axis(ends[1] @ ends[0].T)[0] == pytest.approx(np.radians(120.0))


@pytest.mark.slow
@pytest.mark.example("3.4")
@pytest.mark.equation("3.38", "3.77")
@pytest.mark.figure("3.13")
def test_example_3_4_the_transpose_is_stuck_across_the_plane_of_the_arm() -> None:
    """At a shoulder singularity N(J_Pᵀ) is the normal of the arm's plane, ν_y/ν_x = −1/tan ϑ₁ and ν_z = 0.

    A target on that line leaves the arm stuck, and the resolution says so; resolvers that invert J stay, too.
    With a component in the plane it moves, and converges.
    """
    arm, q = Robot.load("anthropomorphic"), np.array([0.3, 0.7, np.pi - 1.4])
    at = Configuration(arm, q)
    null = subspaces(at.jacobian("tip")[:3]).null_of_transpose
    assert null.shape == (3, 1)
    assert null[1, 0] / null[0, 0] == pytest.approx(-1.0 / np.tan(0.3))
    assert null[2, 0] == pytest.approx(0.0, abs=1e-14)
    p, normal = at.pose("tip")[:3, 3], null[:, 0]
    stuck = Stack([[PositionTask("tip", target=p + 0.2 * normal, gain=10.0)]], damping=None)
    answer = Controller(arm, stuck, "transpose", 1e-3).step(q, 0.0)
    np.testing.assert_allclose(answer.v, 0.0, atol=1e-12)
    assert "The transposed Jacobian is stuck" in answer.explain()
    for name in ("pinv", "active-set"):
        np.testing.assert_allclose(Controller(arm, stuck, name, 1e-3).step(q, 0.0).v, 0.0, atol=1e-12)
    goal = p + 0.2 * normal + [0.0, 0.0, -0.1]
    free = Stack([[PositionTask("tip", target=goal, gain=10.0)]], damping=None)
    control = Controller(arm, free, "transpose", 1e-2)
    for tick in range(4000):
        q = arm.integrate(q, control.step(q, 1e-2 * tick).v, 1e-2)
    np.testing.assert_allclose(Configuration(arm, q).pose("tip")[:3, 3], goal, atol=1e-3)
