"""The judgement of an answer by its distance from the exact optimum."""

import numpy as np

from taskopt.arrays import Array, ArrayLike, StateArray, number
from taskopt.hierarchy.intervals import excess, nearer_side
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof.judgement import Judgement, Verdict
from taskopt.hierarchy.proof.lost import rows_of_lost_directions
from taskopt.hierarchy.proof.prover import Optimum, Prover
from taskopt.hierarchy.tolerances import ACCURACY, HINT_AT_BOUND


def judge(
    hierarchy: Hierarchy, x: ArrayLike, state: StateArray | None = None, *, accuracy: float = ACCURACY
) -> Judgement:
    """Judge any x by a bound on its distance from the exact optimum of the declared numbers.

    x is wrong if some entry is further than accuracy · max(1, |x_i|) from the optimum. Ranks have no
    tolerance. x is proven if the bound is at most that, entry by entry, and refuted if it is certainly wrong.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,); for a robot joint velocities [rad/s, m/s].
        state: Active set as a hint, (n + M,): −1 where a lower bound is active, 1 for an upper bound, else 0.
            A wrong hint proves nothing wrong. None to take the bounds that x is near.
        accuracy: Error of an entry relative to max(1, its magnitude) that is asked for.

    Returns:
        The judgement.

    Raises:
        InvalidValue: x has the wrong size, or an entry is NaN.
    """
    return Judge(hierarchy)(x, state, accuracy=accuracy)


class Judge:
    """The judge of any number of answers to one problem, which proves each active set only once.

    Args:
        hierarchy: The problem; it must not change.
        search: False to try only the hint itself, not the active sets that its proof leads to, nor the bounds
            that x is near.
    """

    def __init__(self, hierarchy: Hierarchy, *, search: bool = True) -> None:
        self._hierarchy, self._prover = hierarchy, Prover(hierarchy, search=search)
        self._search = search

    def __call__(
        self, x: ArrayLike, state: StateArray | None = None, *, accuracy: float = ACCURACY
    ) -> Judgement:
        """Judge an answer; see `judge`.

        Args:
            x: The unknowns, (n,).
            state: Active set as a hint, (n + M,); None to take the bounds that x is near.
            accuracy: Error of an entry relative to max(1, its magnitude) that is asked for.

        Returns:
            The judgement.

        Raises:
            InvalidValue: x has the wrong size, or an entry is NaN.
        """
        n = self._hierarchy.n
        value = number("x", x, (n,))
        if not np.isfinite(value).all():
            return Judgement(np.full(n, np.inf), Verdict.REFUTED, (), "An entry of x is not finite.")
        hints = [] if state is None else [np.array(state, dtype=np.int8)]
        if self._search or not hints:
            hints.append(near_bounds(self._hierarchy, value))
        found = _judged(self._prover, hints, value, accuracy)
        return self._unless_lost(found, hints, value) if found.verdict is Verdict.REFUTED else found

    def _unless_lost(self, found: Judgement, hints: list[StateArray], x: Array) -> Judgement:
        """Do not refute an answer for a direction that no rank policy keeps."""
        exact = _first_proven(self._prover, hints, assume=False)
        if exact.doubtful:  # then it is refuted as well if those rows depend on others
            return found
        rows = rows_of_lost_directions(self._hierarchy, x, exact.x)
        if not rows:
            return found
        names = tuple(self._hierarchy.name_of(self._hierarchy.n + i, True) for i in rows)
        reason = f"Directions that are lost up to rounding decide: {', '.join(names)}."
        return Judgement(found.error_bound, Verdict.UNDECIDED, names, reason)


def _judged(prover: Prover, hints: list[StateArray], value: Array, accuracy: float) -> Judgement:
    """Judge x by the enclosure that one of the hints leads to."""
    exact = _first_proven(prover, hints, assume=False)
    judgement = _by_distance(exact, value, accuracy)
    if judgement.proven or not exact.doubtful:
        return judgement
    assumed = _by_distance(_first_proven(prover, hints, assume=True), value, accuracy)
    if assumed.verdict is Verdict.PROVEN_IF:
        return assumed
    if judgement.verdict is Verdict.REFUTED and assumed.verdict is Verdict.REFUTED:
        return judgement
    names = ", ".join(exact.doubtful)
    if judgement.verdict is Verdict.UNDECIDED and assumed.verdict is Verdict.REFUTED:
        reason = f"{assumed.reason[:-1]}, if these depend on those before them: {names}."
        return Judgement(judgement.error_bound, Verdict.REFUTED_IF, exact.doubtful, reason)
    reason = f"Rounding decides whether these depend on those before them: {names}."
    return Judgement(judgement.error_bound, Verdict.UNDECIDED, exact.doubtful, reason)


def near_bounds(hierarchy: Hierarchy, x: Array) -> StateArray:
    """Return the active set that x suggests: bounds that it is near to, and those that it violates.

    Args:
        hierarchy: The problem.
        x: The unknowns, (n,), finite.

    Returns:
        −1, 0 or 1 for each bound of the box and for each row, (n + M,).
    """
    lower, upper = hierarchy.bounds()
    value = hierarchy.values(x)
    rows = np.vstack([np.eye(hierarchy.n), hierarchy.A])
    near = HINT_AT_BOUND * np.maximum(np.linalg.norm(rows, axis=1), np.abs(rows * x).max(axis=1))
    side = nearer_side(value, lower, upper)
    side[(excess(value, lower, upper) < -near) | (lower == upper)] = 0
    return side.astype(np.int8)


def _first_proven(prover: Prover, hints: list[StateArray], *, assume: bool) -> Optimum:
    """Return the first enclosure that one of the hints leads to, or what the first hint lacks."""
    found = prover.improve(hints[0], assume=assume)
    for hint in hints[1:]:
        if found.candidates:
            break
        other = prover.improve(hint, assume=assume)
        found = other if other.candidates else found
    return found


def _by_distance(optimum: Optimum, x: Array, accuracy: float) -> Judgement:
    """Judge x by its distance from an enclosure of the optimum."""
    if not optimum.candidates:
        return Judgement(optimum.distance(x), Verdict.UNDECIDED, optimum.undecided, _sentence(optimum.reason))
    bound, least = optimum.distance(x), optimum.least_distance(x)
    # The size of the optimum, of which x is a measure but for the error that is to be judged.
    asked = accuracy * np.maximum(1.0, np.abs(x) - bound)
    most = accuracy * np.maximum(1.0, np.abs(x) + bound)
    worst = int(np.argmax(bound / asked))
    if (bound <= asked).all():
        verdict = Verdict.PROVEN_IF if optimum.assumed else Verdict.PROVEN
        condition = f", if these depend on those before them: {', '.join(optimum.assumed)}"
        text = f"Every entry is within {bound.max():.1e} of the exact optimum"
        return Judgement(bound, verdict, optimum.assumed, f"{text}{condition if optimum.assumed else ''}.")
    if (least > most).any():
        worst = int(np.argmax(least / most))
        text = f"Entry {worst} is {least[worst]:.3g} away from the exact optimum."
        return Judgement(bound, Verdict.REFUTED, (), text)
    text = f"The bound of entry {worst} is {bound[worst]:.1e}, more than {asked[worst]:.1e}"
    hidden = f"; rounding hides {', '.join(optimum.undecided)}" if optimum.undecided else ""
    return Judgement(bound, Verdict.UNDECIDED, optimum.undecided, f"{text}{hidden}.")


def _sentence(text: str) -> str:
    """Return text as a sentence."""
    return f"{text[:1].upper()}{text[1:]}."
