"""Sums and products of enclosures in double-double arithmetic, compiled.

A double-double number is an unevaluated sum high + low of two doubles with |low| ≤ u |high|, u = 2⁻⁵³. An
enclosure is an array (3, …) of high, low and a radius: the exact number lies within `radius` of high + low.
Each operation adds its own rounding error to the radius, so that the result encloses the exact result.

Source: Joldes, Muller and Popescu (2017), ACM Trans. Mathematical Software 44(2), Algorithms 6 and 10, the
first with a relative error of at most 3u²/(1 − 4u); `docs/certificate.md` derives 8u² for the second. Dekker
(1971), Numerische Mathematik 18, for the exact product.
"""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import ROUNDED_UP, SMALLEST_PRODUCT, UNDERFLOW, UNIT_OF_PAIRS
from taskopt.jit import kernel_exact

_SPLITTER = 134217729.0  # 2²⁷ + 1 cuts a double into two halves of 26 bits


@kernel_exact
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b rounded, and the exact error of that.

    Args:
        a: A number.
        b: A number.

    Returns:
        s and e with s + e = a + b exactly.

    Source:
        Knuth (1998), The Art of Computer Programming, vol. 2, Sect. 4.2.2.
    """
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


@kernel_exact
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b rounded, and the exact error of that unless it underflows.

    Args:
        a: A number of magnitude below 1e300.
        b: A number of magnitude below 1e300.

    Returns:
        p and e with p + e = a b.

    Source:
        Dekker (1971), Sect. 5.
    """
    p = a * b
    wide = _SPLITTER * a
    a_high = wide - (wide - a)
    wide = _SPLITTER * b
    b_high = wide - (wide - b)
    a_low, b_low = a - a_high, b - b_high
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


@kernel_exact
def add_pairs(a: float, a_low: float, b: float, b_low: float) -> tuple[float, float]:
    """Return the sum of two double-double numbers, with a relative error of at most 3u²/(1 − 4u).

    Args:
        a: Upper part of the first number.
        a_low: Its lower part.
        b: Upper part of the second number.
        b_low: Its lower part.

    Returns:
        The two parts of the sum.

    Source:
        Joldes, Muller and Popescu (2017), Algorithm 6.
    """
    s, s_low = two_sum(a, b)
    t, t_low = two_sum(a_low, b_low)
    c = s_low + t
    v = s + c
    w = t_low + (c - (v - s))
    high = v + w
    return high, w - (high - v)


@kernel_exact
def multiply_pairs(a: float, a_low: float, b: float, b_low: float) -> tuple[float, float]:
    """Return the product of two double-double numbers, with a relative error of at most 8u² (1 + 20u).

    Args:
        a: Upper part of the first number.
        a_low: Its lower part.
        b: Upper part of the second number.
        b_low: Its lower part.

    Returns:
        The two parts of the product.

    Source:
        Joldes, Muller and Popescu (2017), Algorithm 10.
    """
    p, p_low = two_product(a, b)
    low = p_low + (a * b_low + a_low * b)
    high = p + low
    return high, low - (high - p)


@kernel_exact
def add_arrays(a: Array, b: Array) -> Array:
    """Add enclosures entry by entry.

    Args:
        a: Enclosures, (3, N).
        b: Enclosures, (3, N).

    Returns:
        Enclosures of the sums, (3, N).
    """
    out = np.empty(a.shape)
    for i in range(a.shape[1]):
        high, low = add_pairs(a[0, i], a[1, i], b[0, i], b[1, i])
        out[0, i], out[1, i] = high, low
        out[2, i] = ROUNDED_UP * (a[2, i] + b[2, i] + UNIT_OF_PAIRS * abs(high))
    return out


@kernel_exact
def _error_of_product(a_low: float, b_low: float, product: float) -> float:
    """Return a bound on the rounding error of a product of pairs: none for doubles, but for underflow."""
    error = 0.0 if a_low == 0.0 and b_low == 0.0 else UNIT_OF_PAIRS * abs(product)
    return error if abs(product) > SMALLEST_PRODUCT else error + UNDERFLOW


@kernel_exact
def multiply_arrays(a: Array, b: Array) -> Array:
    """Multiply enclosures entry by entry.

    Args:
        a: Enclosures, (3, N).
        b: Enclosures, (3, N).

    Returns:
        Enclosures of the products, (3, N).
    """
    out = np.empty(a.shape)
    for i in range(a.shape[1]):
        if (a[0, i] == 0.0 and a[2, i] == 0.0) or (b[0, i] == 0.0 and b[2, i] == 0.0):
            out[:, i] = 0.0
            continue
        high, low = multiply_pairs(a[0, i], a[1, i], b[0, i], b[1, i])
        out[0, i], out[1, i] = high, low
        radius = abs(a[0, i]) * b[2, i] + a[2, i] * (abs(b[0, i]) + b[2, i])
        out[2, i] = ROUNDED_UP * (radius + _error_of_product(a[1, i], b[1, i], high))
    return out


@kernel_exact
def multiply_matrices(a: Array, b: Array) -> Array:
    """Multiply two matrices of enclosures.

    The rounding error of a sum of p products, one after the other, is at most pε times the sum of
    the magnitudes of the products (docs/certificate.md), where ε bounds the relative error of one
    product and of one sum.

    Args:
        a: Enclosures, (3, m, p).
        b: Enclosures, (3, p, q).

    Returns:
        Enclosures of the product, (3, m, q).
    """
    m, p, q = a.shape[1], a.shape[2], b.shape[2]
    out = np.zeros((3, m, q))
    gamma = p * UNIT_OF_PAIRS * ROUNDED_UP
    for i in range(m):
        for j in range(q):
            high, low, size, radius, terms = 0.0, 0.0, 0.0, 0.0, 0
            for k in range(p):
                if (a[0, i, k] == 0.0 and a[2, i, k] == 0.0) or (b[0, k, j] == 0.0 and b[2, k, j] == 0.0):
                    continue  # exactly zero
                term, term_low = multiply_pairs(a[0, i, k], a[1, i, k], b[0, k, j], b[1, k, j])
                high, low = add_pairs(high, low, term, term_low)
                size += abs(term)
                terms += 1
                radius += abs(a[0, i, k]) * b[2, k, j] + a[2, i, k] * (abs(b[0, k, j]) + b[2, k, j])
                radius += _error_of_product(a[1, i, k], b[1, k, j], term)
            out[0, i, j], out[1, i, j] = high, low
            # The error of a product of pairs is counted twice where there is a sum of them.
            out[2, i, j] = ROUNDED_UP * (radius + (gamma * size if terms > 1 else 0.0))
    return out


@kernel_exact
def two_sum_arrays(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the sums of two matrices, rounded, and the exact errors of that.

    Args:
        a: Numbers, (m, p).
        b: Numbers, (m, p).

    Returns:
        Sums and errors, (m, p) each.
    """
    high, low = np.empty(a.shape), np.empty(a.shape)
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            high[i, j], low[i, j] = two_sum(a[i, j], b[i, j])
    return high, low
