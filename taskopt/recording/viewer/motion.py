"""What drawings of a robot and its surroundings need of some ticks, be it of a run or of a log."""

from collections.abc import Mapping
from typing import NamedTuple

from taskopt.arrays import Array, IntArray
from taskopt.recording.batch import Batch, Nanoseconds


class Motion(NamedTuple):
    """k consecutive ticks of one robot.

    Attributes:
        index: Numbers of the ticks, (k,).
        time: Times of the ticks, (k,).
        q: Postures, (k, nq) [rad, m].
        moving: Poses of each obstacle that moves, (k, 4, 4) in the world [m], by its name.
    """

    index: IntArray
    time: Nanoseconds
    q: Array
    moving: Mapping[str, Array]


def motion_of(batch: Batch) -> Motion:
    """Return the motion of a batch of a run.

    Args:
        batch: Consecutive steps of one resolver.

    Returns:
        The motion.
    """
    moving = {name: batch.obstacle(name) for name in batch.moving}
    return Motion(batch.index, batch.time, batch.q, moving)
