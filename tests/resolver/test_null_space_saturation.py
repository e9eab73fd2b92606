"""Saturation in the null space: the box is kept, and the scale factors are those of linear programming."""

import numpy as np
import pytest
from scipy.optimize import linprog

from taskopt import Hierarchy, InvalidValue, Level, Status
from taskopt.resolver.null_space_saturation import NullSpaceSaturation, saturated
from taskopt.resolver.registry import resolve
from taskopt.testing import check_resolver


def largest_scale(A: np.ndarray, b: np.ndarray, reach: np.ndarray) -> float:
    """The largest s ≤ 1 for which some x in the box has A x = s b, by SciPy's linear programming."""
    n = A.shape[1]
    bounds = [*zip(-reach, reach, strict=True), (0.0, 1.0)]
    cost, rows = [0.0] * n + [-1.0], np.column_stack([A, -b])
    found = linprog(cost, A_eq=rows, b_eq=np.zeros(len(b)), bounds=bounds)
    return float(found.x[-1])


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(3, 7)), 3.0 * rng.normal(size=3), rng.uniform(0.2, 1.0, 7)


def test_without_bounds_it_is_task_priority() -> None:
    """Two levels of a random problem, as the pseudo-inverse has them."""
    rng = np.random.default_rng(1)
    problem = Hierarchy([Level(rng.normal(size=(3, 7)), [1, 2, 3]), Level(np.eye(7), rng.normal(size=7))])
    answer = resolve(problem, "sns")
    np.testing.assert_allclose(answer.x, resolve(problem, "pinv").x, atol=1e-12)
    assert answer.notes == ()
    assert answer.status is Status.FORMULA


@pytest.mark.slow
def test_the_direction_is_kept_and_the_scale_is_nearly_the_largest() -> None:
    """A x = s b exactly; s never exceeds that of linear programming, and mostly reaches it."""
    reached = []
    for seed in range(60):
        A, b, reach = drawn(seed)
        level = saturated(A, b, np.zeros(7), np.eye(7), (-reach, reach))
        most = largest_scale(A, b, reach)
        np.testing.assert_allclose(A @ level.x, level.scale * b, atol=1e-9)
        assert (np.abs(level.x) <= reach).all()
        assert level.scale <= most + 1e-9
        reached.append(level.scale > 0.9 * most)
    assert np.mean(reached) > 0.8


def test_it_reaches_more_than_scaling_the_pseudo_inverse() -> None:
    """Where the pseudo-inverse breaks a bound, the other joints take over."""
    gained = 0
    for seed in range(30):
        A, b, reach = drawn(seed)
        x = np.linalg.pinv(A) @ b
        plain = min(1.0, float((reach / np.abs(x)).min()))
        level = saturated(A, b, np.zeros(7), np.eye(7), (-reach, reach))
        assert level.scale >= plain - 1e-12
        gained += level.scale > 1.1 * plain
    assert gained > 15


def test_a_lower_level_does_not_disturb_the_one_before() -> None:
    """The first level is met as it is alone, and the notes say what was scaled."""
    for seed in range(20):
        A, b, reach = drawn(seed)
        levels = [Level(A, b), Level(np.eye(7), np.full(7, 5.0))]
        alone = resolve(Hierarchy(levels[:1], box=(-reach, reach)), "sns")
        both = resolve(Hierarchy(levels, box=(-reach, reach)), "sns")
        np.testing.assert_allclose(A @ both.x, A @ alone.x, atol=1e-8)
        assert (np.abs(both.x) <= reach).all()
        assert both.notes[-1].startswith("Level 2 is scaled by 0")
    weighted = resolve(Hierarchy(levels, box=(-reach, reach)), "wqp/daqp")  # which does disturb it
    assert np.abs(A @ weighted.x - A @ alone.x).max() > 1e-8


def test_what_it_does_not_know_is_refused() -> None:
    """Inequalities, hard rows, another norm; and a box that no answer keeps has none."""
    A = np.ones((1, 2))
    with pytest.raises(InvalidValue, match="sns is a closed form and knows no inequality"):
        resolve(Hierarchy([Level(A, lower=[0.0])]), "sns")
    with pytest.raises(InvalidValue, match="no hard row"):
        resolve(Hierarchy([Level(A, [1.0])], limits=Level(A, upper=[1.0])), "sns")
    with pytest.raises(InvalidValue, match="no norm but the identity"):
        resolve(Hierarchy([Level(A, [1.0])], norm=[1.0, 2.0]), "sns")
    answer = resolve(Hierarchy([Level([[1.0, 0.0]], [0.0])], box=([-1.0, 0.5], [1.0, 1.0])), "sns")
    assert answer.status in (Status.FAILED, Status.FORMULA)
    assert answer.status is Status.FAILED or answer.x[1] >= 0.5


def test_it_keeps_the_contract_of_a_resolver() -> None:
    """Status, memory and repeatability, as for every resolver that is not strict."""
    check_resolver(NullSpaceSaturation())
