"""Records the closed loop of a commit, and how far its velocity answers to the last bit of q.

Usage: python recorder.py CHECKOUT FILE NAME TICKS, with PYTHONPATH set to that checkout; `velocities.py`
starts it. TICKS is 0 for all ticks of a scenario.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # the modules beside this folder

import numpy as np
from checkout import Subject, subject, undamped
from numpy.typing import NDArray

from taskopt import Controller, TaskoptError

PATTERNS = 20  # random sign patterns of the last bit
SEED = 8

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Record:
    """Answers of one commit.

    Attributes:
        q: Posture at each tick, (ticks, nq) [rad, m].
        v: Velocity at each tick, (ticks, nv) [rad/s, m/s].
        response: Largest change of v at each tick over all patterns, (ticks,) [rad/s, m/s].
    """

    q: Array
    v: Array
    response: Array


def record(of: Subject) -> Record:
    """Run the closed loop, until the first tick without an optimum that may be sent.

    Args:
        of: The subject, made by the code of this process.
    """
    control = Controller(of.robot, of.stack, "active-set", of.dt)
    q, qs, vs = of.q0.copy(), [], []
    for tick in range(of.ticks):
        try:
            resolution = control.step(q, of.aim(tick), vs[-1] if vs else None)
        except TaskoptError:  # a conflict of hard limits
            break
        if not resolution.claimed:
            break
        qs.append(q)
        vs.append(resolution.v.copy())
        q = of.robot.integrate(q, vs[-1], of.dt)
    return Record(np.array(qs), np.array(vs), np.zeros(len(qs)))


def replay(of: Subject, q: Array, v: Array) -> Array:
    """Return the velocities at given postures, open loop, (ticks, nv) [rad/s, m/s].

    Args:
        of: The subject.
        q: Posture at each tick, (ticks, nq) [rad, m].
        v: The velocity that the robot has after each tick, (ticks, nv) [rad/s, m/s].
    """
    control = Controller(of.robot, of.stack, "active-set", of.dt)
    answers = [
        control.step(q[tick], of.aim(tick), v[tick - 1] if tick else None).v.copy() for tick in range(len(q))
    ]
    return np.array(answers)


def response(of: Subject, recorded: Record) -> Array:
    """Return the largest change of v at each tick when each entry of q moves by one last bit, (ticks,)."""
    rng, largest = np.random.default_rng(SEED), np.zeros(len(recorded.q))
    for _ in range(PATTERNS):
        direction = np.where(rng.random(recorded.q.shape) < 0.5, -np.inf, np.inf)
        try:
            moved = replay(of, np.nextafter(recorded.q, direction), recorded.v)
        except TaskoptError:  # one bit decides whether the limits contradict each other
            return np.full(len(recorded.q), np.inf)
        largest = np.maximum(largest, np.abs(moved - recorded.v).max(axis=1))
    return largest


def main() -> None:
    """Record one subject into a file."""
    folder, file, name, ticks = sys.argv[1:]
    of = undamped(subject(Path(folder), name, int(ticks) or None))
    recorded = record(of)
    np.savez(file, q=recorded.q, v=recorded.v, response=response(of, recorded))


if __name__ == "__main__":
    main()
