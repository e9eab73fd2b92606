"""Arm-ticks per CPU second of `BatchController` beside NumPy: 4,096 Pandas, the strict stack of W1s.

    python benchmarks/batch.py                    # one thread; shares of arms on a bound: 0, 10 and 50 %
    python benchmarks/batch.py --threads 2        # total CPU of two threads beside that of one
    python benchmarks/batch.py --memory 100000    # resident memory over so many steps of 64 arms

A tick is: set the targets of all hands, resolve, integrate. NumPy (`numpy_batch.py`) does the same without
bounds and without proof. Both take turns in blocks of steps, and the CPU clock of the process is read, so
that other processes matter little. Hands follow circles; in the given share of the arms they move so fast
that a joint stands on its velocity limit. The deviation is that from `Controller`, over every 64th arm.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

import argparse
import resource
from time import process_time

import cases
import numpy as np
from numpy_batch import NumpyArms

from taskopt import BatchController, Controller, JointPositionLimit, JointVelocityLimit, Latest, Stack
from taskopt.arrays import Array
from taskopt.kinematics.lockstep.frames import frame_poses

ARMS, STEPS, BLOCKS = 4096, 10, 7
SLOW, FAST = 0.02, 0.15  # [m] radii; the faster hand needs about 1.5 times the velocity limit
SCALE = 0.25  # of the velocity limits


class Arms:
    """Pandas whose hands follow circles, started near their posture.

    Args:
        count: Number of arms.
        share: Share of them that is fast.
    """

    def __init__(self, count: int, share: float) -> None:
        self.robot, q0, self.frame = cases.panda()
        rng = np.random.default_rng(1)
        self.q0 = q0
        self.q = q0 + rng.uniform(-0.25, 0.25, (count, len(q0)))
        self.radius = np.where(rng.permutation(count) < share * count, FAST, SLOW)
        self.phase = rng.uniform(0.0, 2.0 * np.pi, count)
        self.centre = frame_poses(self.robot, self.frame, self.q)

    def stack(self, scale: float) -> Stack:
        """Return the stack of W1s with velocity limits of another size."""
        levels = cases.panda_levels(Latest())
        limits = [JointPositionLimit(gain=cases.POSITION_GAIN), JointVelocityLimit(scale=scale)]
        return Stack(levels=levels, limits=limits)

    def goals(self, k: int) -> Array:
        """Return the targets of step k, (N, 4, 4)."""
        angle = self.phase + 2.0 * np.pi / cases.PERIOD * cases.DT * k
        goals = self.centre.copy()
        goals[:, 1, 3] += self.radius * np.sin(angle)
        goals[:, 2, 3] += self.radius * np.cos(angle)
        return goals

    def begin(self, scale: float, threads: int) -> BatchController:
        """Return a batch that has come to its path, with all arms at its posture."""
        posture = np.tile(self.q0, (len(self.q), 1))
        far = BatchController(self.robot, self.stack(1e3), cases.DT)
        far.start(self.q)
        for k in range(20):
            far.set({f"{self.frame}.target": self.goals(k), "posture.target": posture})
            self.q = far.integrate(self.q, far.step(self.q).v)
        batch = BatchController(self.robot, self.stack(scale), cases.DT, threads=threads)
        batch.start(self.q)
        batch.set({"posture.target": posture})
        return batch


def deviation(arms: Arms, q: Array, goals: Array, v: Array) -> float:
    """Return the largest deviation [rad/s] from `Controller` over every 64th arm."""
    hand = Latest()
    levels = cases.panda_levels(hand)
    limits = [JointPositionLimit(gain=cases.POSITION_GAIN), JointVelocityLimit(scale=SCALE)]
    control = Controller(arms.robot, Stack(levels=levels, limits=limits), dt=cases.DT)
    control.start(arms.q0)
    worst = 0.0
    for arm in range(0, len(q), 64):
        hand.set(goals[arm])
        worst = max(worst, float(np.abs(control.step(q[arm], 0.0).v - v[arm]).max()))
    return worst


def measure(share: float, threads: int) -> None:
    """Print the rates of both for one share of fast arms."""
    arms = Arms(ARMS, share)
    batch = arms.begin(SCALE, threads)
    peer = NumpyArms(arms.robot, arms.frame, cases.GAIN)
    q, q_peer, k = arms.q.copy(), arms.q.copy(), 20
    ours, theirs, bound, own, ratios = [], [], [], 0, []
    proven, worst = 0, 0.0
    for block in range(BLOCKS + 1):  # the first does not count
        goals = [arms.goals(k + i) for i in range(STEPS)]
        k += STEPS
        begin = process_time()
        for goal in goals:
            batch.set({f"{arms.frame}.target": goal})
            step = batch.step(q)
            before, q = q, batch.integrate(q, step.v)
            if block:
                bound.append(np.count_nonzero(step.on_bound))
                own += len(step.resolutions)
                proven += np.count_nonzero(step.proven)
        middle = process_time()
        for goal in goals:
            q_peer = q_peer + cases.DT * peer.step(q_peer, goal, arms.q0)
        end = process_time()
        worst = max(worst, deviation(arms, before, goals[-1], step.v))
        if block:
            ours.append(middle - begin)
            theirs.append(end - middle)
            ratios.append(theirs[-1] / ours[-1])
    ticks = ARMS * STEPS
    ours_rate, their_rate = (ticks / np.median(times) / 1e6 for times in (ours, theirs))
    print(
        f"{100 * np.mean(bound) / ARMS:5.1f} % on a bound: {ours_rate:.2f} million arm-ticks per CPU second, "
        f"NumPy {their_rate:.3f}; ratio {np.median(ratios):.1f} ({min(ratios):.1f} … {max(ratios):.1f}); "
        f"proven {100 * proven / ticks / BLOCKS:.2f} %, in ticks of their own "
        f"{100 * own / ticks / BLOCKS:.2f} %; deviation from Controller {worst:.0e} rad/s"
    )


def watch_memory(steps: int) -> None:
    """Print resident memory at the beginning and at the end of many steps."""
    arms = Arms(64, 0.1)
    batch = arms.begin(SCALE, 1)
    q = arms.q
    for k in range(steps):
        if k % (steps // 10) == 0:
            print(
                f"step {k}: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.1f} MB at most so far"
            )
        batch.set({f"{arms.frame}.target": arms.goals(k)})
        q = batch.integrate(q, batch.step(q).v)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--share", type=float, nargs="+", default=[0.0, 0.1, 0.5])
    parser.add_argument("--memory", type=int, metavar="STEPS")
    arguments = parser.parse_args()
    if arguments.memory:
        watch_memory(arguments.memory)
        return
    for share in arguments.share:
        measure(share, arguments.threads)


if __name__ == "__main__":
    main()
