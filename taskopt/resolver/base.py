"""The protocol of a resolver, (hierarchy, memory) → (resolution, memory), and functions for all resolvers."""

from functools import partial
from math import isfinite
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.certificate import certify, largest_entry
from taskopt.hierarchy.intervals import excess, nearer_side
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY, COUNTED_MULTIPLIER, COUNTED_VIOLATION
from taskopt.hierarchy.view import Answer, answer_of
from taskopt.jit import kernel
from taskopt.resolver.tick_review import Accounts, TickReview


class Memory(NamedTuple):
    """The data that a resolver carries from one tick to the next.

    It is a plain value and can be logged. A tick that is resolved again from its memory gives the same
    answer.

    Attributes:
        state: (n + M,) final active set, unknowns first, then rows: −1 at the lower bound, +1 at the upper
            one, 0 for inactive.
        ranks: Rank that each level decided, the hard rows first; empty for resolvers that do not decide ranks
            with hysteresis.
        previous: (n + M,) active set of the tick before; None after the first tick.
        alternates: True if the active set of tick k resembled that of k − 2 more than that of k − 1. The next
            tick is then warm-started from `previous`.
    """

    state: StateArray
    ranks: tuple[int, ...] = ()
    previous: StateArray | None = None
    alternates: bool = False


def checked(memory: Memory | None, layout: Layout) -> Memory | None:
    """Check that a memory fits a hierarchy of a layout, and return it.

    Args:
        memory: Memory from a resolver or from a log; None for a cold start.
        layout: Layout of the hierarchy to be resolved.

    Returns:
        The same memory.

    Raises:
        InvalidValue: It is not a `Memory`, or its active set or ranks belong to another layout.
    """
    if memory is None:
        return None
    if not isinstance(memory, Memory):
        raise InvalidValue(f"memory must be what a resolver returned last, got {type(memory).__name__}")
    for state in (memory.state, memory.previous):
        if state is not None and not _is_state(state, layout.width):
            raise InvalidValue(
                f"memory must hold -1, 0 or 1 for each of {layout.width} unknowns and rows, got {state!r}"
            )
    if len(memory.ranks) > layout.level_count + 1:
        raise InvalidValue(f"memory must hold a rank for each of {layout.level_count + 1} levels at most")
    return memory


def _is_state(state: object, width: int) -> bool:
    """Return True for an active set of `width` members; it may come from a log, in any integer type."""
    if not isinstance(state, np.ndarray) or state.shape != (width,) or state.dtype.kind != "i":
        return False
    if state.dtype == np.int8:
        return bool(_are_sides(state))
    return not width or bool(state.min() >= -1 and state.max() <= 1)


@kernel
def _are_sides(state: StateArray) -> bool:
    """Return True if each entry is −1, 0 or 1."""
    sides = True
    for side in state:
        sides &= -1 <= side <= 1
    return sides


def missing_parts(resolver: object) -> list[str]:
    """Return the parts of the protocol `Resolver` that an object lacks.

    Args:
        resolver: Any object.

    Returns:
        Names of the missing parts; empty for a complete resolver.
    """
    return [part for part in ("name", "strict", "closed_form", "__call__") if not hasattr(resolver, part)]


@runtime_checkable
class Resolver(Protocol):
    """A resolver, which answers one hierarchy after the other.

    It must not change the hierarchy, and must not keep anything from one call to the next except in the
    memory that it returns. The status of its answer is its claim; the certificate of the answer decides.
    `taskopt.testing.check_resolver` tests these promises on any implementation.
    """

    @property
    def name(self) -> str:
        """Name of the resolver in logs, tables and messages, such as "hqp/daqp"."""
        ...

    @property
    def strict(self) -> bool:
        """True if priorities between levels are exact, so that answers of strict resolvers agree."""
        ...

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Memory that the last call returned, for a warm start; None for a cold start.

        Returns:
            The answer, and the memory for the next call.
        """
        ...

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of the formula for the same problem without inequalities and limits.

        Args:
            hierarchy: The problem of this tick.

        Returns:
            The closed-form answer. It equals the answer of the resolver if no inequality is active.
        """
        ...


