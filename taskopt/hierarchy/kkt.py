"""How far a solution of one quadratic program is from optimal, computed by us."""

import numpy as np

from taskopt.hierarchy.qp import QuadraticProgram, Solution


def kkt_residuals(qp: QuadraticProgram, solution: Solution) -> tuple[float, float, float, float]:
    """Stationarity, primal, dual, complementarity; each relative to max(1, largest term summed)."""
    if not all(np.isfinite(part).all() for part in (solution.x, solution.y, solution.y_box)):
        return np.inf, np.inf, np.inf, np.inf
    C = np.vstack([qp.C, np.eye(qp.n)])
    lower, upper = np.concatenate([qp.lower, qp.box_lower]), np.concatenate([qp.upper, qp.box_upper])
    y = np.concatenate([solution.y, solution.y_box])
    terms = np.column_stack([qp.H * solution.x, qp.g, (C * y[:, None]).T])
    scale = max(1.0, float(np.abs(terms).max()))
    value = C @ solution.x
    size = np.maximum(1.0, np.abs(C * solution.x).max(axis=1))
    outside = np.maximum(np.maximum(lower - value, value - upper), 0.0) / size
    missing = np.where(y > 0.0, upper == np.inf, (y < 0.0) & (lower == -np.inf))
    nearest = np.where(y > 0.0, np.where(upper == np.inf, 0.0, upper), np.where(lower == -np.inf, 0.0, lower))
    distance = np.where((y == 0.0) | missing, 0.0, np.abs(value - nearest)) / size
    return (
        float(np.abs(terms.sum(axis=1)).max()) / scale,
        float(outside.max(initial=0.0)),
        float(np.abs(y * missing).max(initial=0.0)) / scale,
        float(np.abs(y * distance).max(initial=0.0)) / scale,
    )
