"""Matrices of enclosed numbers: what is computed in them contains the exact result."""

import numpy as np

from taskopt.arrays import Array, IntArray, Mask
from taskopt.hierarchy.proof.double_double import add_arrays, multiply_arrays, multiply_matrices
from taskopt.hierarchy.tolerances import ROUNDED_UP


class Enclosure:
    """A matrix of numbers that are known up to a radius each.

    Args:
        parts: Upper part, lower part and radius of each number, (3, m, p); see `double_double`.
    """

    __array_ufunc__ = None  # so that `array * enclosure` is ours

    def __init__(self, parts: Array) -> None:
        self.parts = parts

    @staticmethod
    def exact(value: Array) -> "Enclosure":
        """Return numbers that are known exactly.

        Args:
            value: The numbers, (m, p), or (m,) for a column.

        Returns:
            The enclosure, (m, p) or (m, 1).
        """
        matrix = value[:, None] if value.ndim == 1 else value
        parts = np.zeros((3, *matrix.shape))
        parts[0] = matrix
        return Enclosure(parts)

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of rows and columns."""
        return self.parts.shape[1:]

    @property
    def middle(self) -> Array:
        """The nearest double to the middle of each enclosure, (m, p)."""
        return self.parts[0]

    @property
    def size(self) -> Array:
        """An upper bound on each magnitude, (m, p)."""
        return ROUNDED_UP * (np.abs(self.parts[0]) + self.parts[2])

    @property
    def positive(self) -> Mask:
        """True where the number is certainly positive, (m, p)."""
        return self.parts[0] > ROUNDED_UP * (np.abs(self.parts[1]) + self.parts[2])

    @property
    def negative(self) -> Mask:
        """True where the number is certainly negative, (m, p)."""
        return -self.parts[0] > ROUNDED_UP * (np.abs(self.parts[1]) + self.parts[2])

    @property
    def T(self) -> "Enclosure":
        """The transpose."""
        return Enclosure(np.ascontiguousarray(self.parts.transpose(0, 2, 1)))

    def rows(self, which: IntArray | list[int] | slice) -> "Enclosure":
        """Return some of the rows.

        Args:
            which: Indices.

        Returns:
            A copy of these rows.
        """
        return Enclosure(np.ascontiguousarray(self.parts[:, which, :]))

    def columns(self, which: slice) -> "Enclosure":
        """Return some of the columns.

        Args:
            which: Indices.

        Returns:
            A copy of these columns.
        """
        return Enclosure(np.ascontiguousarray(self.parts[:, :, which]))

    def widened(self, radius: Array) -> "Enclosure":
        """Return the same middles with another radius.

        Args:
            radius: The radii, (m, p).

        Returns:
            The enclosure.
        """
        parts = self.parts.copy()
        parts[2] = radius
        return Enclosure(parts)

    def scaled(self, powers: Array) -> "Enclosure":
        """Multiply by powers of two, which is exact.

        Args:
            powers: Powers of two that broadcast to (m, p).

        Returns:
            The product.
        """
        return Enclosure(self.parts * powers)

    def __neg__(self) -> "Enclosure":
        return Enclosure(self.parts * np.array([-1.0, -1.0, 1.0])[:, None, None])

    def __add__(self, other: "Enclosure | Array") -> "Enclosure":
        return _entrywise(self, _enclosed(other), add=True)

    def __sub__(self, other: "Enclosure | Array") -> "Enclosure":
        return _entrywise(self, -_enclosed(other), add=True)

    def __mul__(self, other: "Enclosure | Array") -> "Enclosure":
        return _entrywise(self, _enclosed(other), add=False)

    __rmul__ = __mul__

    def __matmul__(self, other: "Enclosure | Array") -> "Enclosure":
        return Enclosure(multiply_matrices(self.parts, _enclosed(other).parts))

    def __rmatmul__(self, other: Array) -> "Enclosure":
        return Enclosure(multiply_matrices(_enclosed(other).parts, self.parts))


def _enclosed(value: "Enclosure | Array") -> Enclosure:
    """Return an array as exact numbers, and an enclosure as it is."""
    return value if isinstance(value, Enclosure) else Enclosure.exact(np.ascontiguousarray(value))


def _entrywise(a: Enclosure, b: Enclosure, *, add: bool) -> Enclosure:
    """Add or multiply entry by entry, after broadcasting."""
    left, right = a.parts, b.parts
    shape = left.shape
    if shape != right.shape:
        shape = np.broadcast_shapes(shape, right.shape)
        left, right = np.broadcast_to(left, shape), np.broadcast_to(right, shape)
    combine = add_arrays if add else multiply_arrays
    out = combine(*(np.ascontiguousarray(parts).reshape(3, -1) for parts in (left, right)))
    return Enclosure(out.reshape(shape))
