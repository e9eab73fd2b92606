"""Causes of answers that change abruptly from tick to tick, their symptoms, and what helps."""

import numpy as np

from taskopt.arrays import BoolArray
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import DECISIVE_MULTIPLIER, LOST_FOR_GOOD, NEAR_RANK_LOSS, SIGN_CHANGE

ADVICE = {
    "transition": "a task comes or goes; let it take longer, by `blend` of During or `over` of a change",
    "tolerance": "its multiplier is zero, and rounding decides; widen it a little, or ask less next to it",
    "rank": (
        "a level is near a loss of rank, as where a target is out of reach; damp it, as RestDamping() of a "
        "stack does, limit the acceleration, or ask for less"
    ),
    "gain": "targets are overshot from tick to tick; lower the gain below 1/Δt",
    "dt": (
        "a target or a bound itself moves more than a step can follow; shorten Δt, lower the gain, or limit "
        "the acceleration"
    ),
}
"""What helps against each cause."""


def declared(resolution: Resolution) -> Resolution:
    """Return the answer without rows of `RestDamping`, which not every tick has.

    Args:
        resolution: The answer of a tick.

    Returns:
        The answer to the problem that the stack declares.
    """
    return resolution.undamped or resolution


def switches(previous: Resolution, now: Resolution) -> bool:
    """Return True if a row has bounds at one of two ticks only, as where a task is switched on or off.

    Args:
        previous: The answer of one tick.
        now: The answer of the next tick, to a problem of the same stack.

    Returns:
        True for a switch.
    """
    old, new = declared(previous).problem, declared(now).problem
    had = np.isfinite(old.lower) | np.isfinite(old.upper)
    has = np.isfinite(new.lower) | np.isfinite(new.upper)
    return bool((had != has).any())


def ties(previous: Resolution, now: Resolution) -> bool:
    """Return True if a bound is active at one of two ticks only, with a multiplier of zero.

    Args:
        previous: The answer of one tick.
        now: The answer of the next tick.

    Returns:
        True for a tie.
    """
    old, new = ({str(row): row.multiplier for row in tick.active} for tick in (previous, now))
    for name in old.keys() ^ new.keys():
        tick, multiplier = (previous, old[name]) if name in old else (now, new[name])
        if abs(multiplier) <= DECISIVE_MULTIPLIER * max(1.0, float(np.abs(tick.multipliers).max())):
            return True
    return False


def overshoots(previous: Resolution, now: Resolution) -> bool:
    """Return True if the right-hand side of an equality changed its sign by more than rounding.

    Args:
        previous: The answer of one tick.
        now: The answer of the next tick, to a problem of the same stack.

    Returns:
        True where a target was overshot.
    """
    old, new = declared(previous).problem, declared(now).problem
    same = (old.lower == old.upper) & (new.lower == new.upper)
    least = SIGN_CHANGE * np.maximum(1.0, np.abs(new.lower[same]))
    return bool((old.lower[same] * new.lower[same] < -(least**2)).any())


def loses_rank(previous: Resolution, now: Resolution) -> bool:
    """Return True if the rows up to some level are nearly dependent, or were so within the last step.

    Only the unknowns count that are free, which is not on a bound at both ticks. A singular value is small
    below NEAR_RANK_LOSS times the largest one, and below the change of the rows since the last tick, since it
    may have been zero on the way. Directions that are lost for good do not count. A tick that is damped is
    near a loss of rank.

    Args:
        previous: The answer of one tick.
        now: The answer of the next tick, to a problem of the same stack.

    Returns:
        True where a level is near a loss of rank.
    """
    if previous.is_damped or now.is_damped:
        return True
    old, new = declared(previous), declared(now)
    n = new.problem.n
    held: BoolArray = (old.state[:n] != 0) & (old.state[:n] == new.state[:n])
    offsets = new.problem.layout.offsets
    for k in range(1, new.problem.layout.level_count + 1):
        A, before = (tick.problem.A[: int(offsets[k + 1]), ~held] for tick in (new, old))
        if not A.size:
            continue
        sigma = np.linalg.svd(A, compute_uv=False)
        small = max(NEAR_RANK_LOSS * sigma[0], float(np.linalg.norm(A - before)))
        if ((sigma > LOST_FOR_GOOD * sigma[0]) & (sigma < small)).any():
            return True
    return False
