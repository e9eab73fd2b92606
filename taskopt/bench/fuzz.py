"""Random ticks of random stacks on four robots: is every answer proven, or reported as failed?

A stack is drawn from frame, position, orientation, box, gaze and joint tasks, some twice, in two to four
levels, inside position and velocity limits or limits on acceleration, and distances to be kept from obstacles
and from the robot itself. Ticks go on from one another, so that the resolver starts from the last active set,
or jump to another posture, some of it on its limits, with targets near, far out of reach, or where the frame
is already.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

from taskopt.arrays import Array
from taskopt.bench.random_stacks import FRAMES, aim, fuzz_robot, random_stack, random_start
from taskopt.errors import Infeasible, NotSolved
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import PROVEN
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.distance import BoundDistance
from taskopt.loop.controller import Controller

KEPT = 1e-9  # [rad, rad/s, m] by how much a limit may be missed after the step
RUN = 20  # ticks in a row, on average
STACK = 500  # ticks with one stack, on average
STARTS = 50  # postures that are drawn for one that keeps all distances
HEADINGS = "ticks", "bound", "near", "conflicts", "reported", "unproven"
WORST = "certificate", "position", "velocity", "distance"


@dataclass
class Fuzzed:
    """What became of the ticks of one robot."""

    robot: str
    ticks: int = 0
    bound: int = 0  # ticks with a bound of the box active
    near: int = 0  # ticks with a distance limit active
    conflicts: int = 0  # limits on acceleration and distances that contradict each other, by name
    reported: int = 0  # failures that the resolver itself reports
    unproven: int = 0  # said to be solved, and not certified: the one thing that must not be
    certificate: float = 0.0  # the worst of those that are said to be solved
    position: float = 0.0  # [rad, m] worst excess after the step
    velocity: float = 0.0  # [rad/s, m/s] likewise
    distance: float = 0.0  # [m] by which a distance is below its margin after the step, at worst

    @property
    def clean(self) -> bool:
        """Whether every answer was proven or reported, and every limit kept."""
        return self.unproven == 0 and max(self.position, self.velocity, self.distance) <= KEPT


def fuzz(
    name: str, ticks: int, seed: int = 0, resolver: str = "active-set", keep: Path | None = None
) -> Iterator[Fuzzed]:
    """Yield the tally of a robot after each of its ticks; failures are saved as hierarchies in `keep`."""
    robot, rng, tally = fuzz_robot(name), np.random.default_rng([seed, *name.encode()]), Fuzzed(name)
    while tally.ticks < ticks:
        drawn = random_stack(robot, FRAMES[name], rng)
        control = Controller(robot, drawn.stack, resolver, drawn.dt)
        floors = [Floor(limit) for limit in control.plan.distance_limits.values()]
        after = Configuration(robot, robot.neutral)
        q, fresh = robot.neutral, True
        for _ in range(min(1 + rng.geometric(1.0 / STACK), ticks - tally.ticks)):
            if fresh:
                q = _start(after, floors, rng)
                control.plan.moved(np.zeros(robot.nv))
                aim(drawn.targets, robot, q, rng)
            tally.ticks += 1
            try:
                resolution = control.step(q, 0.0)
                q = robot.integrate(q, resolution.v, drawn.dt)
                after.update(q)
                _judge(tally, resolution, after, floors, keep)
                fresh = rng.random() < 1.0 / RUN
            except NotSolved as error:
                _report(tally, getattr(error.resolution, "problem", None), keep)
                fresh = True
            except Infeasible as error:
                if drawn.rests:  # v = 0 keeps all limits, so there is no conflict
                    _report(tally, error.hierarchy, keep)
                tally.conflicts += not drawn.rests
                fresh = True
            yield tally


class Floor:
    """What the distances of one limit may not fall below: its margin.

    A pair that starts inside the margin may lose what `limit.distance_kernel` states, 1e-9 m or a tenth
    of its depth a step, until it has left.
    """

    def __init__(self, limit: BoundDistance) -> None:
        self.limit = limit
        self.least: Array = np.full(len(limit.row_names), limit.margin)

    def start(self, at: Configuration) -> bool:
        """Measure at the start of a run; whether all pairs are outside the margin."""
        self.limit.distances.update(at)
        self.least[:] = self.limit.margin
        self._lower(np.ones(len(self.least), dtype=bool))
        return bool((self.least == self.limit.margin).all())

    def missing(self, at: Configuration) -> float:
        """By how much the worst pair is below its floor [m]; ≤ 0 where none is."""
        self.limit.distances.update(at)
        worst = float((self.least - self.limit.distances.distance).max(initial=-np.inf))
        begun_inside = self.least < self.limit.margin
        self.least[:] = self.limit.margin
        self._lower(begun_inside)
        return worst

    def _lower(self, among: NDArray[np.bool_]) -> None:
        distance, margin = self.limit.distances.distance, self.limit.margin
        inside = among & (distance < margin)
        self.least[inside] = distance[inside] - np.maximum(KEPT, 0.1 * (margin - distance[inside]))


def table(tallies: Sequence[Fuzzed]) -> Table:
    """One row a robot."""
    out = Table(title="random ticks", box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("robot", *HEADINGS, *WORST):
        out.add_column(heading, justify="left" if heading == "robot" else "right")
    for tally in tallies:
        counts = (str(getattr(tally, heading)) for heading in HEADINGS)
        out.add_row(tally.robot, *counts, *(f"{getattr(tally, figure):.1e}" for figure in WORST))
    return out


def _start(at: Configuration, floors: Sequence[Floor], rng: np.random.Generator) -> Array:
    """A posture that keeps all distances, if one is found in a few tries; else the last of them."""
    for _ in range(STARTS if floors else 1):
        at.update(random_start(at.robot, rng))
        outside = [floor.start(at) for floor in floors]
        if all(outside):
            break
    return at.q.copy()


def _judge(
    tally: Fuzzed, resolution: Resolution, after: Configuration, floors: Sequence[Floor], keep: Path | None
) -> None:
    robot = after.robot
    over = np.abs(resolution.v) - robot.velocity_limit
    limited = robot.position_index >= 0
    at = after.q[robot.position_index[limited]]
    outside = np.maximum(robot.position_lower[limited] - at, at - robot.position_upper[limited])
    missed = {
        "velocity": float(over.max()),
        "position": float(outside.max(initial=0.0)),
        "distance": max((floor.missing(after) for floor in floors), default=0.0),
    }
    for figure, excess in missed.items():
        setattr(tally, figure, max(getattr(tally, figure), excess))
    hard = resolution.state[robot.nv :][resolution.problem.layout.rows_of_level(0)]
    tally.bound += bool(resolution.state[: robot.nv].any())
    tally.near += bool(hard.any())
    if not resolution.claimed:
        _report(tally, resolution.problem, keep)
        return
    tally.certificate = max(tally.certificate, resolution.certificate.worst)
    tally.unproven += not resolution.certified(PROVEN)
    if not resolution.certified(PROVEN) or max(missed.values()) > KEPT:
        _save(tally, resolution.problem, keep)


def _report(tally: Fuzzed, problem: object, keep: Path | None) -> None:
    tally.reported += 1
    if isinstance(problem, Hierarchy):
        _save(tally, problem, keep)


def _save(tally: Fuzzed, problem: Hierarchy, keep: Path | None) -> None:
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        problem.save(keep / f"{tally.robot}-{tally.ticks}.npz")
