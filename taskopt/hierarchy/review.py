"""The review of an answer: its accuracy, its ranks, and its difference from the closed-form answer."""

from typing import NamedTuple, Protocol

from taskopt.arrays import Array


class Cause(NamedTuple):
    """A reason why an answer differs from the closed-form answer to the same problem.

    Attributes:
        kind: "limit", "rank", "damping", "formula" or "accuracy".
        text: The reason in words.
    """

    kind: str
    text: str

    def __str__(self) -> str:
        return self.text


class LevelAccount(NamedTuple):
    """Rank and damping that a resolver decided for the equality rows of one level.

    Attributes:
        level: 0 for the hard rows, 1 for the first priority, and so on.
        rows: Number of equality rows.
        free: Number of directions that the levels before left free.
        rank: Number of directions that this level decided.
        kept: Smallest singular value that counts, relative to the size of the rows; inf if none counts.
        dropped: Largest singular value that does not count, relative to the size of the rows; 0 if all count.
        damping: The largest k² with which one of its directions was damped.
    """

    level: int
    rows: int
    free: int
    rank: int
    kept: float
    dropped: float
    damping: float = 0.0

    @property
    def lost(self) -> int:
        """Number of directions that the rows could have decided but did not, because they were lost."""
        return min(self.rows, self.free) - self.rank


class Review(Protocol):
    """The review of an answer; each part is computed at the first access."""

    @property
    def accuracy(self) -> float:
        """Largest error of x, relative to its largest entry, that the resolver was asked to keep to."""
        ...

    @property
    def closed_form(self) -> Array:
        """Undamped closed-form answer to the same problem, (n,), which does not consider inequalities."""
        ...

    @property
    def difference(self) -> float:
        """Largest entry of |x − closed_form|."""
        ...

    @property
    def error(self) -> float:
        """Relative error of x, found by solving again on its final active set; NaN for a closed form."""
        ...

    @property
    def levels(self) -> tuple[LevelAccount, ...]:
        """Ranks and damping level by level, the hard rows first."""
        ...

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Reasons why x differs from `closed_form` by more than the accuracy; empty if it does not."""
        ...
