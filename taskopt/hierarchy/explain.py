"""A resolution in words: what is met, what is not and by how much, what holds it back, and the proof."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.certificate import TOLERANCE
from taskopt.hierarchy.layout import Block
from taskopt.hierarchy.resolution import Active, Resolution
from taskopt.hierarchy.review import LevelAccount, Review
from taskopt.hierarchy.status import Status

_MET = 1e-8  # a row that lacks less, relative to max(1, what it asks for), is met
_VERDICT = {
    Status.SOLVED: "claimed to be the optimum",
    Status.FORMULA: "a closed form; limits were not looked at",
    Status.ITERATION_LIMIT: "not finished",
    Status.INFEASIBLE: "no answer: the hard limits contradict each other",
    Status.RELAXED: "claimed to be the optimum after hard limits gave way",
    Status.BRAKED: "no optimum, it brakes: the hard limits contradict each other",
    Status.FAILED: "no answer",
}


def explain(resolution: Resolution) -> str:
    """Plain sentences, a line each; numbers carry the units that the rows were declared with."""
    lines = [f"Status: {_VERDICT[resolution.status]}.", _proof(resolution)]
    if not np.isfinite(resolution.x).all():
        return "\n".join([lines[0], f"What to do: {resolution.status.value}."])
    lines += [_task(resolution, block) for block in resolution.problem.layout.blocks if block.level > 0]
    lines += _outside(resolution)
    if resolution.review is not None:
        lines[2:2] = _accuracy(resolution.review)
        lines += _apart(resolution.review)
    held = [_price(active, resolution.problem.layout.level_count) for active in resolution.active]
    if held:
        return "\n".join([*lines, "Held back by:", *held])
    return "\n".join([*lines, "No limit and no inequality holds it back."])


def _proof(resolution: Resolution) -> str:
    certificate = resolution.certificate
    if resolution.status is Status.FORMULA:
        verdict = (
            "it is the optimum all the same"
            if certificate.proves()
            else "it is not the optimum inside the limits"
        )
    else:
        verdict = "proven" if certificate.proves() else f"not proven, which takes {TOLERANCE:g}"
    return f"Certificate: {certificate}; {verdict}."


def _accuracy(review: Review) -> list[str]:
    """How far x is from its active set solved again; nothing for a closed form."""
    if np.isnan(review.error):
        return []
    asked = f"{review.accuracy:.0e} was asked for"
    if review.error <= review.accuracy:
        return [f"Accuracy: x is right to {review.error:.1e} of its size; {asked}."]
    return [f"Not accurate: x is {review.error:.1e} of its size off, and {asked}."]


def _apart(review: Review) -> list[str]:
    """Ranks that are lost, damping, the distance to the closed form, and what it is due to."""
    lines = [line for level in review.levels for line in _decided(level)]
    head = f"Closed form: {review.difference:.3g} apart"
    if review.causes:
        return [*lines, f"{head}, because of {'; '.join(map(str, review.causes))}."]
    return [*lines, f"{head}."]


def _decided(level: LevelAccount) -> list[str]:
    name = f"Level {level.level}" if level.level else "Hard rows"
    lines = []
    if level.lost:
        lines.append(f"{name}: rank lost, {level.rank} of {level.rank + level.lost} directions are decided.")
    if level.damping > 0.0:
        least = "" if np.isinf(level.kept) else f", the smallest singular value is {level.kept:.2g}"
        lines.append(f"{name}: damped by k² up to {level.damping:.2g}{least}.")
    return lines


def _task(resolution: Resolution, block: Block) -> str:
    """'Level 1, hand: met' or what its worst row lacks."""
    lack = resolution.residuals[block.name]
    head = f"Level {block.level}, {block.name}:"
    if not len(lack):
        return f"{head} no rows."
    asked = _nearest(resolution, block)
    short = np.abs(lack) / np.maximum(1.0, np.abs(asked))
    worst = int(np.argmax(short))
    if short[worst] <= _MET:
        return f"{head} met."
    unit = f" {block.row_units[worst]}" if block.row_units[worst] else ""
    missed = int(np.count_nonzero(short > _MET))
    rows = f"{missed} of {len(lack)} rows" if len(lack) > 1 else "its row"
    return f"{head} {rows} not met, most of all {block.row_names[worst]}, by {abs(lack[worst]):.3g}{unit}."


def _nearest(resolution: Resolution, block: Block) -> Array:
    """The side of each row that counts, 0 where it has no bound on that side."""
    problem, rows = resolution.problem, block.rows
    value = problem.A[rows] @ resolution.x
    return np.clip(value, problem.lower[rows], problem.upper[rows])


def _outside(resolution: Resolution) -> list[str]:
    """Limits that x breaks, which only a closed form does."""
    problem, x, n = resolution.problem, resolution.x, resolution.problem.n
    hard = problem.layout.rows_of_level(0)
    value = np.concatenate([x, problem.A[hard] @ x])
    lower = np.concatenate([problem.box_lower, problem.lower[hard]])
    upper = np.concatenate([problem.box_upper, problem.upper[hard]])
    excess = np.maximum(lower - value, value - upper)
    broken = np.flatnonzero(excess > _MET * np.maximum(1.0, np.abs(value)))
    names = [
        problem.bound_name(int(i), bool(value[i] > upper[i])) if i < n else problem.layout.row_names[i - n]
        for i in broken
    ]
    return [f"Limit broken: {name}, by {excess[i]:.3g}." for name, i in zip(names, broken, strict=True)]


def _price(active: Active, levels: int) -> str:
    """'  velocity/joint4 upper: one unit more of it would lower the cost of level 1 by 0.3 to begin with.'"""
    if active.multiplier == 0.0:
        return f"  {active}: met exactly, at no price."
    level = f"level {active.level}" if active.level <= levels else "the norm"
    price = f"{abs(active.multiplier):.3g}"
    return f"  {active}: the cost of {level} would fall by {price} per unit that it gave way."
