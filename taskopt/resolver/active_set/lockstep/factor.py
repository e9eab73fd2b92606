"""Cholesky factors in lock-step, and the error of what is solved with them.

With a computed factor L, K = L Lᵀ − E and |E_ab| ≤ g √(K_aa K_bb), where g collects the rounding of K and of
its factorisation. With d = √diag(K), ‖L⁻¹ E L⁻ᵀ‖ ≤ m g ‖L⁻¹ d‖_F² = θ. If θ ≤ 0.1, the solution of K y = σ is

    |y_a| ≤ ‖L⁻¹ e_a‖ ‖|L⁻¹| |σ|‖ / (1 − θ).

`ENLARGED` covers 1/(1 − θ), and the rounding of L⁻¹ and of the bounds themselves.

Source: Higham (2002), "Accuracy and Stability of Numerical Algorithms", Theorems 8.5 and 10.3.
"""

from taskopt.arrays import Array
from taskopt.hierarchy.tolerances import FAST_PATH_PIVOT, LARGEST_DEFECT
from taskopt.jit import kernel
from taskopt.jit.pack import load, root, size, spread, store, where_less

ENLARGED = 1.25
ROUNDING = 2.0**-52  # twice the relative error of one operation
INFINITE = float("inf")


@kernel
def factorise(extra: Array, S: Array, L: Array, diagonal: Array, shape: tuple[int, int]) -> Array:
    """Factorise K = S Sᵀ + diag(extra) into L Lᵀ with an inverted diagonal.

    Args:
        extra: (≥ m, 8).
        S: (m n, 8), row by row.
        L: (m m, 8) receives the factor; only its lower triangle is written.
        diagonal: (≥ m, 8) receives the diagonal of K.
        shape: m and n.

    Returns:
        1 where all pivots are sound, else 0.
    """
    m, n = shape
    sound = spread(1.0)
    for a in range(m):
        for b in range(a + 1):
            total = spread(0.0)
            for j in range(n):
                total = total + load(S, a * n + j) * load(S, b * n + j)
            store(L, a * m + b, total)
        store(diagonal, a, load(L, a * m + a) + load(extra, a))
        store(L, a * m + a, load(diagonal, a))
    for b in range(m):
        pivot = load(L, b * m + b)
        for c in range(b):
            pivot = pivot - load(L, b * m + c) * load(L, b * m + c)
        least = FAST_PATH_PIVOT * load(diagonal, b)
        sound = where_less(least, pivot, sound, 0.0)
        inverse = 1.0 / root(where_less(least, pivot, pivot, 1.0))
        store(L, b * m + b, inverse)
        for a in range(b + 1, m):
            total = load(L, a * m + b)
            for c in range(b):
                total = total - load(L, a * m + c) * load(L, b * m + c)
            store(L, a * m + b, total * inverse)
    return sound


@kernel
def solve(L: Array, step: Array, m: int) -> None:
    """Replace the right-hand side by the solution of L Lᵀ y = b.

    Args:
        L: Factor as `factorise` left it.
        step: (≥ m, 8) right-hand side, overwritten by the solution.
        m: Size of the factor.
    """
    for a in range(m):
        total = load(step, a)
        for c in range(a):
            total = total - load(L, a * m + c) * load(step, c)
        store(step, a, total * load(L, a * m + a))
    for a in range(m - 1, -1, -1):
        total = load(step, a)
        for c in range(a + 1, m):
            total = total - load(L, c * m + a) * load(step, c)
        store(step, a, total * load(L, a * m + a))


@kernel
def invert(L: Array, inverse: Array, diagonal: Array, m: int, g: float) -> Array:
    """Write L⁻¹.

    Args:
        L: Factor as `factorise` left it.
        inverse: (m m, 8) receives the lower triangle of the inverse.
        diagonal: Diagonal of K.
        m: Size of the factor.
        g: Rounding of K and of its factor, relative to √(K_aa K_bb).

    Returns:
        1 where θ is small enough for bounds, else 0.
    """
    total = spread(0.0)
    for b in range(m):
        store(inverse, b * m + b, load(L, b * m + b))
        squares = load(L, b * m + b) * load(L, b * m + b)
        for a in range(b + 1, m):
            entry = load(L, a * m + b) * load(inverse, b * m + b)
            for c in range(b + 1, a):
                entry = entry + load(L, a * m + c) * load(inverse, c * m + b)
            entry = -entry * load(L, a * m + a)
            store(inverse, a * m + b, entry)
            squares = squares + entry * entry
        total = total + squares * load(diagonal, b)
    return where_less((m * g) * total, LARGEST_DEFECT, 1.0, 0.0)


@kernel
def bound_solution(inverse: Array, step: Array, m: int) -> None:
    """Replace bounds on the right-hand side by bounds on the solution of K y = σ.

    Args:
        inverse: L⁻¹.
        step: (≥ m, 8) bounds on |σ|, overwritten by those on |y|.
        m: Size of the factor.
    """
    squares = spread(0.0)
    for a in range(m):
        total = spread(0.0)
        for b in range(a + 1):
            total = total + size(load(inverse, a * m + b)) * load(step, b)
        squares = squares + total * total
    for a in range(m):
        total = spread(0.0)
        for b in range(a, m):
            total = total + load(inverse, b * m + a) * load(inverse, b * m + a)
        store(step, a, ENLARGED * (root(total) * root(squares)))
