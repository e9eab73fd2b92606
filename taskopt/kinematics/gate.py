"""Gates, which switch rows of a task on and off while a stack runs, at once or blended over a time.

Rows that are off have the bounds −∞ and ∞, and therefore change nothing at any level. Between on and off the
bounds open as `taskopt.kinematics.task.transition` describes, so that velocities do not jump.
"""

from collections.abc import Sequence
from typing import cast

import numpy as np

from taskopt.arrays import Array, BoolArray
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.parameter import Numbers, Ramp, Setting, compact
from taskopt.kinematics.task.base import BoundTask
from taskopt.kinematics.task.transition import Band


class Gate:
    """The gate of one task: a row is on if the task is enabled, its axis is chosen and its weight is not 0.

    Args:
        rows: The rows of the task in the hierarchy of the plan, as views.
        constant: True if the task writes its rows only once, so that the gate must restore them.

    Attributes:
        enabled: True if the task is on, or being switched on.
        chosen: True for rows that the choice of axes includes, (m,).
        weighted: True for rows whose weight is greater than 0, (m,).
        changed: True from a call of `change` until the plan has noticed it.
        blending: True if a row had not yet come to on or to off at the last `apply`.
    """

    def __init__(self, rows: LevelRows, *, constant: bool) -> None:
        m = len(rows.lower)
        self._rows = rows
        self._kept = (rows.lower.copy(), rows.upper.copy()) if constant else None
        self.enabled = True
        self.chosen: BoolArray = np.ones(m, dtype=bool)
        self.weighted: BoolArray = np.ones(m, dtype=bool)
        self._none: BoolArray = np.zeros(m, dtype=bool)
        self._selected = self._wanted = self.chosen & self.weighted
        self._weighs_all = self._selects_all = True
        self._from, self._begin, self._blend = np.zeros(m), 0.0, 0.0
        self._band = Band(m)
        self._band.width[:] = 0.0
        self.changed = self.blending = False

    def change(
        self,
        t: float,
        over: float,
        *,
        enabled: bool | None = None,
        chosen: BoolArray | None = None,
        weighted: BoolArray | None = None,
    ) -> None:
        """Begin to switch rows on or off.

        Args:
            t: Time [s].
            over: Time that it takes from off to on, or from on to off [s]; 0 for at once.
            enabled: New value of the attribute; None leaves it as it is.
            chosen: New value of the attribute, (m,); None leaves it as it is.
            weighted: New value of the attribute, (m,); None leaves it as it is.
        """
        if over > 0.0:
            u = self.openness(t)
            self._from = np.where(np.isfinite(self._band.width), u, np.minimum(u, 1.0))
        self.enabled = self.enabled if enabled is None else enabled
        if weighted is not None:
            self.weighted, self._weighs_all = weighted, False not in weighted.tolist()
        if chosen is not None or weighted is not None:
            self.chosen = self.chosen if chosen is None else chosen
            self._selected = self.chosen if self._weighs_all else self.chosen & self.weighted
            self._selects_all = False not in self._selected.tolist()  # of few rows, faster than all()
        self._wanted = self._selected if self.enabled else self._none
        self._begin, self._blend, self.changed = t, over, True

    def openness(self, t: float) -> Array:
        """Return the openness u of the bounds of each row.

        Args:
            t: Time [s].

        Returns:
            (m,): 0 for a row that is fully on, 1 or more for a row that is off or whose time is over.
        """
        if self._blend <= 0.0:
            return np.where(self._wanted, 0.0, np.inf)
        way = max((t - self._begin) / self._blend, 0.0)
        return np.maximum(np.where(self._wanted, self._from - way, self._from + way), 0.0)

    def is_idle(self, t: float) -> bool:
        """Return True if nothing needs to be done.

        Args:
            t: Time [s].

        Returns:
            True if all rows are fully on.
        """
        wants_all = self.enabled and self._selects_all
        return wants_all and (self._blend <= 0.0 or not self.openness(t).any())

    def apply(self, t: float, v: Array) -> None:
        """Open the bounds of rows that are not fully on; call it after the task has filled its rows.

        Args:
            t: Time [s].
            v: Velocity that the robot has until now, (n,) [rad/s, m/s].
        """
        if self._kept is not None:
            self._rows.lower[:], self._rows.upper[:] = self._kept
        u = self.openness(t)
        self._band.open(self._rows, u, v)
        on_the_way = np.where(self._wanted, u > 0.0, u < 1.0)
        self.blending = self._band.under_way or bool(on_the_way.any())


