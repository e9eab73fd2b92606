"""The benchmark of strictness: cases are what they are said to be, and methods differ as the theory says."""

from io import StringIO

import numpy as np
from rich.console import Console

from taskopt import Hierarchy, Level
from taskopt.bench.strictness import METHODS, in_one_qp, measure, table
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.regret import level_residuals


def test_strict_levels_give_nothing_away_where_weights_and_projected_costs_do() -> None:
    """Level 1 is met to 1e-9 by strict levels alone; the smaller the weight, the smaller the regret."""
    *_, methods = measure(40)
    worst = {method.name: max(method.residual) for method in methods}
    assert worst["strict"] < 1e-9
    assert not any(method.fallbacks for method in methods)
    for kind in ("projected", "soft"):
        assert worst[f"{kind}, w = 0.01"] > worst[f"{kind}, w = 0.0001"] > 1e-4
    for method in methods:
        np.testing.assert_allclose(np.array(method.regret)[:, 0], method.residual, atol=1e-9)
    text = StringIO()
    Console(file=text, width=150).print(table(methods))
    assert all(name in text.getvalue() for name in METHODS)
    assert "[mm/s]" in text.getvalue()


def test_without_an_active_limit_the_projected_cost_is_strict_too() -> None:
    """That is why it passes for strict: it has regret only where a bound binds."""
    rng = np.random.default_rng(0)
    levels = [Level(rng.normal(size=(m, 5)), rng.normal(size=m)) for m in (2, 5)]
    wide = Hierarchy(levels, box=(-np.full(5, 1e6), np.full(5, 1e6)))
    projected, *_, soft = in_one_qp(wide)
    assert level_residuals(wide, ActiveSet()(projected)[0].x)[0] < 1e-9
    assert level_residuals(wide, ActiveSet()(soft)[0].x)[0] > 1e-6
