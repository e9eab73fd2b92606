"""The answer to a hierarchy: x, what each task still lacks, what binds, and the proof."""

from collections.abc import Callable
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.certificate import RESIDUALS, TOLERANCE, Certificate
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.review import Review
from taskopt.hierarchy.status import Status


class Active(NamedTuple):
    """One row that holds the answer back: its name, the side, and its price at the level it binds."""

    name: str
    side: str  # "lower", "upper"
    multiplier: float  # y > 0 at the upper bound, y < 0 at the lower
    level: int  # the first level with a multiplier here; level_count + 1 is the norm

    def __str__(self) -> str:
        return f"{self.name} {self.side}"


class Resolution:
    """x with its multipliers and certificate, and a copy of the hierarchy it answers.

    `answer` is a flat array (see `Layout.answer_size`) that ends with the hierarchy's buffer, so that a
    resolution stays true when the next tick overwrites the hierarchy; `source` lends layout and norm;
    `reviewer` is whoever takes the second look, at the first question that needs one.
    `notes` says in sentences what was done to get an answer at all; `fallback` is the name of the method that
    answered where `active-set` could not, None where it did. `state` (n + M) is -1 where a lower bound is in
    the final active set, +1 for an upper one, else 0.
    Everything else is derived when asked for.
    """

    def __init__(
        self,
        source: Hierarchy,
        answer: Array,
        state: StateArray,
        status: Status,
        iterations: int = 0,
        reviewer: "Callable[[Resolution], Review] | None" = None,
        notes: tuple[str, ...] = (),
        fallback: str | None = None,
    ) -> None:
        self.source: Final = source
        self.answer: Final = answer
        self.state: Final = state
        self.status: Final = status
        self.iterations: Final = iterations
        self.notes: Final = notes
        self.fallback: Final = fallback
        self._reviewer: Final = reviewer
        self.x: Array = answer[: source.layout.n]  # the unknowns, (n,)

    def replaced(
        self, status: Status | None = None, notes: tuple[str, ...] | None = None, fallback: str | None = None
    ) -> "Resolution":
        """Return the same answer with another status, other notes, or the name of a fallback.

        Args:
            status: The new status; None keeps the present one.
            notes: The new notes; None keeps the present ones.
            fallback: Name of the method that answered; None keeps the present one.

        Returns:
            A new record that shares the arrays of this one.
        """
        return Resolution(
            self.source,
            self.answer,
            self.state,
            self.status if status is None else status,
            self.iterations,
            self._reviewer,
            self.notes if notes is None else notes,
            self.fallback if fallback is None else fallback,
        )

    @cached_property
    def problem(self) -> Hierarchy:
        """The hierarchy as it was when it was resolved."""
        layout = self.source.layout
        return Hierarchy.view(layout, self.answer[-layout.size :], self.source.norm)

    @property
    def v(self) -> Array:
        """The unknowns of a robot's first-order stack: joint velocities, (nv,) [rad/s, m/s]."""
        return self.x

    @cached_property
    def multipliers(self) -> Array:
        """(levels + 1, n + M): what box and rows cost each level, the last row for the norm."""
        layout = self.source.layout
        width = layout.n + layout.row_count
        stop = layout.n + (layout.level_count + 1) * width
        return self.answer[layout.n : stop].reshape(layout.level_count + 1, width)

    @cached_property
    def certificate(self) -> Certificate:
        """KKT residuals by level; for a closed form, of an answer that claims nothing."""
        layout = self.source.layout
        levels = layout.level_count + 1
        stop = layout.answer_size - layout.size
        return Certificate(self.answer[stop - levels * len(RESIDUALS) : stop].reshape(levels, len(RESIDUALS)))

    @property
    def claimed(self) -> bool:
        """Whether the resolver says that this is the optimum."""
        return self.status is Status.SOLVED

    @cached_property
    def review(self) -> "Review | None":
        """The second look: closed form, error in x, ranks, damping, causes; None without a reviewer."""
        return None if self._reviewer is None else self._reviewer(self)

    @property
    def accurate(self) -> bool:
        """Whether x was shown to be within the accuracy asked for, relative to its largest entry.

        Its final active set is solved again by orthogonal factorisation. False for a closed form,
        which is its own measure.
        """
        return self.review is not None and self.review.error <= self.review.accuracy

    @property
    def solved(self) -> bool:
        """Whether the claim of an optimum stands: it is made, and x is accurate."""
        return self.claimed and self.accurate

    def certified(self, tolerance: float = TOLERANCE) -> bool:
        """Whether we could prove that this is the optimum."""
        return self.certificate.proves(tolerance)

    @cached_property
    def active(self) -> tuple[Active, ...]:
        """Limits and inequalities in the final active set, by name; what is an equality never counts."""
        problem, binds = self.problem, self.state != 0
        binds[: problem.n] &= problem.box_lower < problem.box_upper
        binds[problem.n :] &= problem.lower < problem.upper
        return tuple(self._active_row(int(i)) for i in np.flatnonzero(binds))

    @cached_property
    def prices(self) -> tuple[Active, ...]:
        """What every active row costs, at every level at which it costs anything, by level.

        At the first of its levels, ∂(½ Σ w d²)/∂bound = −multiplier: what a unit of the bound is worth.
        At later ones the multiplier is the price with all levels before held to their residuals.
        """
        at = {self._name(int(i)): int(i) for i in np.flatnonzero(self.state)}
        found = []
        for row in self.active:
            prices = self.multipliers[row.level - 1 :, at[row.name, row.side]]
            least = 1e-9 * max(1.0, float(np.abs(prices).max()))
            found += [
                row._replace(multiplier=float(price), level=row.level + k)
                for k, price in enumerate(prices)
                if abs(price) > least
            ]
        return tuple(sorted(found, key=lambda row: row.level))

    @cached_property
    def residuals(self) -> dict[str, Array]:
        """What each task lacks, A x minus the nearest point of [lower, upper], by name."""
        value = self.problem.A @ self.x
        lack = value - np.clip(value, self.problem.lower, self.problem.upper)
        return {b.name: lack[b.rows] for b in self.problem.layout.blocks if b.level > 0}

    def explain(self) -> str:
        """What is met, what is not, and which limits keep it so, in words and numbers."""
        from taskopt.hierarchy.explain import explain

        return "\n".join([*self.notes, explain(self)])

    def _active_row(self, i: int) -> Active:
        name, side = self._name(i)
        prices = self.multipliers[:, i]
        level = int(np.argmax(np.abs(prices) > 1e-9 * max(1.0, float(np.abs(prices).max()))))
        return Active(name, side, float(prices[level]), level + 1)

    def _name(self, i: int) -> tuple[str, str]:
        """Name and side of an active bound or row."""
        n, upper = self.problem.n, bool(self.state[i] > 0)
        name = self.problem.bound_name(i, upper) if i < n else self.problem.layout.row_names[i - n]
        return name, "upper" if upper else "lower"

    def __repr__(self) -> str:
        status = f"claims {self.status.name}" if self.claimed else self.status.name
        return f"Resolution(x={np.array2string(self.x, precision=6)}, {status}, {self.certificate})"
