"""The arrays of a program at unit size, which can be kept for other programs of the same size."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.qp import QuadraticProgram
from taskopt.resolver.unit_kernels import Linear, scale_program


class UnitProgram:
    """A program with a diagonal Hessian at unit size, see `taskopt.resolver.unit_kernels`.

    Args:
        n: Number of unknowns.
        most: Number of rows for which there is room.

    Attributes:
        H: Hessian, (n, n).
        free: Optimum without any bound, (n,).
        length: Lengths of the rows, (most,).
        rows: Rows of length one, (most, n).
        bounds: All bounds, (2, most + n): those of the m rows, followed by those of the unknowns.
        near: The bounds within reach, and ±inf for the others, likewise.
        arrays: The four arrays before `near`, as kernels take them.
        written: H and `near`, as kernels take them.
        answer: Room for x (n,), y (most,) and y_box (n,).
        m: Number of rows.
        size: Unit of x; 0.0 if the free optimum keeps all bounds.
        least: The least of 1 and the entries of H.
    """

    def __init__(self, n: int, most: int) -> None:
        self.H, self.near = np.empty((n, n)), np.empty((2, most + n))
        self.free, self.length = np.empty(n), np.empty(most)
        self.rows, self.bounds = np.empty((most, n)), np.empty((2, most + n))
        self.arrays = self.free, self.length, self.rows, self.bounds
        self.written = self.H, self.near
        self.answer = np.empty(n), np.empty(most), np.empty(n)
        self.m, self.size, self.least = 0, 0.0, 1.0
        self._zero = np.zeros(n)
        self._within_reach: dict[int, QuadraticProgram] = {}

    @staticmethod
    def of(qp: QuadraticProgram) -> "UnitProgram":
        """Scale a program.

        Args:
            qp: The program; H must be diagonal and positive.

        Returns:
            The same program at unit size.
        """
        m, n = qp.C.shape
        unit = UnitProgram(n, m)
        unit.H[:] = qp.H
        linear: Linear = (
            qp.g, np.ascontiguousarray(qp.C), qp.lower, qp.upper, qp.box_lower, qp.box_upper
        )  # fmt: skip
        unit.set(m, *scale_program(unit.H, linear, unit.arrays, unit.near))
        return unit

    def set(self, m: int, size: float, least: float) -> None:
        """Set what a kernel that wrote the arrays has returned.

        Args:
            m: Number of rows.
            size: As of the attribute.
            least: As of the attribute.
        """
        self.m, self.size, self.least = m, size, least

    @property
    def within_reach(self) -> QuadraticProgram:
        """The program with the bounds within reach, in the arrays of this object."""
        found = self._within_reach.get(self.m)
        if found is None:
            found = self._within_reach[self.m] = self._program(self.near)
        return found

    @property
    def whole(self) -> QuadraticProgram:
        """The program with all its bounds, in the arrays of this object."""
        return self._program(self.bounds)

    def _program(self, bounds: Array) -> QuadraticProgram:
        """Return the program with some bounds."""
        (lower, upper), m, end = bounds, self.m, self.m + len(self.H)
        parts = lower[:m], upper[:m], lower[m:end], upper[m:end]
        return QuadraticProgram(self.H, self._zero, self.rows[:m], *parts)
