"""Resolve random ticks of random stacks on four robots, and judge the answers that are claimed.

A stack has two to four levels of frame, position, orientation, box, gaze and joint tasks, some of them twice.
Around them are limits on position and velocity or on acceleration, and distances to be kept from obstacles
and from the robot itself. Most ticks follow from the tick before, so that the resolver starts from the last
active set. The others jump to another posture, sometimes exactly on its limits, with targets that are near
the frame, far out of reach, or at the frame itself.

At order 2 the answers are accelerations, and each sequence of ticks starts at rest. Distances are measured
where their limit holds them then, at the posture half a step ahead of the next tick, q⁺ ⊕ v⁺ Δt/2.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from taskopt.arrays import Array, Mask
from taskopt.bench.random_stacks import FRAMES, Draw, aim, fuzz_robot, random_stack, random_start
from taskopt.errors import Infeasible, KeptProblem, NotSolved
from taskopt.hierarchy.proof import UNDECIDED, Verdict
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.tolerances import LIMIT_KEPT
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.limit.acceleration import BoundJointAcceleration
from taskopt.kinematics.limit.bound_distance import BoundDistance
from taskopt.loop.controller import Controller

TICKS_IN_A_ROW = 20  # on average, before the robot jumps to another posture
TICKS_PER_STACK = 500  # on average
TICKS_PER_JUDGEMENT = 20  # a judgement takes as long as a hundred ticks
STARTS = 50  # postures that are tried for one that keeps all distances


@dataclass
class Tally:
    """Results of all ticks of one robot.

    Attributes:
        robot: Name of the robot.
        ticks: Ticks so far.
        bound: Ticks at which a bound of the box is active.
        near: Ticks at which a distance limit is active.
        conflicts: Ticks whose limits on acceleration and distances contradict each other.
        reported: Ticks without a solved answer, which the resolver reports itself.
        fallbacks: Answers of a fallback of the resolver.
        missed: Answers that claim to be optimal, miss their KKT conditions, and are not proven either. There
            must be none.
        proven: Claimed answers that are judged, and proven.
        refuted: Claimed answers that are judged, and refuted. There must be none.
        undecided: Claimed answers that are judged, and undecided.
        error_bound: The largest error bound of the proven answers [rad/s, m/s].
        position: Largest excess over a position limit after the Euler step [rad, m].
        velocity: Largest excess over a velocity limit [rad/s, m/s].
        acceleration: Largest excess over an acceleration limit at order 2 [rad/s², m/s²].
        distance: Largest amount by which a distance is below its margin after the Euler step [m].
    """

    robot: str
    ticks: int = 0
    bound: int = 0
    near: int = 0
    conflicts: int = 0
    reported: int = 0
    fallbacks: int = 0
    missed: int = 0
    proven: int = 0
    refuted: int = 0
    undecided: int = 0
    error_bound: float = 0.0
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
    distance: float = 0.0

    @property
    def clean(self) -> bool:
        """True if every claim meets its KKT conditions, none is refuted, and every limit is kept."""
        return (
            self.missed == self.refuted == 0
            and max(self.position, self.velocity, self.acceleration, self.distance) <= LIMIT_KEPT
        )


def fuzz(
    name: str,
    ticks: int,
    seed: int = 0,
    resolver: str = "active-set",
    keep: Path | None = None,
    order: int = 1,
) -> Iterator[Tally]:
    """Resolve random ticks of one robot.

    Args:
        name: Name of the robot, a key of `FRAMES`.
        ticks: Number of ticks.
        seed: Another seed draws other stacks and postures.
        resolver: Name of the resolver.
        keep: Folder in which hierarchies with a failed answer are saved; None saves nothing.
        order: Order of the stacks.

    Yields:
        The tally so far, after each tick.
    """
    robot, rng, tally = fuzz_robot(name), np.random.default_rng([seed, *name.encode()]), Tally(name)
    while tally.ticks < ticks:
        drawn = random_stack(robot, FRAMES[name], rng, order)
        count = min(1 + rng.geometric(1.0 / TICKS_PER_STACK), ticks - tally.ticks)
        control = Controller(robot, drawn.stack, resolver, drawn.dt)
        yield from _ticks_of_a_stack(tally, drawn, control, count, rng, keep)


def _ticks_of_a_stack(
    tally: Tally, drawn: Draw, control: Controller, count: int, rng: np.random.Generator, keep: Path | None
) -> Iterator[Tally]:
    """Resolve ticks of one stack, and yield the tally after each."""
    robot = control.plan.robot
    floors = [Floor(limit) for limit in control.plan.distance_limits.values()]
    after, strongest = Configuration(robot, robot.neutral), _strongest(control)
    q, fresh = robot.neutral, True
    for _ in range(count):
        if fresh:
            q = _start(after, floors, rng)
            control.plan.moved(np.zeros(robot.nv))
            aim(drawn.targets, robot, q, rng)
        tally.ticks += 1
        try:
            resolution = control.step(q, 0.0)
            q, v = control.after()
            after.update(q if strongest is None else robot.integrate(q, v, 0.5 * drawn.dt))
            _judge(tally, resolution, Reached(q, v, after, strongest), floors, keep)
            fresh = rng.random() < 1.0 / TICKS_IN_A_ROW
        except NotSolved as error:
            refused = error.resolution
            _report(tally, None if refused is None else refused.problem, keep)
            fresh = True
        except Infeasible as error:
            if drawn.rests:  # v = 0 keeps all limits, so there is no conflict
                _report(tally, error.hierarchy, keep)
            tally.conflicts += not drawn.rests
            fresh = True
        yield tally


class Reached(NamedTuple):
    """What a tick leads to.

    Attributes:
        q: Posture after the step, (nq,) [rad, m].
        v: Velocity after the step, (nv,) [rad/s, m/s].
        distant: The robot where distances are held: at q, at order 2 half a step ahead of it.
        strongest: The largest accelerations that are allowed, (nv,) [rad/s², m/s²]; None at order 1.
    """

    q: Array
    v: Array
    distant: Configuration
    strongest: Array | None = None

    def excess(self, x: Array) -> float:
        """Measure the excess of an answer over the largest accelerations.

        Args:
            x: The answer, (nv,).

        Returns:
            The largest excess [rad/s², m/s²]; 0 at order 1.
        """
        return 0.0 if self.strongest is None else max(0.0, float((np.abs(x) - self.strongest).max()))


class Floor:
    """The least values that the distances of one distance limit may have.

    This is the margin of the limit. As the limit promises, a pair that starts inside the margin may come
    nearer by 1e-9 m or by a tenth of its depth in each step, until it has left the margin.

    Args:
        limit: The distance limit, bound to the robot.

    Attributes:
        limit: The distance limit.
        least: Least distance of each pair, (pairs,) [m].
    """

    def __init__(self, limit: BoundDistance) -> None:
        self.limit = limit
        self.least: Array = limit.margins.copy()

    def start(self, configuration: Configuration) -> bool:
        """Measure the distances at the start of a sequence of ticks.

        Args:
            configuration: The robot at the start.

        Returns:
            True if all pairs are outside the margin.
        """
        self.limit.distances.update(configuration)
        self.least[:] = self.limit.margins
        self._lower(np.ones(len(self.least), dtype=bool))
        return bool((self.least == self.limit.margins).all())

    def missing(self, configuration: Configuration) -> float:
        """Measure the distances after a step, and set the least values for the next step.

        Args:
            configuration: The robot after the step.

        Returns:
            The largest amount by which a pair is below its least distance [m]; ≤ 0 if there is none.
        """
        self.limit.distances.update(configuration)
        worst = float((self.least - self.limit.distances.distance).max(initial=-np.inf))
        begun_inside = self.least < self.limit.margins
        self.least[:] = self.limit.margins
        self._lower(begun_inside)
        return worst

    def _lower(self, among: Mask) -> None:
        """Lower the least distance of those pairs among the given ones that are inside the margin."""
        distance, margin = self.limit.distances.distance, self.limit.margins
        inside = among & (distance < margin)
        depth = (margin - distance)[inside]
        self.least[inside] = distance[inside] - np.maximum(LIMIT_KEPT, 0.1 * depth)


_COLUMNS = {
    "ticks": "ticks",
    "bound\nactive": "bound",
    "dist.\nactive": "near",
    "con-\nflict": "conflicts",
    "fail-\nures": "reported",
    "fallback\nanswered": "fallbacks",
    "KKT\nunmet": "missed",
    "\nproven": "proven",
    "re-\nfuted": "refuted",
    "unde-\ncided": "undecided",
    "error\nbound": "error_bound",
    "pos.\n[rad]": "position",
    "vel.\n[rad/s]": "velocity",
    "acc.\n[rad/s²]": "acceleration",
    "dist.\n[m]": "distance",
}


def table(tallies: Sequence[Tally]) -> Table:
    """Make the table of the run.

    Args:
        tallies: One for each robot.

    Returns:
        One row for each robot, with counts of ticks and worst figures.
    """
    caption = (
        f"proven, refuted, undecided: of every {TICKS_PER_JUDGEMENT}th claim; error bound: "
        "largest of those proven, in the unit of the answers; pos., vel., acc. (at order 2), dist.: largest "
        "excess over a limit after the step"
    )
    out = Table(
        title="random ticks", caption=Text(caption), box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    out.add_column("robot", no_wrap=True)
    columns = {  # no stack of order 1 has an excess of acceleration
        heading: figure
        for heading, figure in _COLUMNS.items()
        if figure != "acceleration" or any(tally.acceleration for tally in tallies)
    }
    for heading in columns:
        out.add_column(Text(heading), justify="right", no_wrap=True)
    for tally in tallies:
        figures = (getattr(tally, figure) for figure in columns.values())
        out.add_row(tally.robot, *(str(n) if isinstance(n, int) else f"{n:.1e}" for n in figures))
    return out


def _start(configuration: Configuration, floors: Sequence[Floor], rng: np.random.Generator) -> Array:
    """Return a random posture that keeps all distances; if none is found in `STARTS` tries, the last one."""
    for _ in range(STARTS if floors else 1):
        configuration.update(random_start(configuration.robot, rng))
        outside = [floor.start(configuration) for floor in floors]
        if all(outside):
            break
    return configuration.q.copy()


def _strongest(control: Controller) -> Array | None:
    """Return the largest accelerations that a stack of order 2 allows, (nv,); None at order 1."""
    if control.plan.motion is None:
        return None
    found = [limit for limit in control.plan.limits if isinstance(limit, BoundJointAcceleration)]
    return found[0].strongest if found else np.full(control.plan.robot.nv, np.inf)


def _judge(
    tally: Tally, resolution: Resolution, reached: Reached, floors: Sequence[Floor], keep: Path | None
) -> None:
    """Count one answer, and measure the excess over limits after the step."""
    robot = reached.distant.robot
    over = np.abs(reached.v) - robot.velocity_limit
    limited = robot.position_index >= 0
    position = reached.q[robot.position_index[limited]]
    outside = np.maximum(robot.position_lower[limited] - position, position - robot.position_upper[limited])
    missed = {
        "velocity": float(over.max()),
        "position": float(outside.max(initial=0.0)),
        "acceleration": reached.excess(resolution.x),
        "distance": max((floor.missing(reached.distant) for floor in floors), default=0.0),
    }
    for figure, excess in missed.items():
        setattr(tally, figure, max(getattr(tally, figure), excess))
    hard = resolution.state[robot.nv :][resolution.problem.layout.rows_of_level(0)]
    tally.fallbacks += resolution.fallback is not None
    tally.bound += bool(resolution.state[: robot.nv].any())
    tally.near += bool(hard.any())
    if not resolution.claimed:
        _report(tally, resolution.problem, keep)
        return
    met, refuted = resolution.kkt_met() or resolution.certificate.judgement.proven, tally.refuted
    tally.missed += not met
    if not met or tally.ticks % TICKS_PER_JUDGEMENT == 0:
        _count_verdict(tally, resolution)
    if not met or tally.refuted > refuted or max(missed.values()) > LIMIT_KEPT:
        _save(tally, resolution.problem, keep)


def _count_verdict(tally: Tally, resolution: Resolution) -> None:
    """Judge a claimed answer by a bound on its error."""
    judgement = resolution.certificate.judgement
    tally.proven += judgement.proven
    tally.refuted += judgement.verdict is Verdict.REFUTED
    tally.undecided += judgement.verdict in UNDECIDED
    if judgement.proven:
        tally.error_bound = max(tally.error_bound, float(judgement.error_bound.max()))


def _report(tally: Tally, problem: KeptProblem | None, keep: Path | None) -> None:
    """Count a reported failure, and save its problem."""
    tally.reported += 1
    if problem is not None:
        _save(tally, problem, keep)


def _save(tally: Tally, problem: KeptProblem, keep: Path | None) -> None:
    """Save a problem under robot and tick, if a folder is given."""
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        problem.save(keep / f"{tally.robot}-{tally.ticks}.npz")
