"""A look at levels: prices with units, singular values, and at some ticks ranks, damping and residuals."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, IntArray
from taskopt.hierarchy.layout import Block
from taskopt.hierarchy.tolerances import COUNTED_MULTIPLIER
from taskopt.log.spans import price_unit
from taskopt.recording.derived.answers import Answers
from taskopt.resolver.registry import resolver, resolver_names


@dataclass(frozen=True, eq=False)
class Prices:
    """The prices of limits at one level.

    Attributes:
        level: 1 for the first; one more than the number of levels for the norm.
        names: Names of the unknowns and rows that ever have one, (m,).
        values: (k, m); NaN where the resolver gives none.
        unit: Unit of all of them; several between commas.
    """

    level: int
    names: tuple[str, ...]
    values: Array
    unit: str


def prices(answers: Answers) -> list[Prices]:
    """Find the prices of limits, level by level.

    Args:
        answers: The ticks.

    Returns:
        One entry for each level at which a limit has a price.
    """
    layout, k = answers.log.layout, len(answers.rows)
    values = answers.column("multipliers").reshape(k, layout.level_count + 1, layout.width)
    bounds, count = answers.column("bounds"), layout.row_count
    may = np.hstack([np.ones((k, layout.n), bool), bounds[:, :count] < bounds[:, count:]])
    may[:, layout.n : layout.n + int(layout.offsets[1])] = True
    values = np.where(may[:, None, :], values, 0.0)
    size = np.abs(np.nan_to_num(values))
    counted = size > COUNTED_MULTIPLIER * np.maximum(1.0, size.max(axis=(1, 2), keepdims=True))
    names = (*layout.unknowns, *layout.row_names)
    found = []
    for place in range(layout.level_count + 1):
        columns = np.flatnonzero(counted[:, place].any(axis=0))
        if len(columns):
            units = dict.fromkeys(price_unit(answers.log, int(i), place + 1) for i in columns)
            own = tuple(names[i] for i in columns)
            found.append(Prices(place + 1, own, values[:, place][:, columns], ", ".join(units)))
    return found


def singular_values(answers: Answers, block: Block, places: IntArray) -> Array:
    """Return the singular values of the rows of a task.

    Args:
        answers: The ticks.
        block: The rows of the task.
        places: The ticks that are looked at, (s,).

    Returns:
        (s, min(m, n)), the largest first, in the units of the rows.
    """
    layout = answers.log.layout
    A = answers.column("A").reshape(len(answers.rows), layout.row_count, layout.n)
    return np.linalg.svd(A[places][:, block.rows], compute_uv=False)


class Look(NamedTuple):
    """What a closer look at some ticks finds, which takes a millisecond for each.

    Attributes:
        places: The ticks, (s,).
        ranks: Rank of each level, the hard rows first, (s, L + 1).
        damping: The largest k² at each level, the hard rows first, (s, L + 1).
        residual: The largest KKT residual, (s,).
        apart: The largest difference from the closed form, (s,); NaN where the resolver is not known here.
    """

    places: IntArray
    ranks: Array
    damping: Array
    residual: Array
    apart: Array


def look(answers: Answers, places: IntArray) -> Look:
    """Look closely at some ticks.

    Args:
        answers: The ticks.
        places: The ticks that are looked at, (s,).

    Returns:
        What is found; NaN where a resolver has no account of its levels.
    """
    size = len(places), answers.log.layout.level_count + 1
    ranks, damping = np.full(size, np.nan), np.full(size, np.nan)
    residual, apart = np.full(size[0], np.nan), np.full(size[0], np.nan)
    known = answers.resolver in resolver_names()
    closed = resolver(answers.resolver).closed_form if known else None
    for row, place in enumerate(places.tolist()):
        tick = answers.log.tick(int(answers.rows[place]))
        answer = tick.resolution
        residual[row] = answer.certificate.worst
        if closed is not None:
            apart[row] = np.abs(answer.x - closed(answer.problem)).max()
        for account in answer.review.levels if answer.review is not None else ():
            if account.level < size[1]:
                ranks[row, account.level], damping[row, account.level] = account.rank, account.damping
    return Look(places, ranks, damping, residual, apart)
