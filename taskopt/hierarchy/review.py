"""What a second look at an answer finds: how accurate it is, and why it is not the closed form."""

from typing import NamedTuple, Protocol

from taskopt.arrays import Array

ACCURACY = 1e-8  # wanted in x, relative to its largest entry, unless a resolver is asked for another
SMALLEST = 1e-6  # [rad/s, m/s] an x that is smaller counts as that large: nothing is exact relative to zero


class Cause(NamedTuple):
    """One reason why an answer is apart from its closed form."""

    kind: str  # "limit", "rank", "damping", "accuracy"
    text: str

    def __str__(self) -> str:
        return self.text


class LevelAccount(NamedTuple):
    """What became of the equality rows of one level; level 0 are the hard ones."""

    level: int
    rows: int
    free: int  # directions that the levels before left
    rank: int  # directions that this level decided
    kept: float  # the smallest singular value that counts, relative to the size of the rows; inf for none
    dropped: float  # the largest one that does not; 0 for none
    damping: float = 0.0  # the largest k² that any of its directions got

    @property
    def lost(self) -> int:
        """Directions that its rows could have decided, and did not."""
        return min(self.rows, self.free) - self.rank


class Review(Protocol):
    """The second look; everything in it is computed when it is first asked for."""

    @property
    def accuracy(self) -> float:
        """What the resolver was asked for in x, relative."""
        ...

    @property
    def closed_form(self) -> Array:
        """x (n,) of the undamped closed form of the same problem, which knows no inequality."""
        ...

    @property
    def difference(self) -> float:
        """‖x − closed form‖∞."""
        ...

    @property
    def error(self) -> float:
        """‖x − x re-solved on the final active set‖∞, relative to x; NaN for a closed form."""
        ...

    @property
    def levels(self) -> tuple[LevelAccount, ...]:
        """Ranks and damping, level by level, the hard rows first."""
        ...

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Why x is apart from the closed form by more than the accuracy; nothing where it is not."""
        ...