class Enabled:
    """The parameter "enabled" of one task.

    Args:
        name: Name of the parameter, for messages.
        gates: Gates of the task; those of several tasks for `LevelEnabled`.
    """

    def __init__(self, name: str, gates: Sequence[Gate]) -> None:
        self._name, self._gates = name, tuple(gates)

    def checked(self, value: Setting, over: float) -> bool:  # noqa: ARG002 (protocol)
        """Return the truth value; see `Parameter.checked`.

        Raises:
            InvalidValue: The value is neither True nor False.
        """
        if value is True or value is False:  # most often; the comparison below takes longer
            return value
        if value not in (True, False):
            raise InvalidValue(f"{self._name} must be True or False, got {value!r}")
        return bool(value)

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Begin to switch the tasks on or off; see `Parameter.change`."""
        for gate in self._gates:
            gate.change(t, over, enabled=cast("bool", value))
        return None

    def read(self) -> bool:
        """Return True if at least one of the tasks is on, or being switched on."""
        return any(gate.enabled for gate in self._gates)


class LevelEnabled(Enabled):
    """The parameter "enabled" of a level, which switches all tasks of the level."""


class Axes:
    """The parameter "axes" of a task, which selects the rows that are on among those that were compiled.

    Args:
        task: The task, which has the names of its rows.
        gate: Its gate.
    """

    def __init__(self, task: BoundTask, gate: Gate) -> None:
        self._task, self._gate = task, gate

    def checked(self, value: Setting, over: float) -> BoolArray:  # noqa: ARG002 (protocol)
        """Return one truth value for each row, (m,); see `Parameter.checked`.

        Raises:
            InvalidValue: A row is chosen that was not compiled.
        """
        return self._task.rows_of_axes(value)

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Begin to switch the rows on or off; see `Parameter.change`."""
        assert isinstance(value, np.ndarray), "the value is what `checked` returned"
        self._gate.change(t, over, chosen=value)
        return None

    def read(self) -> tuple[str, ...]:
        """Return the names of the rows that are chosen."""
        names = self._task.row_names
        return tuple(name for name, chosen in zip(names, self._gate.chosen, strict=True) if chosen)


class Weight:
    """The parameter "weight" of a task; rows with weight 0 are off.

    Args:
        task: The task, whose weights are those of its rows in the hierarchy.
        gate: Its gate.
    """

    def __init__(self, task: BoundTask, gate: Gate) -> None:
        self._task, self._gate = task, gate
        self._numbers = Numbers(task.weight, task.each_weight, geometric=True)
        self.checked = self._numbers.checked  # the method itself, since one more call would cost 0.1 µs
        self._none_is_zero = True

    def change(self, value: Setting, t: float, over: float) -> Ramp | None:
        """Write the weights, at once or over a time; see `Parameter.change`."""
        if value.__class__ is float:
            has_zero = value == 0.0
        else:
            has_zero = 0.0 in cast("Array", value).tolist()
        if self._none_is_zero and not has_zero:
            return self._numbers.change(value, t, over)
        each = np.broadcast_to(cast("Array", value), self._task.weight.shape)
        positive = each > 0.0
        self._none_is_zero = bool(positive.all())
        self._gate.change(t, over, weighted=positive)
        return self._numbers.change(np.where(positive, each, self._task.weight), t, over)

    def read(self) -> Array | float:
        """Return a copy of the weights, or one float where all are equal."""
        return compact(np.where(self._gate.weighted, self._task.weight, 0.0))