def require_answer(returned: object, name: str, hierarchy: Hierarchy) -> tuple[Resolution, Memory]:
    """Check that a user's resolver returned an answer to its hierarchy, and return that answer.

    Args:
        returned: The object that the resolver returned.
        name: Name of the resolver, for the message.
        hierarchy: The hierarchy that it was given.

    Returns:
        The same resolution and memory.

    Raises:
        InvalidValue: The object is not a pair of a `Resolution` and a `Memory`, the number of unknowns is
            wrong, or the status is not a `Status`.
    """
    if (
        isinstance(returned, tuple)
        and len(returned) == 2
        and isinstance(returned[0], Resolution)
        and isinstance(returned[1], Memory)
        and isinstance(returned[0].status, Status)
        and returned[0].x.shape == (hierarchy.n,)
    ):
        return returned[0], returned[1]
    fault = _fault_of_answer(returned, hierarchy.n)
    raise InvalidValue(f"resolver {name} {fault}; taskopt.testing.check_resolver tries its promises")


def _fault_of_answer(returned: object, n: int) -> str:
    """Describe the fault of an answer to a hierarchy of n unknowns; return "" if there is none."""
    if not isinstance(returned, tuple):
        return f"returned {type(returned).__name__} instead of the pair (Resolution, Memory)"
    kinds = ", ".join(type(part).__name__ for part in returned)
    if len(returned) != 2 or not (isinstance(returned[0], Resolution) and isinstance(returned[1], Memory)):
        return f"returned ({kinds}) instead of the pair (Resolution, Memory)"
    if not isinstance(returned[0].status, Status):
        return f"returned the status {returned[0].status!r} instead of a taskopt.Status"
    return f"returned x of shape {returned[0].x.shape} instead of ({n},)"


def answered(
    hierarchy: Hierarchy,
    x: Array,
    multipliers: Array,
    state: StateArray,
    status: Status,
    iterations: int = 0,
    accuracy: float = ACCURACY,
    levels: tuple[LevelAccount, ...] = (),
) -> tuple[Resolution, Memory]:
    """Pack an answer with its certificate, a reviewer, and the memory for the next tick.

    Args:
        hierarchy: The problem that is answered; its numbers are copied into the resolution.
        x: (n,) the answer.
        multipliers: (levels + 1, n + M) multipliers by level, unknowns first, then rows.
        state: (n + M,) final active set, see `Memory`.
        status: Claim of the resolver; SOLVED becomes FAILED if x is not finite.
        iterations: Iterations that were spent.
        accuracy: Accuracy that was asked for in x, relative to its largest entry.
        levels: Ranks and damping by level, where the resolver decided them.

    Returns:
        The resolution, and a memory with the active set and the ranks.
    """
    layout = hierarchy.layout
    answer = np.empty(layout.answer_size)
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    parts.x[:], parts.multipliers[:], parts.problem[:] = x, multipliers, hierarchy.buffer
    parts.residuals[:] = certify(hierarchy, parts.x, parts.multipliers).residuals
    if status is Status.SOLVED and not np.isfinite(parts.x).all():
        status = Status.FAILED
    reviewer = partial(TickReview, accuracy=accuracy, own=levels)
    memory = Memory(state, tuple(level.rank for level in levels))
    return Resolution(hierarchy, answer, state, status, iterations, reviewer), memory


