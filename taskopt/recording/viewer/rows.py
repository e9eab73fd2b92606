"""The rows and terms of a run that plots and the active-set timeline show, with their names."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from taskopt.arrays import Mask
from taskopt.hierarchy.layout import numbered
from taskopt.kinematics.objective import Objective
from taskopt.kinematics.objective.base import Sum
from taskopt.kinematics.task import BoundTask
from taskopt.recording.run_info import RunInfo


def rows_in_unit(task: BoundTask, unit: str) -> Mask:
    """Find the rows of a task whose error is in a unit.

    Args:
        task: A task with m rows; the units of the rows themselves are rates.
        unit: The unit of the error, "m" or "rad".

    Returns:
        True for each such row, (m,).
    """
    return np.array([row.removesuffix("/s") == unit for row in task.row_units], dtype=bool)


def limit_rows(info: RunInfo) -> Mask:
    """Find the rows that can be active: bounds on unknowns, hard rows, inequality rows of tasks.

    Args:
        info: The facts about the run, whose hierarchy has n unknowns and M rows.

    Returns:
        True for each such unknown and row, (n + M,).
    """
    layout, hierarchy = info.plan.layout, info.plan.hierarchy
    rows = np.zeros(layout.width, dtype=bool)
    rows[: layout.n + int(layout.offsets[1])] = True
    rows[layout.n :] |= hierarchy.lower < hierarchy.upper
    return rows


def pair_rows(info: RunInfo) -> dict[int, str]:
    """Find the hard rows that keep a pair of bodies apart.

    Args:
        info: The facts about the run, whose hierarchy has n unknowns.

    Returns:
        The name of the distance limit behind each such row; rows are counted after the n unknowns.
    """
    layout = info.plan.layout
    return {
        layout.n + row: block.name
        for block in layout.blocks
        if block.level == 0 and block.name in info.plan.distance_limits
        for row in range(block.start, block.stop)
    }


@runtime_checkable
class WithObjective(Protocol):
    """A declared task that climbs an objective or keeps it above a value.

    Attributes:
        objective: The objective, perhaps a sum of terms.
    """

    objective: Objective


@runtime_checkable
class OfFrame(Protocol):
    """An objective of one frame.

    Attributes:
        frame: The name of the frame.
    """

    frame: str


@dataclass(frozen=True, eq=False)
class ObjectiveTerm:
    """A term of the objective of a task.

    Attributes:
        task: The name of the task.
        name: The name of the term, which no other term of the task has.
        objective: The objective of this term alone, without its factor.
    """

    task: str
    name: str
    objective: Objective


def objective_terms(info: RunInfo) -> tuple[ObjectiveTerm, ...]:
    """List the terms of the objectives of a stack's tasks.

    Args:
        info: The facts about the run.

    Returns:
        The terms, in the order of the tasks.
    """
    declared = [task for level in info.scenario.stack.levels for task in level]
    terms = []
    for task, bound in zip(declared, info.declared, strict=True):
        if not isinstance(task, WithObjective):
            continue
        objective = task.objective
        parts = [term for _, term in objective.terms] if isinstance(objective, Sum) else [objective]
        names = numbered(_term_name(term) for term in parts)
        terms += [ObjectiveTerm(bound.name, name, term) for name, term in zip(names, parts, strict=True)]
    return tuple(terms)


def _term_name(objective: Objective) -> str:
    """Name an objective by its class, and by its frame if it has one."""
    name = type(objective).__name__
    return f"{name} {objective.frame}" if isinstance(objective, OfFrame) else name
