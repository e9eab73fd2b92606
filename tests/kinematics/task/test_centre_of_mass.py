"""The task of the centre of mass."""

import numpy as np
import pytest

from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.target import Function
from taskopt.kinematics.task import CentreOfMassTask
from tests.helpers.moving import bound
from tests.helpers.robots import generic_q, robot


@pytest.mark.parametrize("name", ["panda", "tiago", "talos_reduced"])
def test_its_rows_are_the_derivative_of_the_centre_of_mass(name):
    """A = ∂c/∂q by central differences on the manifold, and b = ċ_d + K (c_d − c)."""
    of = robot(name)
    at = Configuration(of, generic_q(of, 1))
    goal, drift = np.array([0.1, -0.2, 0.7]), np.array([0.3, 0.1, -0.2])
    task, rows = bound(CentreOfMassTask(Function(lambda t: goal + t * drift, lambda _: drift), gain=3.0), at)
    here = at.centre_of_mass()[0]
    np.testing.assert_allclose(rows.lower, drift + 3.0 * (goal - here), rtol=0, atol=1e-12)
    np.testing.assert_allclose(task.error, goal - here, rtol=0, atol=1e-12)
    step = 1e-6
    for j in range(of.nv):
        ends = []
        for sign in (1.0, -1.0):
            moved = of.integrate(at.q, sign * step * np.eye(of.nv)[j], 1.0)
            ends.append(Configuration(of, moved).centre_of_mass()[0])
        np.testing.assert_allclose(rows.A[:, j], (ends[0] - ends[1]) / (2 * step), rtol=0, atol=1e-8)


def test_it_takes_the_axes_that_are_asked_for():
    """Two rows for "xy", with their own names and weights."""
    of = robot("talos_reduced")
    task, rows = bound(
        CentreOfMassTask(axes="xy", weight=[1.0, 2.0, 3.0]), Configuration(of, generic_q(of, 2))
    )
    assert task.row_names == ("x", "y")
    assert rows.A.shape == (2, of.nv)
    np.testing.assert_array_equal(task.weight, [1.0, 2.0])


def test_a_robot_without_mass_is_refused():
    """An arm made from Denavit–Hartenberg rows has no centre of mass."""
    with pytest.raises(InvalidValue, match="planar3 has none"):
        CentreOfMassTask().bind(robot("planar"), "centre of mass")
