"""A tick made again from its row: the declared hierarchy, the memory of the resolver, and the answer."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.certificate import certify
from taskopt.hierarchy.layout import Layout
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.view import answer_of
from taskopt.log.description import PROBLEM
from taskopt.resolver.base import Memory
from taskopt.resolver.tick_review import TickReview


@dataclass(frozen=True, eq=False)
class LoggedTick:
    """One tick of a log.

    Attributes:
        row: Number of the row.
        values: Values of the row by column.
        layout: Names and sizes of the declared hierarchy.
        damped: Layout of problems with damping at rest, if there are any.
        norm: W, (n,) or (n, n).
    """

    row: int
    values: Mapping[str, Any]
    layout: Layout
    damped: Layout | None
    norm: Array

    @property
    def index(self) -> int:
        """Number of the tick, from 0."""
        return int(self.values["tick"])

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.values["t"])

    @property
    def resolver(self) -> str:
        """Name of the resolver."""
        return str(self.values["resolver"])

    @property
    def error(self) -> str:
        """The error that the tick raised; "" for none."""
        return self.values["error"] or ""

    @property
    def x(self) -> Array:
        """The unknowns that were sent, (n,), as a rule velocities."""
        return self.array("x")

    def array(self, column: str) -> Array:
        """Return the values of a column of lists.

        Args:
            column: Name of the column.

        Returns:
            Its numbers.
        """
        return np.array(self.values[column], dtype=np.float64)

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """The problem as the stack declared it."""
        return Hierarchy.view(self.layout, self._buffer, self.norm)

    @cached_property
    def memory(self) -> Memory | None:
        """The memory that the resolver began with; None for none."""
        return self._memory("memory")

    @cached_property
    def resolution(self) -> Resolution:
        """The answer that was sent, or that was refused if there is an error.

        A resolver that puts all levels into one program has no multipliers of the declared levels: they are
        NaN here, and `solve_again` gives its own answer with them.
        """
        status, iterations = "status", "iterations"
        if self.values.get("damped") is not None:
            status, iterations = "undamped_status", "undamped_iterations"
        buffer = self._buffer if self.values["changed"] is None else self.array("changed")
        x = self.x if self.values["undamped_x"] is None else self.array("undamped_x")
        problem, multipliers = Hierarchy.view(self.layout, buffer, self.norm), self.array("multipliers")
        prices = multipliers.reshape(-1, self.layout.width)
        residuals = certify(problem, x, prices).residuals.ravel()
        answer = np.concatenate([x, multipliers, residuals, buffer])
        plain = self._answered(problem, answer, "state", status, iterations)
        if self.problem_with_damping is None:
            return plain.replaced(notes=self._notes, fallback=self.values["fallback"])
        damped = self._answered(
            self.problem_with_damping, self.array("damped"), "damped_state", "status", "iterations"
        )
        return damped.replaced(notes=self._notes, fallback=self.values["fallback"]).damped_from(plain)

    @cached_property
    def problem_with_damping(self) -> Hierarchy | None:
        """The problem with rows of damping at rest; None at a tick that was not damped."""
        if self.damped is None or self.values.get("damped") is None:
            return None
        layout, answer = self.damped, self.array("damped")
        buffer = answer_of(answer, layout.n, layout.row_count, layout.level_count).problem
        return Hierarchy.view(layout, buffer, self.norm)

    @cached_property
    def memory_of_damping(self) -> Memory | None:
        """The memory with which `problem_with_damping` was resolved at last; None for none."""
        return self._memory("damped_memory") if self.problem_with_damping is not None else None

    @cached_property
    def _buffer(self) -> Array:
        """The numbers of the declared hierarchy."""
        return np.concatenate([self.array(name) for name in PROBLEM])

    @property
    def _notes(self) -> tuple[str, ...]:
        """The sentences on the answer."""
        return tuple(self.values["notes"] or ())

    def _answered(
        self, problem: Hierarchy, answer: Array, state: str, status: str, iterations: str
    ) -> Resolution:
        """Return an answer with its claim."""
        active = np.array(self.values[state], dtype=np.int8)
        claim = Status[self.values[status]]
        return Resolution(problem, answer, active, claim, int(self.values[iterations]), TickReview)

    def _memory(self, name: str) -> Memory | None:
        """Return one of the two memories."""
        state = self.values[f"{name}_state"]
        if state is None:
            return None
        before = self.values[f"{name}_previous"]
        count = self.values.get(f"{name}_rank_count") or 0
        ranks = tuple(self.values[f"{name}_ranks"][:count]) if count else ()
        previous = None if before is None else np.array(before, dtype=np.int8)
        return Memory(
            np.array(state, dtype=np.int8), ranks, previous, bool(self.values[f"{name}_alternates"])
        )
