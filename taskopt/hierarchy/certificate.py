"""The certificate of an answer: a bound on its error, and the KKT residuals of every level as detail.

The bound comes from `taskopt.hierarchy.proof`, and is computed when it is asked for. KKT residuals are
relative to the largest row of their level; they tell where an answer fails, and bound no error of x.

x is lexicographically optimal if for each level k there are multipliers y_k of the box, the hard rows and the
rows of all levels before k with

    stationarity     A_kᵀ w_k d_k(x) + Σ_{i before k} y_ki a_i + y_k,box = 0
    primal           box and hard rows hold
    dual             y > 0 only at an upper bound, y < 0 only at a lower one
    complementarity  min(|y|, distance to the bound) = 0,

where the multiplier of a row is *sign-free*, that is, may have either sign, if the row is an equality, if it
is violated (a later level must keep the violation, not reduce it), or if it had a multiplier of the right
sign at an earlier level. The last level is the norm, with gradient W x.

Source: Escande, Mansard and Wieber (2014), Int. J. Robotics Research 33(7), Sect. 3; Dimitrov, Sherikov and
Wieber (2015), Sect. 2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Judgement, Verdict, judge
from taskopt.hierarchy.tolerances import CERTAIN_MULTIPLIER, CERTIFICATE_ROUNDING, KKT_MET
from taskopt.hierarchy.view import RESIDUAL_KINDS, Rows, view_rows
from taskopt.jit import kernel, kernel_apart

RESIDUALS = ("stationarity", "primal", "dual", "complementarity")  # the columns of `Certificate.residuals`
PRIMAL = RESIDUALS.index("primal")


@dataclass(frozen=True, eq=False)
class Certificate:
    """A bound on the error of an answer, and its KKT residuals level by level.

    Each residual is relative. Stationarity and multipliers are divided by the scale of their level, which is
    the largest term of its own gradient and at least w ‖a‖² max(1, |x|) of its rows. Violations are divided
    by the largest term of their row.

    Attributes:
        residuals: (levels + 1, 4), columns as in `RESIDUALS`; the last row belongs to the norm.
        judging: Function that judges the answer when it is first asked for.
    """

    residuals: Array
    judging: Callable[[], Judgement] | None = None

    @cached_property
    def judgement(self) -> Judgement:
        """The judgement by the distance from the exact optimum, see `taskopt.hierarchy.proof`."""
        if self.judging is None:
            raise InvalidValue(
                "this certificate was made of residuals alone; certify(hierarchy, x, multipliers) and the "
                "certificate of a resolution have an error bound"
            )
        return self.judging()

    @property
    def error_bound(self) -> Array:
        """Upper bound on |x − x*| for the exact optimum x*, entry by entry, (n,), in the unit of x."""
        return self.judgement.error_bound

    @property
    def verdict(self) -> Verdict:
        """Whether x is proven, proven on a condition, refuted, or undecided."""
        return self.judgement.verdict

    @cached_property
    def worst(self) -> float:
        """The largest residual; inf if the answer is not finite."""
        worst = float(self.residuals.max())
        return worst if np.isfinite(worst) else np.inf

    @property
    def worst_name(self) -> str:
        """Name of the largest residual and of its level, such as 'dual of level 2'."""
        level, kind = np.unravel_index(int(np.argmax(self.residuals)), self.residuals.shape)
        name = f"level {level + 1}" if level + 1 < len(self.residuals) else "the norm"
        return f"{RESIDUALS[kind]} of {name}"

    @property
    def broken_limit(self) -> float:
        """The largest violation of the box and the hard rows, relative to the largest term of the row."""
        return float(self.residuals[:, PRIMAL].max())

    def kkt_met(self, tolerance: float = KKT_MET) -> bool:
        """Return True if no KKT residual exceeds the tolerance, which proves nothing about the error of x.

        Args:
            tolerance: Largest residual.

        Returns:
            True if x and the multipliers meet the KKT conditions up to that.
        """
        return self.worst <= tolerance

    def __str__(self) -> str:
        return f"worst residual {self.worst:.1e} ({self.worst_name})"


def certify(hierarchy: Hierarchy, x: Array, multipliers: Array) -> Certificate:
    """Compute the certificate of x with given multipliers, from any resolver or from another source.

    If only x is known, use `certify_velocity`, which finds multipliers.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,).
        multipliers: Multipliers (levels + 1, n + M): one line for each level, that of the norm last; in each
            line those of the box first, then those of the rows. Multipliers of a level for its own rows or
            for later rows are ignored.

    Returns:
        The certificate.
    """
    residuals = np.empty((hierarchy.layout.level_count + 1, RESIDUAL_KINDS))
    certify_kernel(
        hierarchy.buffer,
        hierarchy.norm.copy().ravel(),
        hierarchy.layout.offsets,
        hierarchy.layout.columns,
        np.ascontiguousarray(x, dtype=np.float64),
        np.ascontiguousarray(multipliers, dtype=np.float64),
        residuals,
    )
    return Certificate(residuals, partial(judge, hierarchy.copy(), np.array(x, dtype=np.float64)))


def broken_limit(layout: Layout, buffer: Array, x: Array) -> float:
    """Return the largest violation of the box and the hard rows, as of `Certificate`, without multipliers.

    Args:
        layout: Layout of the problem.
        buffer: Flat buffer of the problem, see `taskopt.hierarchy.view`.
        x: The unknowns, (n,).

    Returns:
        The violation, relative to the largest term of its row; inf if a number is NaN.
    """
    return float(broken_limit_kernel(buffer, layout.offsets, layout.columns, x))


class _Judged(NamedTuple):
    """The quantities of each row that the certificate is computed from.

    Attributes:
        value: A x, (M,).
        force: w d, the derivative of ½ w d² by the row's value, (M,); 0 for hard rows and rows that are met.
        size: Euclidean norm of each row, 1 for a row of zeros, (M,).
        sign_free: True for bounds and rows whose multiplier may have either sign, (n + M,).
    """

    value: Array
    force: Array
    size: Array
    sign_free: Mask


@kernel_apart
def certify_kernel(
    buffer: Array, norm: Array, offsets: IntArray, columns: IntArray, x: Array, y: Array, out: Array
) -> float:
    """Write the residuals of x and y into `out`, and return the largest, or inf if a number is NaN.

    Args:
        buffer: Flat buffer of the hierarchy (see `view`).
        norm: W, (n,) or row by row (n · n,).
        offsets: First rows of the levels, (levels + 2,).
        columns: Index of the unit vector that a row is, or −1, (M,); see `Layout.columns`.
        x: The unknowns, (n,).
        y: Multipliers, (levels + 1, n + M).
        out: Receives the residuals, (levels + 1, 4).

    Returns:
        The largest residual.
    """
    n, levels = x.size, offsets.size - 2
    rows = view_rows(buffer, n, norm, offsets, columns)
    # Memory allocated here is known to overlap with nothing, which makes these loops ten times faster.
    count = columns.size
    work = np.empty(3 * count + n)
    judged = _Judged(
        work[:count],
        work[count : 2 * count],
        work[2 * count : 3 * count],
        np.empty(n + count, dtype=np.bool_),
    )
    gradient, reach = work[3 * count :], max(1.0, largest_entry(x))
    primal = _feasibility(rows, x, judged)
    worst = 0.0
    for k in range(levels + 1):
        scale = _level_gradient(rows, judged, k, x, reach, y[k], gradient)
        residual = largest_entry(gradient)
        dual, complementarity = _signs_of_level(rows, judged, k, x, y[k], scale, residual)
        _free_violated_rows(rows, judged, k, reach, scale, residual)
        out[k, 0], out[k, 1] = residual * (1.0 / scale), primal
        out[k, 2], out[k, 3] = dual, complementarity
        for kind in range(RESIDUAL_KINDS):
            if np.isnan(out[k, kind]):
                out[k, kind] = np.inf
            worst = max(worst, out[k, kind])
    return worst


@kernel_apart
def broken_limit_kernel(buffer: Array, offsets: IntArray, columns: IntArray, x: Array) -> float:
    """Return the largest relative violation of the box and the hard rows at x, or inf if a number is NaN.

    Args:
        buffer: As of `certify_kernel`.
        offsets: As of `certify_kernel`.
        columns: As of `certify_kernel`.
        x: As of `certify_kernel`.

    Returns:
        The violation, in the `primal` column of `RESIDUALS`.
    """
    rows = view_rows(buffer, x.size, x, offsets, columns)
    work = np.empty((3, columns.size))
    judged = _Judged(work[0], work[1], work[2], np.empty(x.size + columns.size, dtype=np.bool_))
    primal = _feasibility(rows, x, judged)
    return np.inf if np.isnan(primal) else primal


@kernel
def _feasibility(rows: Rows, x: Array, judged: _Judged) -> float:
    """Fill `judged`, and return the worst relative violation of the box and the hard rows."""
    n, hard = x.size, rows.offsets[1]
    primal, missing = 0.0, False
    for j in range(n):
        gap = max(rows.box_lower[j] - x[j], x[j] - rows.box_upper[j])
        primal = max(primal, gap / max(1.0, abs(x[j])))
        judged.sign_free[j] = rows.box_lower[j] >= rows.box_upper[j]  # crossed by rounding
        missing |= np.isnan(x[j])
    for i in range(rows.lower.size):
        if rows.columns[i] >= 0:
            judged.value[i], judged.size[i] = x[rows.columns[i]], 1.0
        else:
            total, squares = 0.0, 0.0
            for j in range(n):
                total += rows.A[i, j] * x[j]
                squares += rows.A[i, j] * rows.A[i, j]
            judged.value[i], judged.size[i] = total, np.sqrt(squares) if squares > 0.0 else 1.0
        value = judged.value[i]
        gap = max(rows.lower[i] - value, value - rows.upper[i])
        missing |= np.isnan(gap)
        judged.force[i] = 0.0
        judged.sign_free[n + i] = rows.lower[i] >= rows.upper[i]
        if i < hard:
            primal = max(primal, gap / max(judged.size[i], _largest_term(rows.A, i, x)))
        elif gap > 0.0:
            judged.force[i] = rows.weight[i] * (gap if value > rows.upper[i] else -gap)
    return np.inf if missing else primal


@kernel
def _largest_term(A: Array, i: int, x: Array) -> float:
    """Return max_j |A_ij x_j|."""
    largest = 0.0
    for j in range(x.size):
        largest = max(largest, abs(A[i, j] * x[j]))
    return largest


@kernel
def _level_gradient(
    rows: Rows, judged: _Judged, k: int, x: Array, reach: float, y: Array, gradient: Array
) -> float:
    """Fill `gradient` with the stationarity of level k, (n,), and return the scale of the level.

    The scale is the largest term of the level's own gradient, and at least the size of that gradient for an x
    of size `reach` = max(1, |x|). Multipliers do not enter, since two large ones that cancel would make every
    residual look small.
    """
    n, levels, scale = x.size, rows.offsets.size - 2, 0.0
    own, end = rows.offsets[k + 1], rows.offsets[min(k + 2, levels + 1)]
    gradient[:] = 0.0
    if k == levels:
        diagonal = rows.norm.size == n
        for j in range(n):
            entry = rows.norm[j] if diagonal else rows.norm[j * n + j]
            gradient[j] = rows.norm[j] * x[j] if diagonal else rows.norm[j * n : (j + 1) * n] @ x
            scale = max(scale, abs(gradient[j]), entry * reach)
    for i in range(own, end):
        size = judged.size[i]
        scale = max(scale, abs(judged.force[i]) * size, rows.weight[i] * size * size * reach)
    for j in range(n):
        gradient[j] += y[j]
    for i in range(end):
        force = y[n + i] if i < own else judged.force[i]
        if force == 0.0:
            continue
        if rows.columns[i] >= 0:
            gradient[rows.columns[i]] += force
        else:
            for j in range(n):
                gradient[j] += force * rows.A[i, j]
    return scale if scale > 0.0 else 1.0


@kernel
def _signs_of_level(
    rows: Rows, judged: _Judged, k: int, x: Array, y: Array, scale: float, residual: float
) -> tuple[float, float]:
    """Return the worst dual and complementarity residuals of level k, relative to its scale.

    A multiplier of the right sign makes its bound sign-free for the levels after k if it is certain, which
    means larger than rounding and than the remaining stationarity.
    """
    n, inverse = x.size, 1.0 / scale
    certain = max(CERTIFICATE_ROUNDING * scale, CERTAIN_MULTIPLIER * residual)
    dual, complementarity = 0.0, 0.0
    for j in range(n):
        if y[j] != 0.0 and not judged.sign_free[j]:
            wrong, slack = _sign(y[j] * inverse, x[j], rows.box_lower[j], rows.box_upper[j])
            dual, complementarity = max(dual, wrong), max(complementarity, slack)
            judged.sign_free[j] = wrong == 0.0 and abs(y[j]) > certain
    for i in range(rows.offsets[k + 1]):
        if y[n + i] != 0.0 and not judged.sign_free[n + i]:
            force, unit = y[n + i] * judged.size[i], 1.0 / judged.size[i]
            wrong, slack = _sign(
                force * inverse, judged.value[i] * unit, rows.lower[i] * unit, rows.upper[i] * unit
            )
            dual, complementarity = max(dual, wrong), max(complementarity, slack)
            judged.sign_free[n + i] = wrong == 0.0 and abs(force) > certain
    return dual, complementarity


@kernel
def _free_violated_rows(
    rows: Rows, judged: _Judged, k: int, reach: float, scale: float, residual: float
) -> None:
    """Make rows of level k that are certainly violated sign-free for the levels after it."""
    n, levels = rows.box_lower.size, rows.offsets.size - 2
    certain = max(CERTIFICATE_ROUNDING * scale, CERTAIN_MULTIPLIER * residual)
    for i in range(rows.offsets[k + 1], rows.offsets[min(k + 2, levels + 1)]):
        if judged.force[i] != 0.0:
            gap = max(rows.lower[i] - judged.value[i], judged.value[i] - rows.upper[i])
            violated = gap > CERTIFICATE_ROUNDING * judged.size[i] * reach
            judged.sign_free[n + i] |= violated and abs(judged.force[i]) * judged.size[i] > certain


@kernel
def largest_entry(x: Array) -> float:
    """Return max |x_j|, or NaN if an entry is NaN.

    The bits of positive floats, read as integers, have the same order as the floats, and those of NaN are the
    largest. Integers are compared because the compiler vectorises that.

    Args:
        x: Vector, (n,).

    Returns:
        The largest magnitude.
    """
    bits = np.int64(0)
    for j in range(x.size):
        bits = max(bits, np.float64(abs(x[j])).view(np.int64))
    return np.int64(bits).view(np.float64)


@kernel
def _sign(y: float, value: float, lower: float, upper: float) -> tuple[float, float]:
    """Return the part of y that has the wrong sign, and min(|y|, distance to the nearer bound).

    The residual is the minimum and not the product, since a product of 1e-14 may hide a distance of 1e-7.
    """
    to_lower, to_upper = abs(value - lower), abs(upper - value)
    wrong = max(-y, 0.0) if to_upper <= to_lower else max(y, 0.0)
    return wrong, min(abs(y), min(to_lower, to_upper) / max(1.0, abs(value)))
