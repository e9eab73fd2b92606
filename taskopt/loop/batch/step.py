"""What one step of a batch returns."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from taskopt.arrays import Array, BoolArray, ObjectArray, StateArray
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status


@dataclass(frozen=True, eq=False)
class BatchStep:
    """The answers of all arms at one step; no later step changes them.

    Attributes:
        v: Velocities to command, (N, nv) [rad/s, m/s]; NaN for an arm without an answer that may be sent.
        error_bound: Upper bound on |v − v*| for the exact optimum v*, (N, nv) [rad/s, m/s]; inf for arms that
            took a tick of their own.
        active: −1 where a velocity stands on its lower bound, 1 on its upper bound, else 0, (N, nv).
        proven: True where the answer is proven in lock-step: each entry is within `error_bound` of the
            optimum, and that is at most 1e-8 max(1, |v|), (N,).
        status: Status of each arm, a `Status` each, (N,).
        resolutions: The resolutions of arms that took a tick of their own, by number; `.certificate` judges
            such an answer when it is asked for.
    """

    v: Array
    error_bound: Array
    active: StateArray
    proven: BoolArray
    status: ObjectArray
    resolutions: Mapping[int, Resolution]

    @property
    def solved(self) -> BoolArray:
        """True for arms with the status SOLVED, (N,)."""
        return np.array(self.status == Status.SOLVED, dtype=np.bool_)

    @property
    def on_bound(self) -> BoolArray:
        """True for arms of which a velocity stands on a bound, (N,)."""
        return (self.active != 0).any(axis=1)

    def __repr__(self) -> str:
        return (
            f"<BatchStep of {len(self.v)} arms: {np.count_nonzero(self.proven)} proven, "
            f"{np.count_nonzero(self.on_bound)} on a bound, {len(self.resolutions)} in ticks of their own>"
        )
