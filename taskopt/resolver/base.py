"""What every resolver is: (hierarchy, memory) → (resolution, memory)."""

from functools import partial
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.certificate import certify, certify_kernel
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.multipliers import find_multipliers
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.review import LevelAccount
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import ACCURACY
from taskopt.resolver.tick_review import TickReview

_COUNTS = 1e-9  # a price or violation below it, relative, is solver accuracy


class Memory(NamedTuple):
    """What a resolver carries from one tick to the next: the final active set, (n + M,), -1, 0, +1.

    A plain value: it can be logged, and a tick that is resolved again from it comes out the same.
    `ranks`: what each level decided, the hard rows first, for those who decide it with hysteresis.
    `previous` is the active set of the tick before; `alternates`: the active set of tick k resembled that
    of k − 2 more than that of k − 1, so that tick k + 1 is warm-started from `previous`.
    """

    state: StateArray
    ranks: tuple[int, ...] = ()
    previous: StateArray | None = None
    alternates: bool = False


def checked(memory: Memory | None, layout: Layout) -> Memory | None:
    """The memory, if it is one of a hierarchy of this layout; raise `InvalidValue` if it is not."""
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
    """Whether it is an active set of `width` members; it may come from a log, in any integer type."""
    if not isinstance(state, np.ndarray) or state.shape != (width,) or state.dtype.kind != "i":
        return False
    return not width or bool(state.min() >= -1 and state.max() <= 1)


@runtime_checkable
class Resolver(Protocol):
    """Resolves one tick; `strict` says whether priorities are exact, so that answers may be compared."""

    @property
    def name(self) -> str: ...

    @property
    def strict(self) -> bool: ...

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:
        """The answer, and what the next tick should be told."""
        ...

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """x (n,) of the closed form of the same problem; it knows no inequality and no limit."""
        ...


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
    """Pack x (n,) and multipliers (levels + 1, n + M) with their certificate and a reviewer.

    `accuracy`: what was asked for in x; `levels`: ranks and damping, where the resolver decided them.
    """
    layout = hierarchy.layout
    answer = np.empty(layout.answer_size)
    answer[: layout.n] = x
    stop = layout.n + multipliers.size
    answer[layout.n : stop] = multipliers.ravel()
    end = layout.answer_size - layout.size
    residuals = answer[stop:end].reshape(layout.level_count + 1, 4)
    answer[end:] = hierarchy.buffer
    certify_kernel(
        hierarchy.buffer,
        hierarchy.norm.ravel(),
        layout.offsets,
        layout.columns,
        answer[: layout.n],
        answer[layout.n : stop].reshape(layout.level_count + 1, -1),
        residuals,
    )
    if not np.isfinite(answer[: layout.n]).all() and status is Status.SOLVED:
        status = Status.FAILED
    reviewer = partial(TickReview, accuracy=accuracy, own=levels)
    memory = Memory(state, tuple(level.rank for level in levels))
    return Resolution(hierarchy, answer, state, status, iterations, reviewer), memory


def prove_again(hierarchy: Hierarchy, answer: Array) -> bool:
    """A second hearing for x, the multipliers and certificate in `answer` replaced if it succeeds.

    Where two rows agree but for rounding, the prices that an active set ends with may be the wrong ones
    though x is right: then those decide that speak best for x.
    """
    n = hierarchy.n
    y = find_multipliers(hierarchy, answer[:n])
    certificate = certify(hierarchy, answer[:n], y)
    if certificate.proves():
        stop = n + y.size
        answer[n:stop], answer[stop : stop + 4 * len(y)] = y.ravel(), certificate.residuals.ravel()
    return certificate.proves()


def final_state(hierarchy: Hierarchy, x: Array, y: Array, priced: float = _COUNTS) -> StateArray:
    """(n + M,) -1 or +1 where an inequality is violated or has a price at any level, by its nearer bound.

    `priced`: the least price that counts, relative to max(1, the largest of its level).
    """
    lower = np.concatenate([hierarchy.box_lower, hierarchy.lower])
    upper = np.concatenate([hierarchy.box_upper, hierarchy.upper])
    value = np.concatenate([x, hierarchy.A @ x])
    largest = np.maximum(1.0, np.abs(y).max(axis=1, keepdims=True))
    held = (np.abs(y) > priced * largest).any(axis=0)
    outside = np.maximum(lower - value, value - upper) > _COUNTS * np.maximum(1.0, np.abs(value))
    side = np.where(np.abs(value - lower) < np.abs(upper - value), -1, 1)
    return np.where((held | outside) & (lower != upper), side, 0).astype(np.int8)
