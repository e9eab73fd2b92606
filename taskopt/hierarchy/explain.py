"""Explanation of an answer in words: tasks that are met or missed, active limits, and the proof."""

from collections.abc import Sequence

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.active import FIXED, Active
from taskopt.hierarchy.certificate import Certificate
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.layout import Block
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.review import LevelAccount, Review
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import EXPLAINED_MET

_VERDICT = {
    Status.SOLVED: "claimed to be the optimum",
    Status.FORMULA: "a closed form; limits were not looked at",
    Status.ITERATION_LIMIT: "not finished",
    Status.INFEASIBLE: "no answer: the hard limits contradict each other",
    Status.RELAXED: "claimed to be the optimum after hard limits gave way",
    Status.BRAKED: "no optimum, it brakes: the hard limits contradict each other",
    Status.FAILED: "no answer",
}

_JUDGED = {
    Verdict.PROVEN: "proven",
    Verdict.PROVEN_IF: "undecided but for a condition",
    Verdict.REFUTED_IF: "undecided, and not the optimum on a condition",
    Verdict.REFUTED: "refuted, it is not the optimum",
    Verdict.UNDECIDED: "undecided",
}


def explain(
    problem: Hierarchy,
    x: Array,
    status: Status,
    certificate: Certificate,
    active: Sequence[Active],
    review: Review | None,
    fixed: Sequence[Active] = (),
) -> str:
    """Explain an answer in plain sentences, one on each line, in the units of the declared rows.

    Args:
        problem: The hierarchy that was answered.
        x: The answer, (n,).
        status: Claim of the resolver.
        certificate: The proof.
        active: The limits and inequalities that are active.
        review: Accuracy, ranks and causes; None if the answer was not reviewed.
        fixed: The hard bounds with lower = upper.

    Returns:
        The text.
    """
    lines = [f"Status: {_VERDICT[status]}.", _proof(status, certificate)]
    if not np.isfinite(x).all():
        return "\n".join([lines[0], f"What to do: {status.value}."])
    lines += [_task(problem, x, block) for block in problem.layout.blocks if block.level > 0]
    lines += _broken_limits(problem, x)
    if review is not None:
        lines += _closed_form(review)
    if active or fixed:
        held = [_held_back(row, problem.layout.level_count) for row in (*active, *fixed)]
        return "\n".join([*lines, "Held back by:", *held])
    if status is not Status.FORMULA and not certificate.judgement.proven:
        return "\n".join(
            [*lines, "Whether a limit or an inequality holds it back is not known: it is not proven."]
        )
    return "\n".join([*lines, "No limit and no inequality holds it back."])


def _proof(status: Status, certificate: Certificate) -> str:
    """Return the verdict with its reason, and the KKT residuals as detail."""
    judgement = certificate.judgement
    word = _JUDGED[judgement.verdict]
    if status is Status.FORMULA and judgement.proven:
        word = "it is the optimum all the same"
    if status is Status.FORMULA and judgement.verdict is Verdict.REFUTED:
        word = "it is not the optimum inside the limits"
    return f"Certificate: {word}. {judgement.reason} KKT residuals: {certificate}."


def _closed_form(review: Review) -> list[str]:
    """Return sentences on lost ranks, damping, and the distance to the closed form with its causes."""
    lines = [line for level in review.levels for line in _decided(level)]
    head = f"Closed form: {review.difference:.3g} apart"
    if review.causes:
        return [*lines, f"{head}, because of {'; '.join(map(str, review.causes))}."]
    return [*lines, f"{head}."]


def _decided(level: LevelAccount) -> list[str]:
    """Return sentences on the rank of one level, if it is not full or was damped."""
    name = f"Level {level.level}" if level.level else "Hard rows"
    lines = []
    if level.lost:
        lines.append(f"{name}: rank lost, {level.rank} of {level.rank + level.lost} directions are decided.")
    if level.damping > 0.0:
        least = "" if np.isinf(level.kept) else f", the smallest singular value is {level.kept:.2g}"
        lines.append(f"{name}: damped by k² up to {level.damping:.2g}{least}.")
    return lines


def _task(problem: Hierarchy, x: Array, block: Block) -> str:
    """Return 'Level 1, hand: met', or the error of the worst row of the task."""
    rows = block.rows
    head = f"Level {block.level}, {block.name}:"
    if block.start == block.stop:
        return f"{head} no rows."
    value = problem.A[rows] @ x
    nearest = np.clip(value, problem.lower[rows], problem.upper[rows])
    lack = value - nearest
    short = np.abs(lack) / np.maximum(1.0, np.abs(nearest))
    worst = int(np.argmax(short))
    if short[worst] <= EXPLAINED_MET:
        return f"{head} met."
    unit = f" {block.row_units[worst]}" if block.row_units[worst] else ""
    missed = int(np.count_nonzero(short > EXPLAINED_MET))
    which = f"{missed} of {len(lack)} rows" if len(lack) > 1 else "its row"
    return f"{head} {which} not met, most of all {block.row_names[worst]}, by {abs(lack[worst]):.3g}{unit}."


def _broken_limits(problem: Hierarchy, x: Array) -> list[str]:
    """Return a sentence for each limit that x violates, which only a closed form may do."""
    stop = int(problem.layout.offsets[1])
    value, (lower, upper) = problem.values(x, stop), problem.bounds(stop)
    outside = excess(value, lower, upper)
    broken = np.flatnonzero(outside > EXPLAINED_MET * np.maximum(1.0, np.abs(value)))
    names = [problem.name_of(int(i), bool(value[i] > upper[i])) for i in broken]
    return [f"Limit broken: {name}, by {outside[i]:.3g}." for name, i in zip(names, broken, strict=True)]


def _held_back(active: Active, levels: int) -> str:
    """Return a sentence on a bound and the rate at which the level's cost falls as the bound gives way."""
    level = f"level {active.level}" if active.level <= levels else "the norm"
    price = f"{abs(active.multiplier):.3g}"
    if active.side == FIXED:
        moved = (
            f"the cost of {level} would change by {price} per unit" if active.multiplier else "at no price"
        )
        return f"  {active}, so it cannot move: {moved}."
    if active.multiplier == 0.0:
        return f"  {active}: met exactly, at no price."
    return f"  {active}: the cost of {level} would fall by {price} per unit that it gave way."
