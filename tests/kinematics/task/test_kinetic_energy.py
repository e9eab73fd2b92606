"""Least kinetic energy: the rows cost what Pinocchio says, and the answer is the inverse that M weighs."""

import numpy as np
import pinocchio as pin
import pytest

from taskopt import (
    Configuration,
    InvalidValue,
    KineticEnergyTask,
    PositionTask,
    Stack,
    planar_arm,
    resolve,
)
from taskopt.testing import check_task
from tests.helpers.moving import bound
from tests.helpers.robots import generic_q, robot

NAMES = ("panda", "tiago", "talos_reduced")


@pytest.mark.parametrize("name", NAMES)
def test_the_task_keeps_the_contract(name):
    """Names, sizes, compiled and Python rows, and the weight."""
    check_task(KineticEnergyTask(0.5), robot(name), count=4)


@pytest.mark.parametrize("name", NAMES)
def test_the_rows_cost_the_kinetic_energy(name):
    """½ ‖A v‖² is the energy by Pinocchio, which does not use the mass matrix for it."""
    of = robot(name)
    q = generic_q(of, 0)
    at = Configuration(of, q)
    jacobians = at.joint_jacobians.copy()
    _, rows = bound(KineticEnergyTask(), at)
    np.testing.assert_array_equal(at.joint_jacobians, jacobians)
    for v in np.random.default_rng(1).normal(size=(4, of.nv)):
        energy = pin.computeKineticEnergy(of.model, of.model.createData(), q, v)
        assert 0.5 * float((rows.A @ v) @ (rows.A @ v)) == pytest.approx(energy, rel=1e-10)


def test_half_of_a_mass_matrix_is_caught(monkeypatch):
    """The check above fails if only one triangle of M is filled."""
    real = Configuration.mass_matrix
    monkeypatch.setattr(Configuration, "mass_matrix", lambda self: np.diag(np.diag(real(self))))
    with pytest.raises(AssertionError):
        test_the_rows_cost_the_kinetic_energy("panda")


@pytest.mark.parametrize("resolver", ["pinv", "active-set", "hqp/daqp"])
def test_below_a_task_it_is_the_dynamically_consistent_inverse(resolver):
    """v = M⁻¹ Jᵀ (J M⁻¹ Jᵀ)⁻¹ b."""
    of = robot("panda")
    at = Configuration(of, generic_q(of, 2))
    goal = at.pose("panda_hand")[:3, 3] + [0.1, -0.1, 0.2]
    reach = PositionTask("panda_hand", target=goal, gain=2.0)
    v = resolve(Stack([[reach], [KineticEnergyTask()]]).at(at, dt=1e-3), resolver).x
    J, M = at.jacobian("panda_hand")[:3], pin.crba(of.model, of.model.createData(), at.q)
    M = np.triu(M) + np.triu(M, 1).T
    weighted = np.linalg.solve(M, J.T)
    expected = weighted @ np.linalg.solve(J @ weighted, [0.2, -0.2, 0.4])
    np.testing.assert_allclose(v, expected, atol=1e-8)


def test_what_makes_no_sense_is_refused():
    """Negative weights, and a robot without mass."""
    with pytest.raises(InvalidValue, match="weight must be"):
        KineticEnergyTask(-1.0)
    with pytest.raises(InvalidValue, match="needs masses"):
        KineticEnergyTask().bind(planar_arm(), "t")
