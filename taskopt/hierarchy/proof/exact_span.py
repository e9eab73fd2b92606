"""Linear dependence of rows, decided in integers."""

from math import gcd

from taskopt.arrays import Array


class ExactSpan:
    """The span of rows of doubles, each with its right-hand side.

    A double is an integer times a power of two, so that each row is a multiple of a row of integers. These
    are eliminated without fractions, together with the combination that each of them has become.
    """

    def __init__(self) -> None:
        self._echelon: list[tuple[int, list[int], dict[int, int]]] = []

    def add(self, i: int, a: Array, b: float) -> None:
        """Add a row; one that depends on the others adds nothing.

        Args:
            i: Its index.
            a: The row, (n,).
            b: Its right-hand side.
        """
        row, combination = self._reduced(i, a, b)
        pivot = next((j for j, value in enumerate(row[:-1]) if value), None)
        if pivot is not None:
            self._echelon.append((pivot, row, combination))

    def dependence(self, i: int, a: Array, b: float) -> "tuple[bool, bool, list[int]]":
        """Decide if a row depends on those added before.

        Args:
            i: Its index.
            a: The row, (n,).
            b: Its right-hand side.

        Returns:
            True if it depends; True if its right-hand side then agrees; the rows that it depends on.
        """
        row, combination = self._reduced(i, a, b)
        others = [j for j, factor in combination.items() if factor and j != i]
        return not any(row[:-1]), row[-1] == 0, others

    def _reduced(self, i: int, a: Array, b: float) -> tuple[list[int], dict[int, int]]:
        """Return the row minus its part in the span, and that as a combination of rows."""
        row, combination = _integers([*a.tolist(), float(b)]), {i: 1}
        for pivot, line, made_of in self._echelon:
            if row[pivot] == 0:
                continue
            common = gcd(row[pivot], line[pivot])
            own, other = line[pivot] // common, row[pivot] // common
            row = [own * x - other * y for x, y in zip(row, line, strict=True)]
            keys = combination.keys() | made_of.keys()
            combination = {j: own * combination.get(j, 0) - other * made_of.get(j, 0) for j in keys}
            content = gcd(*row, *combination.values())
            row = [x // content for x in row]
            combination = {j: factor // content for j, factor in combination.items()}
        return row, combination


def _integers(values: list[float]) -> list[int]:
    """Return integers in the same ratio as the doubles."""
    pairs = [value.as_integer_ratio() for value in values]
    largest = max(denominator for _, denominator in pairs)  # all are powers of two
    return [numerator * (largest // denominator) for numerator, denominator in pairs]
