"""Coefficients of dependent rows that are exactly zero because nothing connects the rows."""

import numpy as np

from taskopt.arrays import Array, Mask


def coupled(basis: Array, dependent: Array) -> Mask:
    """Return which independent rows a dependent row may be made of.

    An independent row with a single entry fixes its unknown. The others fall into groups that share no other
    unknown. A row is made of rows of the groups that it touches, and of the fixed unknowns of
    these and its own.

    Args:
        basis: Independent rows, (r, n).
        dependent: Rows that are combinations of them, (d, n).

    Returns:
        False where the coefficient is exactly zero, (d, r).
    """
    entries, own = basis != 0.0, dependent != 0.0
    single = entries.sum(axis=1) == 1
    open_columns = ~entries[single].any(axis=0)
    inside = entries[~single] & open_columns
    linked = (inside.T.astype(int) @ inside > 0) | np.eye(basis.shape[1], dtype=bool)
    while True:
        further = linked.astype(int) @ linked > 0
        if np.array_equal(further, linked):
            break
        linked = further
    touched = (own & open_columns).astype(int) @ linked > 0
    possible = np.zeros((len(dependent), len(basis)), dtype=bool)
    possible[:, ~single] = touched.astype(int) @ inside.T > 0
    fixed = own | (possible[:, ~single].astype(int) @ entries[~single] > 0)
    possible[:, single] = fixed.astype(int) @ entries[single].T > 0
    return possible
