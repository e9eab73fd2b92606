"""The operator S(·) of the vector product, and the angular velocity inside ṘRᵀ."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite


def skew(vector: ArrayLike) -> Array:
    """Build the matrix S(w) of the vector product, S(w) x = w × x.

    For every rotation R, R S(w) Rᵀ = S(R w); and Ṙ = S(ω) R for the angular velocity ω of R.

    Args:
        vector: w (3,), in any unit, such as [rad/s].

    Returns:
        S (3, 3), in the unit of w, with S + Sᵀ = 0.

    Raises:
        InvalidValue: w is not three finite numbers.

    Source:
        Equations (3.7), (3.9), (3.10), (3.11).
    """
    x, y, z = finite("vector", vector, (3,))
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def unskew(matrix: ArrayLike) -> Array:
    """Compute the vector w of a matrix, whose skew-symmetric part is S(w).

    For the matrix Ṙ Rᵀ, w is the angular velocity ω of R.

    Args:
        matrix: (3, 3), in any unit. Its symmetric part, such as rounding errors, is ignored.

    Returns:
        w (3,), in the unit of the matrix.

    Raises:
        InvalidValue: The matrix is not 3×3 finite numbers.

    Source:
        Equations (3.6) and (3.9).
    """
    S = finite("matrix", matrix, (3, 3))
    return 0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