def answered_by_x(
    hierarchy: Hierarchy,
    x: Array,
    status: Status,
    iterations: int = 0,
    accuracy: float = ACCURACY,
    levels: Accounts = (),
    counted: float | None = None,
) -> Resolution:
    """Pack an answer whose multipliers, residuals and active set are computed when they are asked for.

    Args:
        hierarchy: The problem that is answered; its numbers are copied into the resolution.
        x: (n,) the answer.
        status: Claim of the resolver; SOLVED becomes FAILED if x is not finite.
        iterations: Iterations that were spent.
        accuracy: Accuracy that was asked for in x, relative to its largest entry.
        levels: Ranks and damping by level, where the resolver decided them, or a function that returns them.
        counted: Least multiplier that makes a row active, see `final_state`; None if no row is active.

    Returns:
        The resolution.
    """
    layout, buffer = hierarchy.layout, hierarchy.buffer
    answer, state = np.empty(layout.answer_size), np.zeros(layout.width, dtype=np.int8)
    answer[layout.place_of_x] = x
    answer[answer.size - buffer.size :] = buffer
    if status is Status.SOLVED and not is_finite(x):
        status = Status.FAILED
    reviewer = partial(TickReview, accuracy=accuracy, own=levels)
    return Resolution(
        hierarchy, answer, state, status, iterations, reviewer, partial(_complete, counted=counted)
    )


def is_finite(x: Array) -> bool:
    """Return True if no entry of a vector is NaN or infinite.

    Args:
        x: Vector, (n,).

    Returns:
        The same as NumPy's `isfinite` and `all`, in a fraction of their time.
    """
    return isfinite(largest_entry(x))


def _complete(problem: Hierarchy, parts: Answer, state: StateArray, counted: float | None) -> None:
    """Fill multipliers that fit x best, the residuals that they leave, and the active set."""
    parts.multipliers[:] = find_multipliers(problem, parts.x) if is_finite(parts.x) else 0.0
    parts.residuals[:] = certify(problem, parts.x, parts.multipliers).residuals
    if counted is not None:
        state[:] = final_state(problem, parts.x, parts.multipliers, counted)


def fit_again(hierarchy: Hierarchy, answer: Array) -> bool:
    """Find other multipliers with which the x of an answer meets its KKT conditions, and write them there.

    If two rows are equal up to rounding, an active-set method can end with multipliers that do not fit x
    although x is the optimum. `find_multipliers` finds the multipliers that fit x best.

    Args:
        hierarchy: The problem that is answered.
        answer: Flat array of an answer (see `taskopt.hierarchy.view`). Its multipliers and its certificate
            are overwritten if the new ones fit x.

    Returns:
        True if no KKT residual of x with the new multipliers exceeds `KKT_MET`.
    """
    layout = hierarchy.layout
    parts = answer_of(answer, layout.n, layout.row_count, layout.level_count)
    y = find_multipliers(hierarchy, parts.x)
    certificate = certify(hierarchy, parts.x, y)
    if certificate.kkt_met():
        parts.multipliers[:], parts.residuals[:] = y, certificate.residuals
    return certificate.kkt_met()


def final_state(
    hierarchy: Hierarchy, x: Array, y: Array, threshold: float = COUNTED_MULTIPLIER
) -> StateArray:
    """Return the active set of an answer, from its multipliers and violations.

    A row is active if it has a multiplier at any level or if it is violated. Equalities are never active.

    Args:
        hierarchy: The problem that is answered.
        x: (n,) the answer.
        y: (levels + 1, n + M) its multipliers by level.
        threshold: Least multiplier that counts, relative to max(1, largest of its level).

    Returns:
        (n + M,) −1 where the lower bound is active or nearer, +1 where the upper one is, 0 elsewhere.
    """
    value, (lower, upper) = hierarchy.values(x), hierarchy.bounds()
    largest = np.maximum(1.0, np.abs(y).max(axis=1, keepdims=True))
    has_multiplier = (np.abs(y) > threshold * largest).any(axis=0)
    violated = excess(value, lower, upper) > COUNTED_VIOLATION * np.maximum(1.0, np.abs(value))
    side = nearer_side(value, lower, upper)
    return np.where((has_multiplier | violated) & (lower != upper), side, 0).astype(np.int8)
