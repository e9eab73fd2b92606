"""One row for an objective: what it asks for, and that what it asks for is kept."""

import numpy as np
import pytest

from taskopt import JointRange, JointVelocityLimit, Manipulability, PositionTask, Scenario, Stack
from taskopt.errors import InvalidValue
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.task import ObjectiveTask
from taskopt.loop.run import run
from taskopt.resolver.registry import resolver
from tests.helpers.moving import bound
from tests.helpers.robots import FRAMES, generic_q, robot


@pytest.mark.parametrize("name", FRAMES)
def test_the_row_is_the_gradient_with_the_rate_that_is_left(name: str) -> None:
    """∇w·v ≥ K (w_min − w), no bound above; w_min below w leaves room, above it asks for the way back."""
    of = robot(name)
    at = Configuration(of, generic_q(of, 0))
    w = JointRange()
    for least, lack in ((w.value(at) - 0.1, 0.0), (w.value(at) + 0.1, 0.1)):
        task, rows = bound(ObjectiveTask(w, at_least=least, gain=3.0), at)
        np.testing.assert_array_equal(rows.A[0], w.gradient(at))
        np.testing.assert_allclose(rows.lower, 3.0 * (least - w.value(at)))
        assert rows.upper[0] == np.inf
        np.testing.assert_allclose(task.error, [lack], atol=1e-12)


@pytest.mark.slow
def test_an_objective_that_comes_first_is_kept_where_the_path_would_spoil_it() -> None:
    """Above the path, w stays above w_min to what one Euler step loses; below it, it does not."""
    of = robot("planar")
    w = Manipulability("tip", axes="xy")
    q0 = [0.2, 1.2, 0.4]
    least = w.value(Configuration(of, np.array(q0))) - 0.05
    keep = ObjectiveTask(w, at_least=least, gain=10.0)
    pull = PositionTask("tip", target=[1.45, 0.0, 0.0], gain=8.0, axes="xy")
    smallest = []
    for levels in ([[keep], [pull]], [[pull], [keep]]):
        made = Scenario(robot=of, q0=q0, stack=Stack(levels, [JointVelocityLimit()]), duration=1.0)
        steps = run(made, resolver("active-set"))
        smallest.append(min(w.value(Configuration(of, step.q)) for step in steps))
    assert smallest[0] > least - 1e-4  # second order of one step at 2 rad/s
    assert smallest[1] < least - 0.02


def test_senseless_declarations_are_refused() -> None:
    """What is no objective, a value that is no number, a negative gain."""
    with pytest.raises(InvalidValue, match="objective must derive"):
        ObjectiveTask(lambda q: 0.0, at_least=0.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidValue, match="at_least"):
        ObjectiveTask(JointRange(), at_least=np.nan)
    with pytest.raises(InvalidValue, match="gain"):
        ObjectiveTask(JointRange(), at_least=0.0, gain=-1.0)
