"""The targets of many arms: one pose or posture for each arm and task."""

from collections.abc import Mapping

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.lockstep.chain import homogeneous, twelve
from taskopt.kinematics.lockstep.frames import frame_poses, take_poses
from taskopt.kinematics.lockstep.tables import Reader
from taskopt.kinematics.pose import checked_pose
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.space import Value
from taskopt.kinematics.target import Hold, Latest
from taskopt.kinematics.task.frame import BoundFrame
from taskopt.kinematics.task.joint import BoundJoints

_OF = ".target"


class BatchTargets:
    """The targets of N arms; those that a stack declares begin at each arm's own posture.

    Args:
        reader: What lock-step reads of the plan.
        robot: The robot.

    Attributes:
        goals: Target of each frame task, (F, N, 12), as `chain.twelve` writes poses.
        joint_goals: Target of each row of the joint tasks, (N, R) [rad, m].

    Raises:
        InvalidValue: A declared target moves by itself.
    """

    def __init__(self, reader: Reader, robot: Robot) -> None:
        self._robot = robot
        self._frames = dict(enumerate(reader.frame_tasks))
        self._joints = reader.joint_tasks
        self._position = reader.tree.chain.position
        self._seen: dict[str, object] = {}  # what a `Latest` said last, by task
        for task in self._tasks():
            if not isinstance(task.target, Hold | Latest):
                raise InvalidValue(
                    f"a batch does not know the target of '{task.name}', a {type(task.target).__name__}: it "
                    "moves by itself; leave it out, and give the targets of each step by set()"
                )
        self.goals, self.joint_goals = np.zeros((len(self._frames), 0, 12)), np.zeros((0, 0))

    def start(self, q: Array) -> None:
        """Let all targets begin at the postures of the arms.

        Args:
            q: Postures, (N, nq) [rad, m].
        """
        count = len(q)
        self._q = q
        self.goals = np.zeros((len(self._frames), count, 12))
        self.joint_goals = np.zeros((count, sum(len(task.row_names) for task, _ in self._joints)))
        self._starts = {f: frame_poses(self._robot, str(task.frame), q) for f, task in self._frames.items()}
        self._seen = {}
        for task in self._tasks():
            if isinstance(task.target, Hold):
                self._take_one(task, task.target.value)
        self.follow()

    def follow(self) -> None:
        """Take what targets of the kind `Latest` say now, for all arms alike."""
        for task in self._tasks():
            if isinstance(task.target, Latest):
                now = task.target.now
                if self._seen.get(task.name) is now:
                    continue
                if now[1] is not None:
                    raise InvalidValue(
                        f"a batch does not know the velocity of a target, as '{task.name}' has it; set its "
                        "value alone"
                    )
                self._take_one(task, now[0])
                self._seen[task.name] = now

    def set(self, values: Mapping[str, ArrayLike]) -> None:
        """Replace targets by one for each arm.

        Args:
            values: By address, see `BatchController.set`.

        Raises:
            UnknownName: There is no such address.
            InvalidValue: A value does not fit; nothing is changed then.
        """
        known = {f"{task.name}{_OF}": task for task in self._tasks()}
        taken = []
        for address, value in values.items():
            if address not in known:
                raise UnknownName("target", address, known, "(a batch changes targets only)")
            taken.append((known[address], self._each(known[address], address, value)))
        for task, numbers in taken:
            self._write(task, numbers)
            if isinstance(task.target, Latest):
                self._seen[task.name] = task.target.now

    def give(self, arm: int) -> None:
        """Write the targets of one arm into the tasks of the plan.

        Args:
            arm: Index of the arm.
        """
        for f, task in self._frames.items():
            task.goal[...] = homogeneous(self.goals[f, arm])
        for task, first in self._joints:
            columns = self._position[list(task.column)]
            task.goal[columns] = self.joint_goals[arm, first : first + len(columns)]

    def _tasks(self) -> list[BoundFrame | BoundJoints]:
        """Return all tasks that have a target."""
        return [*self._frames.values(), *(task for task, _ in self._joints)]

    def _write(self, task: BoundFrame | BoundJoints, numbers: Array) -> None:
        """Write the targets (N, any) of one task."""
        if isinstance(task, BoundFrame):
            f = next(f for f, known in self._frames.items() if known is task)
            self.goals[f] = numbers
        else:
            first = next(first for known, first in self._joints if known is task)
            self.joint_goals[:, first : first + len(task.row_names)] = numbers

    def _take_one(self, task: BoundFrame | BoundJoints, value: Value | None) -> None:
        """Take one value for all arms; the parts that it does not state stay those of each arm's start."""
        if isinstance(task, BoundFrame):
            starts = next(self._starts[f] for f, known in self._frames.items() if known is task)
            if value is None:
                self._write(task, twelve(starts))
                return
            each = [task.space.convert(value, start) for start in starts]
            self._write(task, twelve(np.array(each).reshape(-1, 4, 4)))
            return
        columns = self._position[list(task.column)]
        each = self._q if value is None else [task.space.convert(value, start) for start in self._q]
        self._write(task, np.array(each).reshape(-1, self._robot.nq)[:, columns])

    def _each(self, task: BoundFrame | BoundJoints, address: str, value: ArrayLike) -> Array:
        """Return one checked target for each arm, as `_write` takes them."""
        count, shape = len(self._q), np.shape(value)
        if isinstance(task, BoundJoints):
            rows, nq = len(task.row_names), self._robot.nq
            if shape[:1] != (count,) or shape[1:] not in ((rows,), (nq,)):
                raise InvalidValue(_misfit(address, f"({count}, {rows}) or ({count}, {nq})", shape))
            numbers = finite(address, value, (count, None))
            return numbers if shape[1] == rows else numbers[:, self._position[list(task.column)]]
        f = next(f for f, known in self._frames.items() if known is task)
        if shape == (count, 3):
            out = twelve(self._starts[f])
            out[:, 9:] = finite(address, value, (count, 3))
            return out
        if shape != (count, 4, 4):
            raise InvalidValue(_misfit(address, f"({count}, 4, 4) or, for positions, ({count}, 3)", shape))
        out = np.empty((count, 12))
        poses = np.ascontiguousarray(value, dtype=np.float64)
        wrong = take_poses(poses, out)
        if wrong >= 0:
            checked_pose(f"{address} of arm {wrong}", poses[wrong])
        return out


def _misfit(address: str, expected: str, shape: tuple[int, ...]) -> str:
    """Return the message about a wrong shape."""
    return f"{address} must have one value for each arm, {expected}, got {shape}"
