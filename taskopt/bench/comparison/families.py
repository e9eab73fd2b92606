"""Seeded generators of problem sets, whose numbers are small multiples of powers of two.

Sums and products of such numbers are exact, so that every machine draws the same problems to the last bit,
ranks are what they are meant to be, and exact references in rational arithmetic are quick.
"""

from collections.abc import Iterator

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.comparison.problem_set import ProblemSequence
from taskopt.bench.scaled_problems import scaled_problem
from taskopt.hierarchy.problem import Hierarchy, Level

_GRID = 8.0  # entries of factors are multiples of 1/8
_STEP = 64.0  # parts of a factor's change in a sequence, so that each problem is near the one before


def scaled_sequences(families: tuple[str, ...], seeds: int) -> Iterator[ProblemSequence]:
    """Draw pairs of small problems of the families of `taskopt.bench.scaled_problems`.

    Args:
        families: Names of the families.
        seeds: Number of pairs of each.

    Yields:
        Sequences of two problems of 2 to 6 unknowns, whose right-hand sides differ by about a percent.
    """
    for family in families:
        for seed in range(seeds):
            yield ProblemSequence(f"{family} {seed}", scaled_problem(family, seed))


def random_levels(n: int, sequences: int, length: int) -> Iterator[ProblemSequence]:
    """Draw four levels of random rank, half of their rows inequalities, inside bounds.

    Args:
        n: Number of unknowns.
        sequences: Number of sequences.
        length: Number of problems of each sequence; the rows of each level change from one to the next.

    Yields:
        Sequences. Bounds hold at x = 0, so that they never contradict each other.

    Source:
        After the profile in Sect. 6 of Escande, Mansard and Wieber (2014); sizes and ranks are our own.
    """
    for index in range(sequences):
        rng = np.random.default_rng([n, index])
        parts = [_Drift(rng, n) for _ in range(4)]
        reach = _draw(rng, n, low=1, high=9)
        problems = [
            Hierarchy([part.level(step) for part in parts], box=(-reach, reach)) for step in range(length)
        ]
        yield ProblemSequence(f"n {n}, draw {index}", tuple(problems))


class _Drift:
    """A level A = L (R + s R') of some rank, whose factor R moves with the step s."""

    def __init__(self, rng: np.random.Generator, n: int) -> None:
        rows = int(rng.integers(max(1, n // 5), max(2, n // 3) + 1))
        rank = int(rng.integers(max(1, rows // 2), rows + 1))
        self._left, self._right = _draw(rng, rows, rank), _draw(rng, rank, n)
        self._change = _draw(rng, rank, n)
        self._goal = _draw(rng, rows, low=-16, high=17)
        self._width = np.where(rng.random(rows) < 0.5, _draw(rng, rows, low=4, high=32), 0.0)
        self._goal_change = _draw(rng, rows)

    def level(self, step: int) -> Level:
        """Return the level at a step."""
        A = self._left @ (self._right + step / _STEP * self._change)
        b = self._goal + step / _STEP * self._goal_change
        return Level(A, lower=b - self._width, upper=b + self._width)


def velocity_bounds(sequences: int, length: int) -> Iterator[ProblemSequence]:
    """Draw seven joints with bounds on their velocities and two levels of three and two rows.

    The first level asks for velocities from half to four times of what the bounds allow for about, as in
    experiments on saturation in the null space.

    Args:
        sequences: Number of sequences.
        length: Number of problems of each; rows and goals change from one to the next.

    Yields:
        Sequences.

    Source:
        After the experiments of Flacco, De Luca and Khatib (2015); the numbers are our own.
    """
    for index in range(sequences):
        rng = np.random.default_rng([7, index])
        first, second, move = _draw(rng, 3, 7), _draw(rng, 2, 7), _draw(rng, 3, 7)
        goal, low = _draw(rng, 3, low=-16, high=17), _draw(rng, 2, low=-8, high=9)
        reach = _draw(rng, 7, low=2, high=9)
        demand = 2.0 ** int(rng.integers(-1, 3))
        problems = []
        for step in range(length):
            rows = first + step / _STEP * move
            levels = [Level(rows, demand * goal, name="hand"), Level(second, low, name="elbow")]
            problems.append(Hierarchy(levels, box=(-reach, reach)))
        yield ProblemSequence(f"demand {demand:g}, draw {index}", tuple(problems))


def near_singular(exponents: tuple[int, ...], draws: int) -> Iterator[ProblemSequence]:
    """Draw 3×7 rows whose last row is the sum of the first two but for a part of size 2^−e.

    Args:
        exponents: Exponents e, from far from singular to near.
        draws: Number of problems for each exponent.

    Yields:
        One sequence for each exponent. The smallest singular value is about 2^−e.
    """
    for exponent in exponents:
        problems = []
        for index in range(draws):
            rng = np.random.default_rng([3, index])
            J, own = _draw(rng, 3, 7), _draw(rng, 7)
            J[2] = J[0] + J[1] + 2.0**-exponent * own
            goal, rest = _draw(rng, 3), _draw(rng, 7)
            reach = np.full(7, 8.0)
            problems.append(Hierarchy([Level(J, goal, name="hand"), Level(np.eye(7), rest)], (-reach, reach)))
        yield ProblemSequence(f"2^-{exponent}", tuple(problems))


def contradicting_limits(draws: int) -> Iterator[ProblemSequence]:
    """Draw hard rows that contradict the bounds, or each other, by a quarter or more.

    Args:
        draws: Number of problems.

    Yields:
        Sequences of one problem, none of which has an answer inside its limits.
    """
    for index in range(draws):
        rng = np.random.default_rng([5, index])
        n = int(rng.integers(3, 9))
        hard, reach = _draw(rng, 2, n), _draw(rng, n, low=1, high=8)
        hard[0, int(rng.integers(n))] += 1.0
        most = np.abs(hard[0]) @ reach
        lower, upper = np.array([most + 0.25, -1.0]), np.array([most + 1.0, 1.0])
        if index % 2:  # the second row asks for the opposite of the first one
            hard[1], lower, upper = -hard[0], np.array([0.25, 0.25]), np.array([1.0, 1.0])
        limits = Level(hard, lower=lower, upper=upper)
        problem = Hierarchy([Level(_draw(rng, 2, n), _draw(rng, 2))], (-reach, reach), limits)
        yield ProblemSequence(f"draw {index}", (problem,))


def _draw(rng: np.random.Generator, *shape: int, low: int = -16, high: int = 17) -> Array:
    """Draw multiples of 1/8 from low/8 up to (high − 1)/8."""
    return rng.integers(low, high, shape) / _GRID
