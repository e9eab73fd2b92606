"""The verdict on a search, from where its descents ended and from what holds the nearest end back."""

from collections.abc import Sequence
from typing import NamedTuple

from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import GOAL_ORIENTATION, GOAL_POSITION
from taskopt.loop.pose.solution import GoalError, Verdict
from taskopt.loop.pose.stack import TRUST_REGION

CONFIRMED = 3  # ends at the least error that make it the least of all
_SPOKEN = 4  # limits that a sentence names
SAME_END = 0.01  # share by which the merits of two ends may differ that count as the same error


class Evidence(NamedTuple):
    """The evidence after all starts of a search.

    Attributes:
        starts: Number of starts.
        ends: Number of starts whose error is the least one, but for `SAME_END`.
        errors: Error of each goal at the nearest end, by name.
        limits: Limits that hold the nearest end back, by name and side.
        free: True if the goals are met without the limits; False where that was not found or not tried.
    """

    starts: int
    ends: int
    errors: dict[str, GoalError]
    limits: tuple[str, ...]
    free: bool


def judge(known: Evidence) -> tuple[Verdict, str]:
    """Judge a search none of whose starts has met the goals.

    Args:
        known: The evidence.

    Returns:
        The verdict, and its reason in one sentence.
    """
    lacks = _lack(known.errors)
    names = _listed(known.limits)
    held = f", held by {names}" if known.limits else ""
    if known.limits and known.free and known.ends >= CONFIRMED:
        return Verdict.LIMIT, (
            f"{names} {'are' if len(known.limits) > 1 else 'is'} in the way: {known.ends} of {known.starts} "
            f"starts end at the least error, {lacks}, and without limits the goals are met"
        )
    if known.ends >= CONFIRMED:
        return Verdict.UNREACHABLE, (
            f"the goals are out of reach: {known.ends} of {known.starts} starts end at the least error, "
            f"{lacks}{held}, and none comes nearer"
        )
    return Verdict.LOCAL_MINIMUM, (
        f"none of {known.starts} starts meets the goals: the nearest lacks {lacks}{held}, and only "
        f"{known.ends} came that near; more starts may find a posture"
    )


def reason_of_success(starts: int) -> str:
    """Return the reason of the verdict SOLVED.

    Args:
        starts: Number of starts that were tried.

    Returns:
        One sentence.
    """
    which = "from the first start" if starts == 1 else f"from start {starts}"
    return f"the goals are met to {GOAL_POSITION:g} m and {GOAL_ORIENTATION:g} rad {which}"


def limits_in_the_way(resolution: Resolution, levels: int) -> tuple[str, ...]:
    """Return the limits and inequalities that hold back the goals at a posture where nothing moves.

    Args:
        resolution: The resolution there.
        levels: Number of levels, from the first on, that the goals and all before them take.

    Returns:
        Names with sides, the one with the largest multiplier first.
    """
    found = [
        active
        for active in resolution.level_multipliers
        if active.level <= levels and not active.name.startswith(TRUST_REGION)
    ]
    found.sort(key=lambda active: -abs(active.multiplier))
    return tuple(dict.fromkeys(str(active) for active in found))


def _listed(names: Sequence[str]) -> str:
    """Return names as a list in a sentence; of many, the first ones and how many more there are."""
    if len(names) > _SPOKEN + 1:
        names = [*names[:_SPOKEN], f"{len(names) - _SPOKEN} more"]
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _lack(errors: dict[str, GoalError]) -> str:
    """Return in words what the goals lack."""
    lacking = {name: error for name, error in errors.items() if any(value > 0.0 for value in error)}
    return "; ".join(f"{error} of '{name}'" for name, error in lacking.items())


def same_ends(merits: Sequence[float]) -> int:
    """Count the descents that ended at the least merit.

    Args:
        merits: Merit of each end.

    Returns:
        Number of such descents, that with the least merit included.
    """
    least = min(merits)
    return sum(merit <= least * (1.0 + SAME_END) for merit in merits)
