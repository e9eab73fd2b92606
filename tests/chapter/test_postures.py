"""Postures for writing and throwing (Figs 3.26 and 3.27): what the ratios do along the run."""

from pathlib import Path

import numpy as np
import pytest

from taskopt import load_scenario, run

TASKS = Path(__file__).parents[2] / "tasks"
LINKS = np.array([0.5, 0.5, 0.3])


def position_jacobian(q: np.ndarray) -> np.ndarray:
    """J_P (2, 3) of the three-link arm, (3.36)."""
    a = np.cumsum(q)
    rows = np.array([-LINKS * np.sin(a), LINKS * np.cos(a)])
    return np.cumsum(rows[:, ::-1], axis=1)[:, ::-1]


def ratios(q: np.ndarray) -> tuple[float, float]:
    """α along y (3.127) and β along x (3.128), from M = J Jᵀ and its inverse."""
    M = position_jacobian(q) @ position_jacobian(q).T
    return float(M[1, 1] ** -0.5), float(np.linalg.inv(M)[0, 0] ** -0.5)


@pytest.mark.slow
@pytest.mark.figure("3.26", "3.27")
@pytest.mark.equation("3.127", "3.128")
@pytest.mark.parametrize(("name", "sense"), [("writing", -1.0), ("throwing", 1.0)])
def test_the_posture_suits_its_task(name: str, sense: float) -> None:
    """The tip stays in place; what the second level climbs never falls; the major axes lie as the text says.

    Writing: velocity upright and force level. Throwing: velocity level and force upright.
    """
    q = np.array([step.q.copy() for step in run(load_scenario(TASKS / f"{name}.py"))])
    tips = np.array([(LINKS * np.exp(1j * np.cumsum(row))).sum() for row in q])
    assert np.abs(tips - tips[0]).max() < 1e-5
    w = np.array([sense * (0.2 * alpha + beta) for alpha, beta in map(ratios, q)])
    assert (np.diff(w) > -1e-9).all()
    assert w[-1] > w[0] + 0.03
    major = np.linalg.svd(position_jacobian(q[-1]))[0][:, 0]
    upright = abs(major[1]) > np.cos(np.deg2rad(25.0))
    level = abs(major[0]) > np.cos(np.deg2rad(25.0))
    assert upright if name == "writing" else level
