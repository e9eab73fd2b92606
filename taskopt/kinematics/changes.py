"""Changes of parameters, which are set at any time from any thread, and applied when the next tick begins.

Changes that are set together are applied together. A change may be blended over a time; its ramp is then
advanced at the beginning of each tick.
"""

from collections import deque
from collections.abc import Mapping
from copy import copy
from typing import NamedTuple

from taskopt.arrays import positive, require_mapping
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.gate import LevelEnabled
from taskopt.kinematics.parameter import Parameter, Ramp, Setting
from taskopt.kinematics.redirection import TargetParameter, VelocityTarget


class Applied(NamedTuple):
    """A change that a tick has applied.

    Attributes:
        name: Address of the parameter.
        before: Its value before.
        after: The value to which it was set.
        over: Time over which it is blended [s]; 0 for at once.
    """

    name: str
    before: Setting
    after: Setting
    over: float


class Changes:
    """The parameters of a plan by address, and the changes that the next tick applies.

    Args:
        parameters: All parameters, by address, such as "hand.weight".

    Attributes:
        waiting: True if `apply` has something to do.
        applied: The changes that were applied, for a log, which empties the list; None if nobody asks.
    """

    def __init__(self, parameters: Mapping[str, Parameter]) -> None:
        self.parameters = dict(parameters)
        self._queue: deque[list[tuple[str, Parameter, Setting, float, Setting]]] = deque()
        self._ramps: dict[str, Ramp] = {}
        self.waiting = False
        self.applied: list[Applied] | None = None

    def set(self, changes: Mapping[str, Setting], over: float = 0.0) -> None:
        """Check changes; the next tick applies them together.

        Args:
            changes: New values, by address.
            over: Time over which they are blended [s]; 0 for at once.

        Raises:
            UnknownName: There is no parameter of that address.
            InvalidValue: A parameter does not take its value, or `over` is negative. Nothing is changed then.
        """
        require_mapping("changes", changes, '{"hand.gain": 2.0}')
        if over != 0.0:
            positive("over", over)
        checked = []
        for name, value in changes.items():
            parameter = self.parameters.get(name)
            if parameter is None:
                raise UnknownName("parameter", name, self.parameters)
            checked.append((name, parameter, parameter.checked(value, over), over, copy(value)))
        self._queue.append(checked)
        self.waiting = True

    def apply(self, t: float) -> None:
        """Apply the waiting changes, and advance those that are blended.

        Args:
            t: Time of the tick [s].
        """
        if self._ramps:
            self._ramps = {name: ramp for name, ramp in self._ramps.items() if not ramp(t)}
        self.waiting = bool(self._ramps)  # before the queue is emptied, so that a change set now is not lost
        while self._queue:
            for name, parameter, value, over, told in self._queue.popleft():
                if self.applied is not None:
                    self.applied.append(Applied(name, parameter.read(), told, over))
                if self._ramps:
                    self._ramps.pop(name, None)
                ramp = parameter.change(value, t, over)
                if ramp is not None:
                    self._ramps[name] = ramp
                    self.waiting = True

    def recall(self, *, blending: bool) -> dict[str, Setting]:
        """Return the present values that a copy of the plan has to set.

        Args:
            blending: True if rows of a task are between on and off.

        Returns:
            Values by address. Targets are left out, since tasks and limits remember them; "enabled" of a
            level is left out, since that of each of its tasks is returned.

        Raises:
            InvalidValue: A change waits for the next tick, or is being blended.
        """
        if self.waiting or blending:
            raise InvalidValue(
                "a loop cannot be copied while a change of a parameter waits or is being blended; step first"
            )
        return {
            name: parameter.read()
            for name, parameter in self.parameters.items()
            if not isinstance(parameter, TargetParameter | VelocityTarget | LevelEnabled)
        }

    def read(self) -> dict[str, Setting]:
        """Return the present values by address, without the changes that wait for the next tick."""
        return {name: parameter.read() for name, parameter in self.parameters.items()}
