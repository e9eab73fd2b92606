"""One resolver on one sequence of problems: answers, times, verdicts, distances from the optimum."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array
from taskopt.bench.comparison.reference import Reference
from taskopt.errors import InvalidValue, TaskoptError
from taskopt.hierarchy.intervals import excess
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.proof import Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import REGRETTED
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.registry import resolver
from taskopt.resolver.regret import level_residuals
from taskopt.solver.inside import nanoseconds_inside
from taskopt.solver.registry import at_defaults

Value = str | int | float | bool
Row = dict[str, Value]

REPEATED = 0.02  # [s] an answer that takes longer is timed once only
PROVEN, REFUTED, UNKNOWN, NO_CLAIM = "proven", "refuted", "undecided", "no claim"
PROVEN_IF, REFUTED_IF = "proven if", "refuted if"  # on the condition that `ROW` states

_WORDS = {
    Verdict.PROVEN: PROVEN,
    Verdict.PROVEN_IF: PROVEN_IF,
    Verdict.REFUTED: REFUTED,
    Verdict.REFUTED_IF: REFUTED_IF,
    Verdict.UNDECIDED: UNKNOWN,
}


@dataclass(frozen=True)
class Setting:
    """How a resolver is asked.

    Attributes:
        name: Name of the setting.
        warm: True to hand it the memory of the problem before.
        defaults: True to leave a solver its own default tolerances.
        about: What it means, in a sentence.
    """

    name: str
    warm: bool
    defaults: bool
    about: str


SETTINGS = {
    row.name: row
    for row in (
        Setting("cold", False, False, "Each problem is resolved without a memory, to 1e-8."),
        Setting(
            "warm", True, False, "Each but the first is resolved with the memory of the one before, to 1e-8."
        ),
        Setting(
            "defaults", False, True, "As cold, but solvers keep the tolerances that they have by default."
        ),
    )
}


class Timed(NamedTuple):
    """An answer with its times.

    Attributes:
        resolution: The answer.
        memory: Memory for the next problem.
        wall: Median of the wall clock [s].
        cpu: Median of the processor time of the process, all threads together [s].
        inside: Median of the wall clock inside the package of the solver [s].
    """

    resolution: Resolution
    memory: Memory
    wall: float
    cpu: float
    inside: float


def trial(
    references: Sequence[Reference], answer: Resolver, setting: Setting, repeats: int = 3
) -> Iterator[Row]:
    """Resolve a sequence of problems, and judge each answer.

    Args:
        references: The problems with their exact answers.
        answer: The resolver.
        setting: How it is asked.
        repeats: How often each problem is resolved and timed.

    Yields:
        A row for each problem; `ROW` explains its columns.
    """
    memory: Memory | None = None
    before: Resolution | None = None
    for index, known in enumerate(references):
        row: Row = {**BLANK, "index": index, "reference": known.kind}
        try:
            timed = _timed(answer, known.problem, memory if setting.warm else None, repeats)
        except TaskoptError as error:
            memory = before = None
            yield {**row, "status": "REFUSED", "note": str(error)}
            continue
        memory, found = timed.memory, timed.resolution
        effort: Row = {"iterations": found.iterations, "changes": _changes(found, before)}
        times: Row = {"wall": timed.wall, "cpu": timed.cpu, "inside": timed.inside}
        times["fallback"] = found.fallback or ""
        claim: Row = {"status": found.status.name, "claimed": found.claimed}
        yield {**row, **claim, **_verdict(found, known), **_errors(found.x, known), **times, **effort}
        before = found


def without_answer(index: int, status: str, note: str) -> Row:
    """Return the row of a problem that was not answered.

    Args:
        index: Number of the problem in its sequence.
        status: CRASHED, DEADLINE or NOT RUN.
        note: The reason.

    Returns:
        The row.
    """
    return {**BLANK, "index": index, "status": status, "note": note}


ROW = {
    "index": "number of the problem in its sequence",
    "status": "claim of the resolver; REFUSED if it raised an error, which `note` has; CRASHED or DEADLINE "
    "if its process died or had to be ended; NOT RUN after that",
    "claimed": "True if it claims the optimum, or rightly or wrongly that there is none",
    "verdict": "of its claim, by our judge: proven, refuted or undecided; proven if, refuted if: it is, "
    "provided that rows that depend on others up to rounding depend on them exactly; no claim if it claims "
    "nothing",
    "error_bound": "bound on the error of x where one is known, largest entry",
    "distance": "‖x − x*‖∞ / max(1, ‖x*‖∞) from the exact strict optimum x*, also for resolvers that promise "
    "no strict levels; NaN if x* is not known or does not exist",
    "reference": "where x* comes from: rational; proof; condition, a proof on the condition of `verdict`; "
    "infeasible, there is none; none, it is not known",
    "regret": "regret of the first level that is worse than at x* by more than 1e-8, else 0",
    "level": "number of that level, 0 if there is none",
    "outside": "largest violation of a bound or a hard row",
    "wall": "wall clock [s], median of the repeats",
    "cpu": "processor time of the process [s], median of the repeats",
    "inside": "wall clock inside the package of a solver [s], median; 0 for one without, "
    "NaN where it was not measured",
    "iterations": "iterations that the resolver states",
    "changes": "bounds and rows whose activity differs from the answer before; −1 for the first",
    "fallback": "method that answered instead of active-set, if one did",
    "note": "reason where there is no answer",
}
"""The columns of a row, with their meaning."""

BLANK: Row = {
    "index": -1, "status": "", "claimed": False, "verdict": NO_CLAIM, "error_bound": np.inf,
    "distance": np.nan, "reference": "none", "regret": 0.0, "level": 0, "outside": np.nan, "wall": np.nan,
    "cpu": np.nan, "inside": np.nan,
    "iterations": 0, "changes": -1, "fallback": "", "note": "",
}  # fmt: skip
"""A row without an answer."""


def _timed(answer: Resolver, problem: Hierarchy, memory: Memory | None, repeats: int) -> Timed:
    """Resolve a problem some times; one that takes long, once."""
    walls: list[float] = []
    cpus: list[float] = []
    within: list[int] = []
    while True:
        before = nanoseconds_inside()
        wall, cpu = time.perf_counter(), time.process_time()
        resolution, after = answer(problem, memory)
        cpus.append(time.process_time() - cpu)
        walls.append(time.perf_counter() - wall)
        within.append(nanoseconds_inside() - before)
        if len(walls) >= repeats or sum(walls) > REPEATED:
            return Timed(resolution, after, median(walls), median(cpus), 1e-9 * median(within))


def _verdict(found: Resolution, known: Reference) -> Row:
    """Judge the claim of an answer: for the problem that it states, which for weights is another one."""
    denies = found.status is Status.INFEASIBLE
    if known.kind == "infeasible":
        return {"claimed": found.claimed or denies, "verdict": PROVEN if denies else _refuted(found.claimed)}
    if denies or not found.claimed:
        return {"claimed": denies, "verdict": _refuted(denies)}
    judgement = known.judge(found)
    return {"verdict": _WORDS[judgement.verdict], "error_bound": float(judgement.error_bound.max())}


def _refuted(claimed: bool) -> str:
    """Return the verdict on an answer that is no optimum, which is refuted only if it claims to be one."""
    return REFUTED if claimed else NO_CLAIM


def _errors(x: Array, known: Reference) -> Row:
    """Measure an answer: distance from the optimum, the first level that is worse, and broken limits."""
    problem = known.problem
    row: Row = {"distance": known.distance(x), "regret": 0.0, "level": 0}
    if not np.isfinite(x).all():
        return {**row, "outside": np.nan}
    lower, upper = problem.bounds(int(problem.layout.offsets[1]))
    outside = float(excess(problem.values(x, int(problem.layout.offsets[1])), lower, upper).max(initial=0.0))
    if np.isfinite(known.x).all():
        worse = level_residuals(problem, x) - level_residuals(problem, known.x)
        for k in np.flatnonzero(worse > REGRETTED):
            row |= {"regret": float(worse[k]), "level": int(k) + 1}
            break
    return {**row, "outside": max(outside, 0.0)}


def _changes(found: Resolution, before: Resolution | None) -> int:
    """Count the bounds and rows whose activity has changed."""
    if before is None or found.state.shape != before.state.shape:
        return -1
    return int((found.state != before.state).sum())


def resolver_in(setting: Setting, name: str) -> Resolver:
    """Return the resolver of a name for a setting.

    Args:
        setting: The setting.
        name: Name of the resolver.

    Returns:
        The resolver; for default tolerances, one of the same family with such a solver.

    Raises:
        UnknownName: There is no resolver of that name.
        NotInstalled: The package of its solver cannot be imported.
    """
    if not setting.defaults:
        return resolver(name)
    family, _, engine = name.partition("/")
    return resolver(f"{family}/{at_defaults(engine)}")


def checked_setting(name: str) -> Setting:
    """Return the setting of a name.

    Args:
        name: A name in `SETTINGS`.

    Returns:
        The setting.

    Raises:
        InvalidValue: There is none of that name.
    """
    if name not in SETTINGS:
        raise InvalidValue(f"no setting '{name}'; there is {', '.join(SETTINGS)}")
    return SETTINGS[name]
