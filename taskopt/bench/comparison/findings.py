"""What a comparison shows, and what it does not: sentences of which every number comes from the rows."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from taskopt.bench.comparison.results import Figures, Results, all_figures, figures
from taskopt.bench.comparison.words import digits, micro, named, share

_ALMOST_ALL = 0.99  # share of claimed and of right answers from which a resolver is reliable
_NAMED = 3  # resolvers that a finding names after the first


class Finding(NamedTuple):
    """An answer to a question that a reader has.

    Attributes:
        question: The question in a few words.
        answer: The answer in sentences.
    """

    question: str
    answer: str


def is_reliable(one: Figures) -> bool:
    """Return True for a resolver that claims, and is right in, 99 % of the problems, none of it refuted.

    Args:
        one: Its figures; where no problem has an optimum, its claims count alone.

    Returns:
        True if it may be named as accurate or quick.
    """
    right = np.isnan(one.right) or one.right >= _ALMOST_ALL
    return bool(right and one.claimed >= _ALMOST_ALL and one.refuted == one.refuted_if == 0.0)


def findings(rows: Results) -> Iterator[Finding]:
    """Answer the questions that a reader has first.

    Args:
        rows: All rows.

    Yields:
        Which resolver is the most accurate, which is the quickest warm and cold, which ones claim what they
        do not reach, where the closed form suffices, and what is left undecided.
    """
    some = rows.well_scaled if len(rows.well_scaled) else rows
    found = all_figures(some)
    reliable = [one for one in found if is_reliable(one)]
    yield Finding("Most accurate", _accurate(reliable))
    for setting in ("warm", "cold"):
        quick = sorted((one for one in reliable if one.setting == setting), key=lambda one: one.mean)
        yield Finding(f"Quickest {setting}", _quick(quick))
    yield Finding("Claim what they do not reach", _refuted(found))
    if closed := _closed_form(rows):
        yield Finding("The closed form suffices", closed)
    yield Finding("Undecided", _undecided(rows))


def _accurate(reliable: list[Figures]) -> str:
    """Name the most accurate."""
    order = sorted((one for one in reliable if one.known), key=lambda one: one.distance[2])
    if not order:
        return f"None claims, and is right in, {share(_ALMOST_ALL)} of the problems."
    first = order[0]
    text = (
        f"`{named(first)}`: none of its {first.known} answers where the optimum is known is further than "
        f"{digits(first.distance[2])} from it."
    )
    best = {one.resolver: one for one in reversed(order)}  # the better setting of each
    others = sorted(best.values(), key=lambda one: one.distance[2])[1:]
    return text + _next(f"{named(one)} ({digits(one.distance[2])})" for one in others)


def _quick(order: list[Figures]) -> str:
    """Name the quickest."""
    if not order:
        return f"None that is right in {share(_ALMOST_ALL)} of the problems."
    first = order[0]
    text = f"`{first.resolver}`: {micro(first.mean)} µs of processor time an answer, in the mean."
    if len(order) == 1:
        return f"{text} No other that is right in {share(_ALMOST_ALL)} of the problems runs in this setting."
    return text + _next(f"{one.resolver} ({micro(one.mean)})" for one in order[1:])


def _next(texts: Iterable[str]) -> str:
    """Return a sentence on those that follow the first one."""
    kept = [*texts][:_NAMED]
    return f" Next: {', '.join(kept)}." if kept else ""


def _refuted(found: list[Figures]) -> str:
    """Name all whose claims are refuted, with the share of the problems, apart for default tolerances."""
    false = sorted((one for one in found if one.refuted > 0.0), key=lambda one: -one.refuted)
    parts = []
    for default, words in ((True, "With the tolerances that solvers have by default"), (False, "Otherwise")):
        some = [one for one in false if (one.setting == "defaults") is default]
        texts = [f"{one.resolver} ({share(one.refuted)})" for one in some]
        parts.append(f"{words}: {', '.join(texts) or 'none'}.")
    return f"In brackets: share of the problems in which the claim is refuted. {' '.join(parts)}"


def _closed_form(rows: Results) -> str:
    """Say where the pseudo-inverse has the optimum."""
    pinv = rows.where(resolver="pinv", setting="cold")
    if not len(pinv):
        return ""
    right = {name: figures(pinv.where(set=name)) for name in pinv.names("set")}
    enough = [f"{name} ({one.answers})" for name, one in right.items() if one.right == 1.0]
    part = [f"{name} ({share(one.right)})" for name, one in right.items() if 0.0 < one.right < 1.0]
    text = f"`pinv` has the exact optimum in all problems of: {', '.join(enough) or 'no set'}"
    some = f"; in a part of: {', '.join(part)}" if part else ""
    return f"{text}{some}; in no other set. In brackets: problems, or their share."


def _undecided(rows: Results) -> str:
    """Say how many claims the judge cannot tell, and how many it tells on a condition only."""
    by_set = {name: figures(rows.where(set=name)) for name in rows.names("set")}
    name = max(by_set, key=lambda one: by_set[one].undecided)
    text = f"The judge cannot tell for at most {share(by_set[name].undecided)} of the answers to a set"
    text += f" ({name})." if by_set[name].undecided else "."
    split = {name: one.proven_if + one.refuted_if for name, one in by_set.items()}
    some = [f"{name} ({share(value)})" for name, value in split.items() if value]
    if some:
        text += (
            f" It tells on a condition in: {', '.join(some)}. The condition is that rows which depend on "
            "others up to rounding depend on them exactly, as those of a robot do."
        )
    own = rows.where(resolver="active-set")
    if len(own):
        text += f" Of the answers of active-set, {share(figures(own).refuted)} are refuted."
    return text


_AIMS = (
    "The exact optimum is that of strict levels. wqp/ promises another one, that of its weighted "
    "problem, and pqp/ that of its projected one: their claims are judged by that, their distance and "
    "right by strict levels. wqp@R/ has the ratio R between the weights of levels. pinv, dls, transpose "
    "and srtp claim nothing, and keep no limits; srtp keeps priorities, and does not minimise lower "
    "levels; sns claims nothing, and scales levels instead of minimising "
    "them. daqp-hierarchy is judged by strict levels, which it claims."
)
"""What the ways of resolving aim at, and by what each is judged."""


def limits_of_comparison(rows: Results) -> Iterator[str]:
    """Say what the comparison does not show.

    Args:
        rows: All rows.

    Yields:
        Sentences.
    """
    here = rows.conditions["machine"]
    yield f"All times are from one machine: {here['cpu']}, {here['cores']} cores, {here['system']}."
    yield (
        "hqp/ and wqp/ call a solver through code of ours in Python, which takes longer than most solvers: "
        "their times compare ways of resolving as this library offers them, not solvers alone."
    )
    yield (
        "The judge, the exact references and active-set are by the same authors; they share the declaration "
        "of a hierarchy only. Rational references share nothing with the resolvers."
    )
    yield _AIMS
    yield (
        f"Each problem is timed {rows.conditions['repeats']} times (once if it takes more than 20 ms), after "
        "an untimed answer to the first one, and the median counts; a time limit or another load of the "
        "machine can change answers of solvers that adapt to time (osqp, highs). Answers of proxqp differ "
        "from run to run in digits that are not shown."
    )
    yield "The sets are small, and each is of one kind; a mean over all of them depends on which there are."
