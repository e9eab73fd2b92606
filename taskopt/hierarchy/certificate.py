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
from taskopt.hierarchy.problem import Hierarchy
from taskopt.jit import kernel, kernel_apart

RESIDUALS = ("stationarity", "primal", "dual", "complementarity")
TOLERANCE = 1e-8  # a residual above it is not a proof
_DECIDES = 1e-13  # a multiplier or violation below it, relative to its level, is rounding
_SURE = 10.0  # and so is one below so many times the stationarity left at its level


@dataclass(frozen=True, eq=False)
class Certificate:
    """KKT residuals, (levels + 1, 4), the last row for the norm.

    Each is relative: stationarity and prices to the scale of their level (its own gradient's largest
    term, at least w ‖a‖² max(1, |x|) of its rows), violations to the largest term of their row.
    """

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
    somebody else's, can be certified; `taskopt.hierarchy.multipliers` finds multipliers for a bare x.
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


@kernel_apart
def certify_kernel(buffer, norm, offsets, columns, x, y, out):
    """Fill `out` (levels + 1, 4) with the residuals of (x, y), and return the worst, inf for NaN."""
    n, rows, levels = x.size, offsets[-1], offsets.size - 2
    A = buffer[: rows * n].reshape((rows, n))
    bounds = buffer[rows * n :]
    lower, upper, weight = bounds[:rows], bounds[rows : 2 * rows], bounds[2 * rows : 3 * rows]
    box_lower, box_upper = bounds[3 * rows : 3 * rows + n], bounds[3 * rows + n : 3 * rows + 2 * n]
    settled, work = np.empty(n + rows, dtype=np.bool_), np.empty(3 * rows + n)
    value, factor, size = work[:rows], work[rows : 2 * rows], work[2 * rows : 3 * rows]
    gradient, reach = work[3 * rows :], max(1.0, largest_entry(x))
    primal = _feasibility(
        A, lower, upper, weight, box_lower, box_upper, offsets, columns, x, value, factor, size, settled
    )
    worst = 0.0
    for k in range(levels + 1):
        own, end = offsets[k + 1], offsets[min(k + 2, levels + 1)]
        scale = _gradient(
            A, weight, factor, size, norm, columns, own, end, k == levels, x, reach, y[k], gradient
        )
        residual, inverse = largest_entry(gradient), 1.0 / scale
        counts = max(_DECIDES * scale, _SURE * residual)
        dual, complementarity = 0.0, 0.0
        for j in range(n):
            if y[k, j] != 0.0 and not settled[j]:
                wrong, slack = _sign(y[k, j] * inverse, x[j], box_lower[j], box_upper[j])
                dual, complementarity = max(dual, wrong), max(complementarity, slack)
                settled[j] = wrong == 0.0 and abs(y[k, j]) > counts
        for i in range(own):
            if y[k, n + i] != 0.0 and not settled[n + i]:
                price, unit = y[k, n + i] * size[i], 1.0 / size[i]
                wrong, slack = _sign(price * inverse, value[i] * unit, lower[i] * unit, upper[i] * unit)
                dual, complementarity = max(dual, wrong), max(complementarity, slack)
                settled[n + i] = wrong == 0.0 and abs(price) > counts
        for i in range(own, end):
            if factor[i] != 0.0:
                gap = max(lower[i] - value[i], value[i] - upper[i])
                settled[n + i] |= gap > _DECIDES * size[i] * reach and abs(factor[i]) * size[i] > counts
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = residual * inverse, primal, dual, complementarity
        for kind in range(4):
            if np.isnan(out[k, kind]):
                out[k, kind] = np.inf
            worst = max(worst, out[k, kind])
    return worst


@kernel
def _feasibility(
    A, lower, upper, weight, box_lower, box_upper, offsets, columns, x, value, factor, size, settled
):
    """A x into `value`, w d into `factor`, each row's norm into `size`, equalities into `settled`.

    Returns the worst violation of box and hard rows.
    """
    n = x.size
    primal, missing = 0.0, False
    for j in range(n):
        gap = max(box_lower[j] - x[j], x[j] - box_upper[j])
        primal = max(primal, gap / max(1.0, abs(x[j])))
        settled[j] = box_lower[j] == box_upper[j]
        missing |= np.isnan(x[j])
    for i in range(lower.size):
        if columns[i] >= 0:
            value[i], size[i] = x[columns[i]], 1.0
        else:
            total, squares = 0.0, 0.0
            for j in range(n):
                total += A[i, j] * x[j]
                squares += A[i, j] * A[i, j]
            value[i], size[i] = total, np.sqrt(squares) if squares > 0.0 else 1.0
        gap = max(lower[i] - value[i], value[i] - upper[i])
        missing |= np.isnan(gap)
        factor[i] = 0.0
        settled[n + i] = lower[i] == upper[i]
        if i < offsets[1]:
            primal = max(primal, gap / max(size[i], _largest_term(A, i, x)))
        elif gap > 0.0:
            factor[i] = weight[i] * (gap if value[i] > upper[i] else -gap)
    return np.inf if missing else primal


@kernel
def _largest_term(A, i, x):
    largest = 0.0
    for j in range(x.size):
        largest = max(largest, abs(A[i, j] * x[j]))
    return largest


@kernel
def _gradient(A, weight, factor, size, norm, columns, own, end, last, x, reach, y, gradient):
    """Gradient of a level plus multipliers times rows, into `gradient` (n,); returns the level's scale.

    The scale is what the level's own gradient is made of, and at least what its rows give for an x of
    size `reach`. Multipliers do not count: two that cancel would make anything look small.
    """
    n, scale = x.size, 0.0
    gradient[:] = 0.0
    for j in range(n if last else 0):
        gradient[j] = norm[j] * x[j] if norm.size == n else norm[j * n : (j + 1) * n] @ x
        scale = max(scale, abs(gradient[j]), (norm[j] if norm.size == n else norm[j * n + j]) * reach)
    for i in range(own, end):
        scale = max(scale, abs(factor[i]) * size[i], weight[i] * size[i] * size[i] * reach)
    for j in range(n):
        gradient[j] += y[j]
    for i in range(end):
        price = y[n + i] if i < own else factor[i]
        if price == 0.0:
            continue
        if columns[i] >= 0:
            gradient[columns[i]] += price
        else:
            for j in range(n):
                gradient[j] += price * A[i, j]
    return scale if scale > 0.0 else 1.0


@kernel
def largest_entry(x):
    """max |x_j|, NaN if there is one: bits of positive numbers are ordered as they are, and vectorise."""
    bits = np.int64(0)
    for j in range(x.size):
        bits = max(bits, np.float64(abs(x[j])).view(np.int64))
    return np.int64(bits).view(np.float64)


@kernel
def _sign(y, value, lower, upper):
    """How far the sign of y (relative to its level) is wrong, and min(|y|, distance to the nearer bound).

    The minimum, not the product: a product of 1e-14 may hide a distance of 1e-7.
    """
    to_lower, to_upper = abs(value - lower), abs(upper - value)
    wrong = max(-y, 0.0) if to_upper <= to_lower else max(y, 0.0)
    return wrong, min(abs(y), min(to_lower, to_upper) / max(1.0, abs(value)))
