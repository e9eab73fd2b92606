"""What the kernels of lock-step share: records of arrays, and their memory."""

from typing import NamedTuple

from taskopt.arrays import Array, BoolArray, IntArray
from taskopt.jit import kernel
from taskopt.jit.pack import load, size, where_less
from taskopt.resolver.active_set.workspace import Held

LOWER, FREE, UPPER = float(Held.LOWER), float(Held.FREE), float(Held.UPPER)


class Cost(NamedTuple):
    """What all arms share: weights and sizes.

    Attributes:
        D: Weight of each column, (n,), all > 0.
        root: D^-½, (n,).
        slack: 1/w of rows that may keep a residual, 0 of all others, (m,).
        first: Weights of the rows of the first level, which come first in M; none if it is the last level,
            (k,).
    """

    D: Array
    root: Array
    slack: Array
    first: Array


class Watch(NamedTuple):
    """What all arms share of the test for a loss of rank, see `doubt`.

    Attributes:
        period: Δt [s], or 0 if no tick is to be damped, (1,).
        group: Number of the group of each curved row, from 1 on, 0 for a row that is not curved, (m,).
        weight: Weight of each row as a share of the least one of curved rows in its level, (m,).
        heaviest: Largest of these in the group of each row, (m,).
        counted: True for rows of B: curved ones, and all of the levels before the last curved one, (m,).
        base: Bounds of x that do not depend on the posture, (2, n).
        below: Weight of each column in the last level, (n,), or (0,) if there is none but the norm.
    """

    period: Array
    group: IntArray
    weight: Array
    heaviest: Array
    counted: BoolArray
    base: Array
    below: Array


class ArmRows(NamedTuple):
    """The numbers of eight hierarchies.

    Attributes:
        A: Rows M, (m n, 8), row by row.
        r: Their right-hand sides, (m, 8).
        x0: Targets of the columns, (n, 8).
        reach: At least D |x0|, with the rounding of x0, (n, 8).
        lower: Lower bounds, (n, 8).
        upper: Upper bounds, (n, 8).
    """

    A: Array
    r: Array
    x0: Array
    reach: Array
    lower: Array
    upper: Array


class ArmAnswers(NamedTuple):
    """The answers to eight hierarchies.

    Attributes:
        x: Unknowns, (n, 8).
        bound: e_x, (n, 8).
        state: The working set as `Held` has it, (n, 8); read at first, then written.
        proven: One pack: 1 where the answer is proven, else 0, (1, 8).
    """

    x: Array
    bound: Array
    state: Array
    proven: Array


class ArmScratch(NamedTuple):
    """Memory of one solution; s is the larger of m and n.

    Attributes:
        S: Rows of the matrix whose product with its transpose is factorised, (m n, 8).
        L: Factor with an inverted diagonal, (s s, 8).
        inverse: L⁻¹, (s s, 8).
        diagonal: Diagonal before the factorisation, (s, 8).
        extra: What is added to the diagonal, (s, 8).
        dual: λ or residuals of the rows, (s, 8).
        step: Right-hand sides, then corrections and bounds, (s, 8).
        trial: Unknowns of arms whose first level is not met, (n, 8).
        pull: Gradient of the cost by each held column, with the sign of its multiplier, (n, 8).
        unsure: Bound on its error, (n, 8).
    """

    S: Array
    L: Array
    inverse: Array
    diagonal: Array
    extra: Array
    dual: Array
    step: Array
    trial: Array
    pull: Array
    unsure: Array


def scratch_packs(m: int, n: int) -> int:
    """Return how many packs `scratch_in` takes.

    Args:
        m: Number of rows.
        n: Number of columns.

    Returns:
        The number.
    """
    s = max(m, n)
    return m * n + 2 * s * s + 4 * s + 3 * n


@kernel
def scratch_in(memory: Array, m: int, n: int) -> ArmScratch:
    """Return the memory of one solution as views.

    Args:
        memory: (scratch_packs(m, n), 8).
        m: Number of rows.
        n: Number of columns.

    Returns:
        An `ArmScratch`.
    """
    s = max(m, n)
    L = m * n
    a = L + 2 * s * s
    b = a + 4 * s
    return ArmScratch(
        memory[:L], memory[L : L + s * s], memory[L + s * s : a], memory[a : a + s],
        memory[a + s : a + 2 * s], memory[a + 2 * s : a + 3 * s], memory[a + 3 * s : b],
        memory[b : b + n], memory[b + n : b + 2 * n], memory[b + 2 * n : b + 3 * n],
    )  # fmt: skip


@kernel
def bound_held(rows: ArmRows, state: Array, j: int) -> Array:
    """Return the bound on which column j stands where it is held.

    Args:
        rows: The hierarchies.
        state: The working sets, (n, 8).
        j: The column.

    Returns:
        The pack; the upper bound where the column is free.
    """
    return where_less(load(state, j), 0.0, load(rows.lower, j), load(rows.upper, j))


@kernel
def is_free(state: Array, j: int) -> Array:
    """Return 1 where column j is free, else 0.

    Args:
        state: The working sets, (n, 8).
        j: The column.

    Returns:
        The pack.
    """
    return where_less(size(load(state, j)), 0.5, 1.0, 0.0 * load(state, j))
