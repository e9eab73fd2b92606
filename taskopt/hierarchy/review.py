"""The review of an answer: its accuracy, its ranks, and why it differs from the closed-form answer."""

from typing import NamedTuple, Protocol

from taskopt.arrays import Array


class Cause(NamedTuple):
    """One reason why an answer differs from its closed-form answer.

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
        free: Number of directions that the levels before left.
        rank: Number of directions that this level decided.
        kept: Smallest singular value that counts, relative to the size of the rows; inf if there is none.
        dropped: Largest singular value that does not count, likewise; 0 if there is none.
        damping: The largest k² that any of its directions was damped with.
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
        """Number of directions that the rows could have decided and did not."""
        return min(self.rows, self.free) - self.rank


class Review(Protocol):
    """The review of an answer; each part is computed when it is first asked for."""

    @property
    def accuracy(self) -> float:
        """Error of x, relative to its largest entry, that the resolver was asked for."""
        ...

    @property
    def closed_form(self) -> Array:
        """Undamped closed-form answer to the same problem, (n,); it knows no inequality."""
        ...

    @property
    def difference(self) -> float:
        """Largest entry of |x − closed-form answer|."""
        ...

    @property
    def error(self) -> float:
        """Error of x against x solved again on its final active set, relative to x; NaN for a closed form."""
        ...

    @property
    def levels(self) -> tuple[LevelAccount, ...]:
        """Ranks and damping level by level, the hard rows first."""
        ...

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Reasons why x differs from the closed form by more than the accuracy; empty if it does not."""
        ...
