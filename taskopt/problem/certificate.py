"""The proof of an answer: KKT residuals of every level, computed on the declared rows.

x is lexicographically optimal if for each level k there are multipliers y_k of the box, the hard
rows and the rows of all levels before k with

    stationarity     A_kᵀ w_k d_k(x) + Σ_{i before k} y_ki a_i + y_k,box = 0
    primal           box and hard rows hold
    dual             y > 0 only at an upper bound, y < 0 only at a lower one
    complementarity  y = 0 where no bound is met: min(|y|, distance) = 0

where a row that is an equality, that is violated (so frozen at its violation), or that had a
strictly right-signed multiplier at an earlier level may have either sign. The last level is the
norm, with gradient W x. Escande, Mansard and Wieber (2014), Sect. 3; Dimitrov, Sherikov and
Wieber (2015), Sect. 2.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taskopt.arrays import Array
from taskopt.jit import kernel
from taskopt.problem.hierarchy import Hierarchy

RESIDUALS = ("stationarity", "primal", "dual", "complementarity")
TOLERANCE = 1e-8  # a residual above it is not a proof
_AT_BOUND = 1e-9  # a multiplier or violation below it (relative) decides nothing


@dataclass(frozen=True, eq=False)
class Certificate:
    """KKT residuals, (levels + 1, 4), the last row for the norm; each relative to max(1, largest term)."""

    residuals: Array

    @cached_property
    def worst(self) -> float:
        """The largest residual of all; inf where the answer is not a number."""
        worst = float(self.residuals.max())
        return worst if np.isfinite(worst) else np.inf

    @property
    def worst_name(self) -> str:
        """Which residual of which level is the largest, such as 'dual of level 2'."""
        level, kind = np.unravel_index(int(np.argmax(self.residuals)), self.residuals.shape)
        rank = f"level {level + 1}" if level + 1 < len(self.residuals) else "the norm"
        return f"{RESIDUALS[kind]} of {rank}"

    def proves(self, tolerance: float = TOLERANCE) -> bool:
        """Whether every residual is at most `tolerance`."""
        return self.worst <= tolerance

    def __str__(self) -> str:
        return f"worst residual {self.worst:.1e} ({self.worst_name})"


def certify(hierarchy: Hierarchy, x: Array, multipliers: Array) -> Certificate:
    """Certificate of x with its multipliers, (levels + 1, n + M): box first, then rows.

    A multiplier of a level's own or a later row is not looked at. Any resolver's answer, or
    somebody else's, can be certified; `taskopt.problem.multipliers` finds multipliers for a bare x.
    """
    residuals = np.empty((hierarchy.layout.level_count + 1, len(RESIDUALS)))
    certify_kernel(
        hierarchy.buffer,
        hierarchy.norm.ravel(),
        hierarchy.layout.offsets,
        hierarchy.layout.columns,
        np.ascontiguousarray(x, dtype=np.float64),
        np.ascontiguousarray(multipliers, dtype=np.float64),
        residuals,
    )
    return Certificate(residuals)


@kernel
def certify_kernel(buffer, norm, offsets, columns, x, y, out):
    """Fill `out` (levels + 1, 4) with the residuals of (x, y); the formula is the module's."""
    n, rows, levels = x.size, offsets[-1], offsets.size - 2
    A = buffer[: rows * n].reshape((rows, n))
    bounds = buffer[rows * n :]
    lower, upper, weight = bounds[:rows], bounds[rows : 2 * rows], bounds[2 * rows : 3 * rows]
    box_lower, box_upper = bounds[3 * rows : 3 * rows + n], bounds[3 * rows + n : 3 * rows + 2 * n]
    settled, work = np.zeros(n + rows, dtype=np.bool_), np.empty(rows + n)
    value, gradient = work[:rows], work[rows:]
    primal = _feasibility(A, lower, upper, box_lower, box_upper, offsets, columns, x, value, settled)
    for k in range(levels + 1):
        own = offsets[k + 1]
        largest = _gradient(A, lower, upper, weight, norm, offsets, columns, k, x, value, y[k], gradient)
        stationarity, dual, complementarity = 0.0, 0.0, 0.0
        for j in range(n):
            stationarity = max(stationarity, abs(gradient[j]))
            wrong, slack = _sign(y[k, j] / largest, x[j], box_lower[j], box_upper[j], settled[j])
            dual, complementarity = max(dual, wrong), max(complementarity, slack)
            settled[j] |= wrong == 0.0 and abs(y[k, j]) > _AT_BOUND * largest
        for i in range(own):
            if y[k, n + i] != 0.0 and not settled[n + i]:
                wrong, slack = _sign(y[k, n + i] / largest, value[i], lower[i], upper[i], False)
                dual, complementarity = max(dual, wrong), max(complementarity, slack)
                settled[n + i] = wrong == 0.0 and abs(y[k, n + i]) > _AT_BOUND * largest
        out[k, 0] = stationarity / largest
        out[k, 1] = primal
        out[k, 2] = dual
        out[k, 3] = complementarity
        for residual in range(4):
            if np.isnan(out[k, residual]):
                out[k, residual] = np.inf


