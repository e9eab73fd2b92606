"""The answer to a hierarchy: x, the residual of each task, the active limits, and the proof."""

from collections.abc import Callable
from functools import cached_property
from typing import Final, TypeAlias

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.active import Active, active_rows, fixed_rows, level_multipliers
from taskopt.hierarchy.certificate import Certificate, broken_limit
from taskopt.hierarchy.explain import explain
from taskopt.hierarchy.intervals import signed_distance
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Judgement, judge
from taskopt.hierarchy.review import Review
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY, KKT_MET
from taskopt.hierarchy.view import Answer, answer_of

Complete: TypeAlias = Callable[[Hierarchy, Answer, StateArray], None]
"""A function that fills multipliers, residuals and active set of an answer whose x and problem are given."""


Undamped: TypeAlias = "Callable[[Resolution], Resolution]"
"""A function of a damped answer that returns the answer without damping."""


class Resolution:
    """The answer x to a hierarchy, with multipliers, certificate, and a copy of that hierarchy.

    Because of the copy a resolution does not change when the next tick overwrites the hierarchy. Everything
    except x is computed at the first access.

    Args:
        source: The hierarchy that was resolved; its layout and norm, which never change, are shared.
        answer: The flat answer (see `view`), which ends with a copy of the hierarchy's buffer.
        state: Final active set, (n + M,): −1 where a lower bound is active, 1 for an upper bound, else 0.
        status: Claim of the resolver.
        iterations: Number of iterations or factorisations that the resolver needed.
        reviewer: Function that makes the review of the answer when it is first needed, see `review`.
        complete: Function of the problem that fills multipliers, residuals and active set at their first
            access, for resolvers that find x without them; None if `answer` and `state` are filled already.

    Attributes:
        x: The unknowns, (n,).
        notes: Sentences on measures that were needed to get an answer, or on why a formula gives none.
        fallback: Name of the method that answered because `active-set` failed; None if it did not fail.
        is_damped: True if the problem has rows of `RestDamping` that its stack does not declare.
    """

    notes: tuple[str, ...] = ()
    fallback: str | None = None
    is_damped: bool = False
    _undamped: "Resolution | Undamped | None" = None

    def __init__(
        self,
        source: Hierarchy,
        answer: Array,
        state: StateArray,
        status: Status,
        iterations: int = 0,
        reviewer: "Callable[[Resolution], Review] | None" = None,
        complete: Complete | None = None,
    ) -> None:
        self.source: Final = source
        self._answer: Final = answer
        self._state: Final = state
        self.status: Final = status
        self.iterations: Final = iterations
        self._reviewer: Final = reviewer
        self._complete = complete
        self._broken_limit: float | None = None
        self.x: Final[Array] = answer[source.layout.place_of_x]

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
        arrays, own = (self._answer, self._state), (self._reviewer, self._complete)
        new = Resolution(self.source, *arrays, status or self.status, self.iterations, *own)
        new.notes = self.notes if notes is None else notes
        new.fallback = self.fallback if fallback is None else fallback
        new.is_damped, new._undamped = self.is_damped, self._undamped
        return new

    def damped_from(self, undamped: "Resolution | Undamped") -> "Resolution":
        """Return the same answer as one with damping.

        Args:
            undamped: The answer without damping; or a function that finds it from the damped one, which is
                called when it is first asked for.

        Returns:
            A new record that shares the arrays of this one.
        """
        new = self.replaced()
        new.is_damped, new._undamped = True, undamped
        return new

    @cached_property
    def undamped(self) -> "Resolution | None":
        """The answer without damping of an answer with it; None for others."""
        return self._undamped(self) if callable(self._undamped) else self._undamped

    @property
    def damping_distance(self) -> float:
        """Largest difference from the answer without damping, ‖x − undamped.x‖∞; 0 without damping.

        NaN if there is no answer without damping.
        """
        return 0.0 if self.undamped is None else float(np.abs(self.x - self.undamped.x).max())

    @cached_property
    def _parts(self) -> Answer:
        """The parts of the flat answer, as views."""
        layout = self.source.layout
        return answer_of(self._answer, layout.n, layout.row_count, layout.level_count)

    def _completed(self) -> None:
        """Fill multipliers, residuals and active set, if the resolver left that for later."""
        complete = self._complete
        if complete is not None:
            complete(self._problem, self._parts, self._state)
            self._complete = None

    @property
    def answer(self) -> Array:
        """The flat answer with all its parts, see `taskopt.hierarchy.view`."""
        self._completed()
        return self._answer

    @property
    def state(self) -> StateArray:
        """Final active set, (n + M,): −1 where a lower bound is active, 1 for an upper bound, else 0."""
        self._completed()
        return self._state

    @property
    def problem(self) -> Hierarchy:
        """The hierarchy as it was when it was resolved."""
        return self._problem

    @cached_property
    def _problem(self) -> Hierarchy:
        """The problem, made at the first access."""
        return Hierarchy.view(self.source.layout, self._parts.problem, self.source.norm)

    @property
    def v(self) -> Array:
        """The unknowns of a robot's stack of order 1: joint velocities, (nv,) [rad/s, m/s].

        Raises:
            InvalidValue: The stack is of order 2, so that the unknowns are accelerations.
        """
        if self.source.layout.is_of_accelerations:
            raise InvalidValue("a stack of order 2 answers with accelerations: take resolution.a, not .v")
        return self.x

    @property
    def a(self) -> Array:
        """The unknowns of a robot's stack of order 2: joint accelerations, (nv,) [rad/s², m/s²].

        Raises:
            InvalidValue: The unknowns are not accelerations.
        """
        if not self.source.layout.is_of_accelerations:
            raise InvalidValue(
                "only a stack of order 2 answers with accelerations: take resolution.v, not .a"
            )
        return self.x

    @property
    def multipliers(self) -> Array:
        """Multipliers of box and rows at each level, the norm last, (levels + 1, n + M)."""
        self._completed()
        return self._parts.multipliers

    @cached_property
    def certificate(self) -> Certificate:
        """Error bound, verdict and KKT residuals, also for a closed form, which claims no optimum."""
        self._completed()
        return Certificate(self._parts.residuals, self._judged)

    @property
    def broken_limit(self) -> float:
        """As of `certificate`, without computing multipliers for it; inf if x is not finite."""
        if self._broken_limit is None:
            layout, answer = self.source.layout, self._answer
            buffer = answer[answer.size - layout.size :]
            self._broken_limit = broken_limit(layout, buffer, self.x)
        return self._broken_limit

    def _judged(self) -> Judgement:
        """Judge x by its distance from the exact optimum; its own active set is the hint."""
        accuracy = ACCURACY if self.review is None else self.review.accuracy
        x = np.where(np.isnan(self.x), np.inf, self.x)
        return judge(self.problem, x, self.state, accuracy=accuracy)

    @property
    def proven(self) -> bool:
        """True if every entry of x is proven to be as near to the exact optimum as was asked for.

        The proof is made at the first access and takes some milliseconds; `certificate` has its bound.
        """
        return self.certificate.judgement.proven

    def certified(self) -> bool:
        """Return `proven`; programs from before the bound ask in this way.

        Returns:
            True if every entry of x is proven.
        """
        return self.proven

    @property
    def claimed(self) -> bool:
        """True if the resolver claims that this is the optimum."""
        return self.status is Status.SOLVED

    @cached_property
    def review(self) -> Review | None:
        """Review with closed-form answer, error of x, ranks, damping and causes; None without a reviewer."""
        return None if self._reviewer is None else self._reviewer(self)

    def kkt_met(self, tolerance: float = KKT_MET) -> bool:
        """Return True if x and the multipliers meet the KKT conditions, which is no proof: see `proven`.

        Args:
            tolerance: Largest KKT residual, relative as in `Certificate`.

        Returns:
            True if no residual exceeds it.
        """
        return self.certificate.kkt_met(tolerance)

    @cached_property
    def active(self) -> tuple[Active, ...]:
        """Active limits and inequalities, each at the first level where its multiplier is not zero."""
        return active_rows(self.problem, self.state, self.multipliers)

    @cached_property
    def level_multipliers(self) -> tuple[Active, ...]:
        """Multiplier of every active bound at every level where it has one, level by level."""
        return level_multipliers(self.problem, self.state, self.multipliers)

    @cached_property
    def residuals(self) -> dict[str, Array]:
        """Residual of each task, A x minus the nearest point of [lower, upper], (m,) by name."""
        problem = self.problem
        lack = signed_distance(problem.A @ self.x, problem.lower, problem.upper)
        return {block.name: lack[block.rows] for block in problem.layout.blocks if block.level > 0}

    def explain(self) -> str:
        """Return a text that names the tasks that are met or missed, and the limits that hold them back."""
        finite = bool(np.isfinite(self.x).all())
        text = explain(
            self.problem,
            self.x,
            self.status,
            self.certificate,
            self.active if finite else (),
            self.review if finite else None,
            fixed_rows(self.problem, self.multipliers) if finite else (),
        )
        damped = (_of_damping(self.damping_distance),) if self.is_damped else ()
        return "\n".join([*self.notes, *damped, text])

    def __repr__(self) -> str:
        status = f"claims {self.status.name}" if self.claimed else self.status.name
        return f"Resolution(x={np.array2string(self.x, precision=6)}, {status}, {self.certificate})"


def _of_damping(distance: float) -> str:
    """Return the sentence on the damping of a tick."""
    return (
        f"Damped, so that the robot comes to rest: {distance:.3g} apart from the optimum without damping. "
        "The problem below has rows of that damping."
    )
