"""What tells a search that gets on from one that goes round in circles."""

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.jit import kernel
from taskopt.resolver.active_set.workspace import Locks


@kernel
def repeats(seen: IntArray, drops: int, state: StateArray, locks: Locks) -> bool:
    """Return True if the search stands where it stood at the last mark: from there on it would only cycle.

    After a full step, W and the locks alone decide all that follows. They are marked at each drop whose
    number is a power of two, so that a cycle of any length is found. Source: Brent (1980), "An improved Monte
    Carlo factorization algorithm", BIT 20, Sect. 2.

    Args:
        seen: (n + M,) the last mark, or −1; overwritten at the next one.
        drops: Number of this drop, from 1 on.
        state: (n + M,) the working set.
        locks: The locks.

    Returns:
        True if working set and locks are those of the mark.
    """
    same, marks = True, drops & (drops - 1) == 0
    for j in range(state.size):
        mark = 2 + state[j] + 4 * locks.locked[j] + 8 * locks.dropped[j]
        same &= seen[j] == mark
        if marks:
            seen[j] = mark
    return same


@kernel
def moves(x: Array, goal: Array, alpha: float, moved: float) -> bool:
    """Return True if a step moves an unknown by more than rounding.

    Args:
        x: (n,) the point.
        goal: (n,) where the full step leads.
        alpha: Share of the step that is taken.
        moved: Relative change of an unknown up to which a step counts as none.

    Returns:
        True if one of them changes by more.
    """
    for j in range(x.size):
        if alpha * abs(goal[j] - x[j]) > moved * max(1.0, abs(x[j])):
            return True
    return False
