"""The enclosure of the exact optimum, from an active set that somebody proposes."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof.enclosure import Enclosure
from taskopt.hierarchy.proof.scaled import Scaled
from taskopt.hierarchy.proof.working_set import Outcome, Pair, outcome_of

MOST_UNDECIDED = 8  # pairs; their subsets are all tried, so that each one more doubles the work
_ROUNDS = (
    40  # changes of the active set until the search gives up; of what was proven, most took none, one 11
)


@dataclass(frozen=True, eq=False)
class Optimum:
    """An enclosure of the exact optimum, or the reason why there is none.

    Attributes:
        candidates: Solutions (n, 1) of which one is the optimum; empty if nothing is proven.
        state: The active set, (n + M,).
        undecided: Names of rows that double precision could not decide.
        assumed: Names of rows that were taken as dependent on those before them.
        doubtful: Names of rows that are independent of those before them by rounding only.
        reason: Why nothing is proven, in words; empty if something is.
        refuted: True if the active set is certainly not optimal.
    """

    candidates: tuple[Enclosure, ...] = ()
    state: StateArray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    undecided: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    reason: str = ""
    refuted: bool = False

    @property
    def x(self) -> Array:
        """The first candidate, rounded, (n,)."""
        return self.candidates[0].middle[:, 0]

    def distance(self, x: Array) -> Array:
        """Return an upper bound on the distance of x from the optimum.

        Args:
            x: Any unknowns, (n,).

        Returns:
            The bound entry by entry, (n,); inf if nothing is proven.
        """
        if not self.candidates:
            return np.full(x.shape, np.inf)
        return np.max([(candidate - x[:, None]).size[:, 0] for candidate in self.candidates], axis=0)

    def least_distance(self, x: Array) -> Array:
        """Return a lower bound on the distance of x from the optimum.

        Args:
            x: Any unknowns, (n,).

        Returns:
            The bound entry by entry, (n,); 0 if nothing is proven.
        """
        if not self.candidates:
            return np.zeros(x.shape)
        parts = [(candidate - x[:, None]).parts[:, :, 0] for candidate in self.candidates]
        return np.min([np.maximum(np.abs(p[0]) - 2.0 * p[2] - np.abs(p[1]), 0.0) for p in parts], axis=0)


def prove(hierarchy: Hierarchy, state: StateArray, *, assume: bool = False) -> Optimum:
    """Enclose the exact optimum of a hierarchy, with an active set as a hint.

    The set decides nothing but what is tried: a wrong one proves nothing, or leads to the right one.

    Args:
        hierarchy: The problem.
        state: −1, 0 or 1 for each bound of the box and for each row, (n + M,).
        assume: True to take rows as dependent that are independent by rounding only.

    Returns:
        The enclosure.
    """
    return Prover(hierarchy).improve(state, assume=assume)


class Prover:
    """Proofs for one hierarchy, which share what does not depend on the active set.

    Args:
        hierarchy: The problem.
        search: False to try only the active sets that are given, not those that their proofs lead to.
    """

    def __init__(self, hierarchy: Hierarchy, *, search: bool = True) -> None:
        self.problem = Scaled.of(hierarchy)
        self._search = search
        self._rounds = _ROUNDS if search else 1
        self._outcomes: dict[tuple[bytes, bool], Outcome] = {}
        self._proofs: dict[tuple[bytes, bool], tuple[Optimum, list[Pair]]] = {}

    def improve(self, state: StateArray, *, assume: bool) -> Optimum:
        """Prove from an active set; where it is refuted, change it as its own proof says.

        Args:
            state: The active set, (n + M,).
            assume: True to take rows as dependent that are independent by rounding only.

        Returns:
            The enclosure.
        """
        reason = self._unfit()
        if reason:
            return Optimum(reason=reason)
        tried: set[bytes] = set()
        found = Optimum(reason="no active set was found whose optimality can be decided")
        for _ in range(self._rounds):
            tried.add(state.tobytes())
            found, wrong = self._from(state, assume)
            changes = [self._changed(state, wrong), self._changed(state, wrong[:1])]
            untried = [change for change in changes if wrong and change.tobytes() not in tried]
            if not untried:
                break
            state = untried[0]
        return found

    def _unfit(self) -> str:
        """Return why a problem cannot be judged at all; empty if it can."""
        problem = self.problem
        if not problem.exact:
            return "its numbers are spread too widely to be scaled without rounding"
        hard = problem.zero & (problem.level == 0) & ((problem.lower > 0.0) | (problem.upper < 0.0))
        if hard.any():
            return f"{problem.name(int(np.argmax(hard)), 1)} has no coefficients and cannot hold"
        return ""

    def _from(self, state: StateArray, assume: bool) -> tuple[Optimum, list[Pair]]:
        """Prove from one active set, each once; also return its wrong pairs, those of the hard rows first."""
        key = state.tobytes(), assume
        if key not in self._proofs:
            self._proofs[key] = self._proof(state, assume)
        return self._proofs[key]

    def _proof(self, state: StateArray, assume: bool) -> tuple[Optimum, list[Pair]]:
        """Return the proof from one active set."""
        undecided: frozenset[Pair] = frozenset()
        while True:
            if len(undecided) > MOST_UNDECIDED:
                return self._hidden(undecided, "rounding hides which of these are active"), []
            kept: list[Outcome] = []
            more: set[Pair] = set()
            wrong: frozenset[Pair] = frozenset()
            for subset in _subsets(undecided):
                outcome = self._outcome(self._with(state, undecided, subset), assume)
                if outcome.unclear:
                    pairs = frozenset((i, 0) for i in outcome.unclear)
                    reason = "rounding hides whether these depend on those before them"
                    return self._hidden(pairs, reason, outcome.doubtful), []
                wrong = wrong or outcome.wrong
                if outcome.x is None:
                    more |= outcome.tangled
                elif not outcome.wrong & undecided:
                    if outcome.wrong:
                        return Optimum(reason="the active set is not optimal", refuted=True), self._in_order(
                            outcome.wrong
                        )
                    kept.append(outcome)
                    more |= outcome.undecided
                if not self._search and len(undecided | more) > MOST_UNDECIDED:
                    break  # no other subset can prove this set, and none is asked where to go on
            if more <= undecided:
                break
            # A row held at one bound whose other bound is undecided might be held at either.
            undecided |= more | {(i, int(state[i])) for i, _ in more if state[i]}
        if not kept:
            return Optimum(reason="the active set is not optimal", refuted=True), self._in_order(wrong)
        return self._proven(state, undecided, kept), []

    def _outcome(self, state: StateArray, assume: bool) -> Outcome:
        """Return the outcome of a working set, each computed once."""
        key = state.tobytes(), assume
        if key not in self._outcomes:
            self._outcomes[key] = outcome_of(self.problem, state, assume=assume)
        return self._outcomes[key]

    def _proven(self, state: StateArray, undecided: frozenset[Pair], kept: list[Outcome]) -> Optimum:
        """Return the enclosure by the solutions that remain."""
        return Optimum(
            tuple(outcome.x for outcome in kept if outcome.x is not None),
            state,
            self._names(undecided),
            self._names({(i, 0) for outcome in kept for i in outcome.assumed}),
            self._names({(i, 0) for outcome in kept for i in outcome.doubtful}),
        )

    def _hidden(self, pairs: frozenset[Pair], reason: str, doubtful: tuple[int, ...] = ()) -> Optimum:
        """Return that nothing is proven, because of some rows."""
        names = self._names(pairs)
        more = self._names({(i, 0) for i in doubtful})
        return Optimum(undecided=names, doubtful=more, reason=f"{reason}: {', '.join(names)}")

    def _names(self, pairs: set[Pair] | frozenset[Pair]) -> tuple[str, ...]:
        """Return the names of rows."""
        return tuple(self.problem.name(i, side) for i, side in sorted(pairs))

    def _in_order(self, pairs: frozenset[Pair]) -> list[Pair]:
        """Return pairs by level."""
        return sorted(pairs, key=lambda pair: (self.problem.level[pair[0]], pair))

    @staticmethod
    def _with(state: StateArray, undecided: frozenset[Pair], subset: tuple[Pair, ...]) -> StateArray:
        """Return a state in which, of the undecided pairs, exactly a subset is held."""
        changed = state.copy()
        for i, side in undecided:
            if changed[i] == side:
                changed[i] = 0
        for i, side in subset:
            changed[i] = side
        return changed

    @staticmethod
    def _changed(state: StateArray, wrong: list[Pair]) -> StateArray:
        """Return a state in which wrong pairs are held if they were not, and the other way round."""
        changed = state.copy()
        for i, side in wrong:
            changed[i] = 0 if state[i] == side else side
        return changed


def _subsets(pairs: frozenset[Pair]) -> Iterator[tuple[Pair, ...]]:
    """Yield all subsets that do not hold a row on both sides."""
    for count in range(len(pairs) + 1):
        for subset in combinations(sorted(pairs), count):
            if len({i for i, _ in subset}) == count:
                yield subset