@kernel
def _feasibility(A, lower, upper, box_lower, box_upper, offsets, columns, x, value, settled):
    """A x into `value`; rows whose multiplier may have either sign into `settled`; the worst violation."""
    n = x.size
    primal, missing = 0.0, False
    for j in range(n):
        gap = max(box_lower[j] - x[j], x[j] - box_upper[j])
        primal = max(primal, gap / max(1.0, abs(x[j])))
        settled[j] = box_lower[j] == box_upper[j]
        missing |= np.isnan(x[j])
    for i in range(lower.size):
        scale = 1.0
        if columns[i] >= 0:
            value[i] = x[columns[i]]
        else:
            total = 0.0
            for j in range(n):
                term = A[i, j] * x[j]
                total += term
                scale = max(scale, abs(term))
            value[i] = total
        gap = max(lower[i] - value[i], value[i] - upper[i])
        missing |= np.isnan(gap)
        settled[n + i] = lower[i] == upper[i]
        if i < offsets[1]:
            primal = max(primal, gap / scale)
        else:
            settled[n + i] |= gap > _AT_BOUND * scale
    return np.inf if missing else primal


@kernel
def _gradient(A, lower, upper, weight, norm, offsets, columns, k, x, value, y, gradient):
    """Own gradient of level k plus multipliers times rows, into `gradient` (n,); the largest term."""
    n, levels = x.size, offsets.size - 2
    own, end = offsets[k + 1], offsets[min(k + 2, levels + 1)]
    largest = 1.0
    for j in range(n):
        gradient[j] = y[j]
        largest = max(largest, abs(y[j]))
        if k == levels:
            term = norm[j] * x[j] if norm.size == n else norm[j * n : (j + 1) * n] @ x
            gradient[j] += term
            largest = max(largest, abs(term))
    for i in range(end):
        if i < own:
            factor = y[n + i]
        else:
            factor = weight[i] * (value[i] - min(max(value[i], lower[i]), upper[i]))
        if factor == 0.0:
            continue
        if columns[i] >= 0:
            gradient[columns[i]] += factor
            largest = max(largest, abs(factor))
        else:
            for j in range(n):
                term = factor * A[i, j]
                gradient[j] += term
                largest = max(largest, abs(term))
    return largest


@kernel
def _sign(y, value, lower, upper, settled):
    """How far the sign of y (relative to its level) is wrong, and min(|y|, distance to the nearer bound).

    The minimum, not the product: a product of 1e-14 may hide a distance of 1e-7.
    """
    if y == 0.0 or settled:
        return 0.0, 0.0
    to_lower, to_upper = abs(value - lower), abs(upper - value)
    wrong = max(-y, 0.0) if to_upper <= to_lower else max(y, 0.0)
    return wrong, min(abs(y), min(to_lower, to_upper) / max(1.0, abs(value)))
