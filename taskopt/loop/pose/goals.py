"""Goals by the name of their frame, whose values can be set for every pose that is asked for."""

from collections.abc import Mapping, Sequence

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.limit import Limit
from taskopt.kinematics.space import PoseSpace, Value, plain
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Latest
from taskopt.kinematics.task import FrameTask, OrientationTask, PositionTask

_KINDS: dict[tuple[int, ...], type[FrameTask | PositionTask | OrientationTask]] = {
    (3,): PositionTask,
    (3, 3): OrientationTask,
}


class NamedGoals:
    """A goal for each of some frames: a pose, a position, or a rotation, in the world.

    Args:
        values: Mapping from frame to goal, see `PoseSolver`.

    Raises:
        InvalidValue: The values are no mapping, or one of them is no pose.
    """

    def __init__(self, values: Mapping[str, Value]) -> None:
        if not isinstance(values, Mapping):
            raise InvalidValue(f"goals must be a mapping from frame to pose, or a Stack, got {values!r}")
        self._kinds = {frame: _kind(value) for frame, value in values.items()}
        self._targets = {frame: Latest(_pose(frame, value)) for frame, value in values.items()}

    def stack(self, limits: Sequence[Limit]) -> Stack:
        """Return the stack of one level that has all goals.

        Args:
            limits: Limits on the posture.

        Returns:
            The stack, whose targets `set` moves.
        """
        level = [
            self._kinds[frame](frame, target=target, expressed="world")
            for frame, target in self._targets.items()
        ]
        return Stack([level], limits)

    def set(self, values: Mapping[str, Value]) -> None:
        """Set all goals.

        Args:
            values: A value for each frame, of the same kind as before.

        Raises:
            InvalidValue: The values are no mapping, one is missing, is no pose, or is of another kind.
            UnknownName: There is no goal for a frame.
        """
        if not isinstance(values, Mapping):
            raise InvalidValue(
                f"goals must be a mapping from frame to pose, got {values!r}; give a stack to PoseSolver"
            )
        for frame, value in values.items():
            if frame not in self._targets:
                raise UnknownName("goal of this solver", frame, self._targets)
            if _kind(value) is not self._kinds[frame]:
                raise InvalidValue(
                    f"the goal of '{frame}' was made for a {self._kinds[frame].__name__}, and is set to a "
                    f"value for a {_kind(value).__name__}; make a solver for goals of this kind"
                )
        missing = [frame for frame in self._targets if frame not in values]
        if missing:
            raise InvalidValue(f"goals lack {', '.join(missing)}; give a value for every goal of the solver")
        for frame, value in values.items():
            self._targets[frame].set(_pose(frame, value))


def _kind(value: Value) -> type[FrameTask | PositionTask | OrientationTask]:
    """Return the task for a goal: a position and a rotation leave the rest of the pose free."""
    try:
        shape = np.shape(plain(value))  # type: ignore[arg-type]
    except ValueError:  # no array; the target says which forms it takes
        shape = ()
    return _KINDS.get(shape, FrameTask)


def _pose(frame: str, value: Value) -> Array:
    """Return a goal as a pose (4, 4); what it leaves free is that of the identity, and is not read.

    An array (4, 4) is not checked here: the first tick finds out if it is no pose.
    """
    if isinstance(value, np.ndarray) and value.shape == (4, 4):
        return value
    return PoseSpace(f"goal of '{frame}'").convert(value, np.eye(4))
