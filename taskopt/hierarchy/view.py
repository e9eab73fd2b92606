"""The memory layout of a hierarchy and of its answer; no other module depends on an offset.

A hierarchy is one flat float64 buffer, so that a tick can be passed to a compiled kernel, copied or logged as
one array. An answer is another flat array, which ends with a copy of the hierarchy that it answers. With n
unknowns, M rows and L levels the two are, in this order:

    buffer   A (M, n), lower (M,), upper (M,), weight (M,), label (M,),
             box lower (n,), box upper (n,), owner of each box lower and of each box upper bound (2, n)
    answer   x (n,), multipliers (L + 1, n + M), KKT residuals (L + 1, 4), buffer

The records below consist of views into these arrays, so that nothing is copied. In compiled code they cost
nothing, since the compiler removes a NamedTuple. A NamedTuple that is passed from Python to a kernel would
cost more than a microsecond; kernels that Python calls therefore take the flat arrays.
"""

from typing import NamedTuple

from taskopt.arrays import Array, IntArray
from taskopt.jit import kernel

RESIDUAL_KINDS = 4  # stationarity, primal, dual, complementarity: see `certificate`


class Rows(NamedTuple):
    """The numbers of a hierarchy, as views into its buffer.

    Attributes:
        A: All rows, (M, n): hard rows first, then level by level.
        lower: Lower bounds of A x, (M,); −inf where there is none.
        upper: Upper bounds of A x, (M,); equal to `lower` in an equality.
        weight: Weight of each row in its level, (M,).
        label: Label of each row at this tick, (M,): the number of its name in the `choices` of its block,
            counted from 1; 0 for its own name.
        box_lower: Lower bounds of x, (n,).
        box_upper: Upper bounds of x, (n,).
        norm: The norm W that decides what stays free: its diagonal (n,), or all of it row by row (n · n,).
        offsets: First row of the hard rows, of level 1, 2, …, and the end, (L + 2,).
        columns: For each row, the index j if the row is always the unit vector e_j, else −1, (M,).
    """

    A: Array
    lower: Array
    upper: Array
    weight: Array
    label: Array
    box_lower: Array
    box_upper: Array
    norm: Array
    offsets: IntArray
    columns: IntArray


class Answer(NamedTuple):
    """The numbers of an answer, as views into its buffer.

    Attributes:
        x: The unknowns, (n,).
        multipliers: Multipliers of box and rows at each level, the norm last, (L + 1, n + M).
        residuals: KKT residuals of each level, the norm last, (L + 1, 4).
        problem: The buffer of the hierarchy that was answered.
    """

    x: Array
    multipliers: Array
    residuals: Array
    problem: Array


def buffer_size(n: int, row_count: int) -> int:
    """Return the length of the buffer of a hierarchy.

    Args:
        n: Number of unknowns.
        row_count: Number M of rows, hard ones included.

    Returns:
        The number of float64 entries.
    """
    return row_count * (n + 4) + 4 * n


def answer_size(n: int, row_count: int, level_count: int) -> int:
    """Return the length of an answer, the copy of the hierarchy's buffer included.

    Args:
        n: Number of unknowns.
        row_count: Number M of rows, hard ones included.
        level_count: Number L of levels.

    Returns:
        The number of float64 entries.
    """
    return n + (level_count + 1) * (n + row_count + RESIDUAL_KINDS) + buffer_size(n, row_count)


def rows_of(buffer: Array, n: int, norm: Array, offsets: IntArray, columns: IntArray) -> Rows:
    """Return the parts of a hierarchy's buffer as views; compiled kernels call `view_rows`.

    Args:
        buffer: The flat buffer, (`buffer_size(n, M)`,).
        n: Number of unknowns.
        norm: Norm W that the views get, see `Rows`.
        offsets: First row of the hard rows and of each level, and the end M, (L + 2,).
        columns: Indices of unit vectors, see `Rows`, (M,).

    Returns:
        The views.
    """
    rows = columns.size
    bounds = buffer[rows * n :]
    box = bounds[4 * rows :]
    return Rows(
        buffer[: rows * n].reshape((rows, n)),
        bounds[:rows],
        bounds[rows : 2 * rows],
        bounds[2 * rows : 3 * rows],
        bounds[3 * rows : 4 * rows],
        box[:n],
        box[n : 2 * n],
        norm,
        offsets,
        columns,
    )


def box_of(buffer: Array, n: int) -> Array:
    """Return the box and its owners as one view; compiled kernels call `view_box`.

    Args:
        buffer: The flat buffer of a hierarchy.
        n: Number of unknowns.

    Returns:
        (4, n): lower bounds, upper bounds, owner of each lower bound, owner of each upper bound. An owner
        is the index of a limit in `Layout.owners`.
    """
    return buffer[buffer.size - 4 * n :].reshape((4, n))


def place_of_x(n: int) -> slice:
    """Return where x stands in the flat answer.

    Args:
        n: Number of unknowns.

    Returns:
        The slice of the answer that is x, (n,).
    """
    return slice(0, n)


def answer_of(answer: Array, n: int, row_count: int, level_count: int) -> Answer:
    """Return the parts of an answer as views; compiled kernels call `view_answer`.

    Args:
        answer: The flat answer, (`answer_size(n, M, L)`,).
        n: Number of unknowns.
        row_count: Number M of rows.
        level_count: Number L of levels.

    Returns:
        The views.
    """
    lines, width = level_count + 1, n + row_count
    rest = answer[n:]
    after = rest[lines * width :]
    return Answer(
        answer[:n],
        rest[: lines * width].reshape((lines, width)),
        after[: lines * RESIDUAL_KINDS].reshape((lines, RESIDUAL_KINDS)),
        after[lines * RESIDUAL_KINDS :],
    )


view_rows = kernel(rows_of)
view_box = kernel(box_of)
view_answer = kernel(answer_of)
