"""Kernels that scale a program to unit size, and examine the answer to it; see `solver_accuracy`.

A program of unit size is in u = (x − free) / size with rows of length one, where `free` is the optimum
without any bound. It has no linear term, and its bounds are a pair of arrays (2, m + n), lower and upper, of
the rows first and then of the unknowns.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import (
    DIVERGED,
    OUT_OF_REACH,
    ROUNDING_SHARE,
    SMALLEST_VELOCITY,
    SOLVER_SHARE,
)
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed

Linear = tuple[Array, Array, Array, Array, Array, Array]  # g, C, and bounds: lower, upper, of x lower, upper
Unit = tuple[Array, Array, Array, Array]  # free optimum, lengths of rows, rows of length one, all bounds
Numbers = tuple[Array, Array, Array]  # x, y, y_box

FINE = 0  # the answer is as accurate as was asked for
FAR = 1  # it breaks a bound that was left out
COARSE = 2  # it misses the accuracy, or is no number


@kernel_apart
def scale_program(H: Array, given: Linear, unit: Unit, near: Array) -> tuple[float, float]:
    """Write a program with a diagonal H at unit size.

    Args:
        H: Hessian, diagonal and positive, (n, n).
        given: g (n,), C (m, n), lower (m,), upper (m,), box_lower (n,), box_upper (n,).
        unit: Filled: the free optimum (n,), the lengths of the rows (≥ m,), the rows of length one (≥ m, n),
            and all bounds (2, ≥ m + n).
        near: (2, ≥ m + n) filled with the bounds within reach, and with ±inf for the others.

    Returns:
        The size, which is the largest distance of the free optimum to an interval, and 0.0 if it is inside
        all of them; and the least of 1 and the entries of H.
    """
    (g, C, lower, upper, box_lower, box_upper), (free, length, rows, bounds) = given, unit
    n, m = g.size, lower.size
    least, outside, numbers = 1.0, 0.0, True
    for j in range(n):
        least = min(least, H[j, j])
        free[j] = -g[j] / H[j, j]
        bounds[0, m + j], bounds[1, m + j] = box_lower[j] - free[j], box_upper[j] - free[j]
    for i in range(m):
        squares, value = 0.0, 0.0
        for j in range(n):
            squares += C[i, j] * C[i, j]
            value += C[i, j] * free[j]
        length[i] = np.sqrt(squares) if squares > 0.0 else 1.0
        bounds[0, i], bounds[1, i] = (lower[i] - value) / length[i], (upper[i] - value) / length[i]
        for j in range(n):
            rows[i, j] = C[i, j] / length[i]
    for i in range(m + n):
        outside = max(outside, bounds[0, i], -bounds[1, i])
        numbers &= bounds[0, i] == bounds[0, i] and bounds[1, i] == bounds[1, i]
    if not (outside > 0.0 and numbers):
        return 0.0, least
    size = max(outside, SMALLEST_VELOCITY)
    for side in range(2):
        for i in range(m + n):
            bounds[side, i] /= size
            out_of_reach = abs(bounds[side, i]) > OUT_OF_REACH
            near[side, i] = (2.0 * side - 1.0) * np.inf if out_of_reach else bounds[side, i]
    return size, least


@kernel_apart
def examine_answer(
    H: Array, unit: Unit, near: Array, size: float, found: Numbers, wanted: tuple[float, Array],
    answer: Numbers,
) -> int:  # fmt: skip
    """Turn an answer at unit size back, and decide if it is as accurate as was asked for.

    Args:
        H: As of `scale_program`.
        unit: As of `scale_program`.
        near: The bounds with which the program was solved, (2, m + n).
        size: As of `scale_program`.
        found: x (n,), y (m,) and y_box (n,) of the solver.
        wanted: The accuracy asked for, inf if all numbers will do; and the matrix of the entries for which it
            is asked, (p, q) with q ≤ n, which has no rows if it is asked for x itself.
        answer: Filled with x, y and y_box in the units of the given program.

    Returns:
        FINE, FAR or COARSE. An answer is FINE if `taskopt.resolver.refinement.refined` would return it as it
        is, and claim it: its natural residual is then below the tolerance of the solver, or below rounding.
        An answer with a number of the size DIVERGED is COARSE.
    """
    free, length, rows, bounds = borrowed(unit[0]), borrowed(unit[1]), borrowed(unit[2]), borrowed(unit[3])
    u, y, y_box = borrowed(found[0]), borrowed(found[1]), borrowed(found[2])
    x, given_y, given_y_box = borrowed(answer[0]), borrowed(answer[1]), borrowed(answer[2])
    H, near = borrowed(H), borrowed(near)
    n, m, numbers, far, slope = u.size, y.size, True, False, np.empty(u.size)
    for i in range(n):
        slope[i] = H[i, i] * u[i] + y_box[i]
        x[i] = free[i] + size * u[i]
        given_y_box[i] = size * y_box[i]
        numbers &= abs(u[i]) < DIVERGED and abs(y_box[i]) < DIVERGED
        far |= _breaks(u[i], bounds, near, m + i)
    off = 0.0
    least = _least(H)
    for i in range(m):
        value = 0.0
        for j in range(n):
            value += rows[i, j] * u[j]
            slope[j] += rows[i, j] * y[i]
        given_y[i] = size * y[i] / length[i]
        numbers &= abs(y[i]) < DIVERGED
        far |= _breaks(value, bounds, near, i)
        off = max(off, _off(value, y[i] / least, bounds, i))
    if not numbers:
        return COARSE
    if far:
        return FAR
    if wanted[0] == np.inf:
        return FINE
    for j in range(n):
        off = max(off, _off(u[j], y_box[j] / least, bounds, m + j))
        off = max(off, abs(slope[j]) / H[j, j])
    accuracy = error_at_unit_size(wanted[0], size, wanted[1], x)
    return FINE if off <= min(max(SOLVER_SHARE * accuracy, ROUNDING_SHARE / least), accuracy) else COARSE


@kernel
def _least(H: Array) -> float:
    """Return the least of 1 and the diagonal of H."""
    least = 1.0
    for j in range(H.shape[0]):
        least = min(least, H[j, j])
    return least


@kernel
def _breaks(value: float, bounds: Array, near: Array, i: int) -> bool:
    """Return True if a value is outside bounds that were left out."""
    below = value < bounds[0, i] and near[0, i] == -np.inf
    return bool(below or (value > bounds[1, i] and near[1, i] == np.inf))


@kernel
def _off(value: float, step: float, bounds: Array, i: int) -> float:
    """Return the distance of a value from its projection after a step."""
    return abs(value - min(max(value + step, bounds[0, i]), bounds[1, i]))


@kernel
def error_at_unit_size(accuracy: float, size: float, entries: Array, x: Array) -> float:
    """Return the error at unit size that a relative accuracy allows.

    Args:
        accuracy: Accuracy relative to the largest entry, or to one if that is more.
        size: As of `scale_program`.
        entries: Matrix of the entries for which it is asked, (p, q), without rows for x itself.
        x: The answer, (n,).

    Returns:
        The error, at most the accuracy.
    """
    largest, gain = 1.0, 1.0
    if entries.shape[0] > 0:
        gain = 0.0
        for i in range(entries.shape[0]):
            total, terms = 0.0, 0.0
            for j in range(entries.shape[1]):
                total += entries[i, j] * x[j]
                terms += abs(entries[i, j])
            largest, gain = max(largest, abs(total)), max(gain, terms)
    else:
        for j in range(x.size):
            largest = max(largest, abs(x[j]))
    return accuracy * min(1.0, largest / (gain * size))
