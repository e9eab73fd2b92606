"""Conversion of two-sided rows to equalities and one-sided rows, and of dense matrices to sparse ones.

Most packages accept only rows A x = b and G x ≤ h, and some of them require sparse matrices.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from taskopt.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class OneSided:
    """The rows lower ≤ C x ≤ upper written as A x = b and G x ≤ h, with the upper bounds first in G.

    Attributes:
        equal: Indices in C of the rows of A.
        above: Indices in C of the first rows of G: finite upper bounds, G = C.
        below: Indices in C of the last rows of G: finite lower bounds, G = −C.
        A: (len(equal), n) rows of the equalities.
        b: (len(equal),) right-hand sides of the equalities.
        G: (len(above) + len(below), n) rows of the inequalities.
        h: (len(above) + len(below),) bounds of the inequalities.
    """

    equal: IntArray
    above: IntArray
    below: IntArray
    A: Array
    b: Array
    G: Array
    h: Array

    def multipliers(self, of_equal: Array, of_inequal: Array, size: int) -> Array:
        """Return the multipliers y (size,) of the rows of C.

        Args:
            of_equal: (len(b),) multipliers of A x = b.
            of_inequal: (len(h),) multipliers ≥ 0 of G x ≤ h.
            size: Number of rows of C.

        Returns:
            y (size,), positive at an upper and negative at a lower bound, zero for rows without bounds.
        """
        y = np.zeros(size)
        y[self.equal] = of_equal
        y[self.above] += of_inequal[: len(self.above)]
        y[self.below] -= of_inequal[len(self.above) :]
        return y


def one_sided(C: Array, lower: Array, upper: Array) -> OneSided:
    """Split lower ≤ C x ≤ upper into equalities and one-sided inequalities.

    Args:
        C: (m, n) rows.
        lower: (m,) lower bounds, −inf for none.
        upper: (m,) upper bounds, inf for none.

    Returns:
        The rows A x = b and G x ≤ h. A row with two finite, different bounds occurs twice in G.
    """
    equal = np.flatnonzero(lower == upper)
    above = np.flatnonzero((upper < np.inf) & (lower != upper))
    below = np.flatnonzero((lower > -np.inf) & (lower != upper))
    G, h = np.vstack([C[above], -C[below]]), np.concatenate([upper[above], -lower[below]])
    return OneSided(equal, above, below, C[equal], upper[equal], G, h)


def compressed(matrix: Array) -> csc_matrix:
    """Convert a dense matrix to compressed sparse columns.

    This takes a tenth of the time of SciPy's constructor for dense matrices.

    Args:
        matrix: Dense matrix (m, n).

    Returns:
        The same matrix without its zeros.
    """
    columns = matrix.T
    nonzero = columns != 0.0
    pointers = np.concatenate([[0], np.cumsum(nonzero.sum(axis=1))])
    return csc_matrix((columns[nonzero], np.nonzero(nonzero)[1], pointers), shape=matrix.shape)
