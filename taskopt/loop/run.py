"""`run`, which resolves a scenario tick by tick and yields one step for each tick.

    v_k resolves the hierarchy of (q_k, t_k),    q_(k+1) = q_k ⊕ v_k Δt    (3.48)

or, with a stack of order 2,

    q̈_k resolves the hierarchy of (q_k, v_k, t_k),    v_(k+1) = v_k + q̈_k Δt,
                                                      q_(k+1) = q_k ⊕ (v_k Δt + ½ q̈_k Δt²).

Error, feedforward and Euler step have the same time index k. The measured time of a resolver is that of the
resolver alone, without kinematics, without the copies that a step keeps, and without the closed-form answer.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import CLOSED_FORM_INSIDE
from taskopt.kinematics.collision.measure import Measured
from taskopt.loop.loop import Loop
from taskopt.loop.onward import LogStart, Moment
from taskopt.loop.run_log import RunLog
from taskopt.loop.scenario import Scenario
from taskopt.resolver.base import Resolver
from taskopt.resolver.registry import as_resolver

JUDGED = 500  # judgements of a run: each takes 3 to 20 ms, which every tick of a long run cannot spare


@dataclass(frozen=True, eq=False)
class Step:
    """The record of one tick of one resolver; all arrays are copies.

    Attributes:
        resolver: Name of the resolver.
        index: Number of the tick, from 0.
        t: Time [s].
        q: Posture at which the hierarchy was built, (nq,) [rad, m].
        q_next: Posture at the next tick, (nq,) [rad, m].
        v: Velocity that was sent, (nv,) [rad/s, m/s]; at order 2 that at the next tick.
        hierarchy: The problem of the tick.
        resolution: Its answer, or the answer of the conflict policy instead.
        seconds: Time in the resolver [s].
        build_seconds: Time for kinematics, targets and rows [s].
        solver_seconds: Part of `seconds` that was spent inside the package of a solver [s].
        errors: e = x_d − x of each task by name, unweighted, one number for each row [m, rad].
        desired: Desired pose of each task that has one, by name, (4, 4) in the world [m].
        actual: Actual pose of the same tasks, by name, (4, 4) in the world [m].
        closed_form: The closed-form answer to the same problem, (nv,) [rad/s, m/s], at order 2 [rad/s²,
            m/s²], which does not consider limits.
        distances: Measured distances at q, by name of the limit on them.
        moving: Pose of each obstacle that moves, by name, (4, 4) in the world [m].
    """

    resolver: str
    index: int
    t: float
    q: Array
    q_next: Array
    v: Array
    hierarchy: Hierarchy
    resolution: Resolution
    seconds: float
    build_seconds: float
    solver_seconds: float
    errors: dict[str, Array]
    desired: dict[str, Array]
    actual: dict[str, Array]
    closed_form: Array
    distances: Mapping[str, Measured] = field(default_factory=dict)
    moving: Mapping[str, Array] = field(default_factory=dict)
    judged: bool = True

    @cached_property
    def closed_form_distance(self) -> float:
        """Largest difference to the closed-form answer, ‖x − closed_form‖∞, in the unit of x."""
        return float(np.abs(self.x - self.closed_form).max())

    @property
    def x(self) -> Array:
        """The answer: the velocity v (nv,) [rad/s, m/s], at order 2 the acceleration [rad/s², m/s²]."""
        return self.resolution.x

    @cached_property
    def nothing_binds(self) -> bool:
        """True if the closed-form answer keeps every bound of the problem, and so is the optimum."""
        h, x = self.hierarchy, self.closed_form
        bounded = h.lower < h.upper
        bounded[h.layout.rows_of_level(0)] = True
        return _inside(x, h.box_lower, h.box_upper) and _inside(
            h.A[bounded] @ x, h.lower[bounded], h.upper[bounded]
        )


def run(
    scenario: Scenario,
    resolver: str | Resolver = "active-set",
    judged: int = JUDGED,
    log: str | Path | RunLog | None = None,
    start: LogStart | None = None,
) -> Iterator[Step]:
    """Resolve a scenario tick by tick, by steps on the manifold of the robot, see `taskopt.loop.run`.

    Args:
        scenario: Robot, start, stack, duration and period.
        resolver: A resolver, or the name of one (`taskopt list` shows them).
        judged: Number of ticks whose answer is to be judged, evenly spread. Answers that are claimed although
            their KKT residuals are large are judged in any case.
        log: File to which all ticks are logged, see `open_log`, which is closed with the run; or a log that
            several runs share.
        start: A moment of a log of this scenario, at which the run begins; None: at the start of the
            scenario. The duration counts from that start in both cases.

    Yields:
        One step for each tick.

    Raises:
        NotSolved: The answer of a tick may not be sent to a robot; the error has the resolution.
        Infeasible: Hard limits contradict each other, and `scenario.on_conflict` is "raise".
        UnknownName: There is no resolver of that name.
        InvalidValue: `start` is a moment of a log of another scenario, or at its end.
        LogFailed: The log cannot be written any more, as on a full disk.
    """
    resolver = as_resolver(resolver)
    scenario = scenario if start is None else start.of(scenario)
    if isinstance(log, str | Path):
        with RunLog(scenario, [resolver], log, start=start) as own:
            yield from run(scenario, resolver, judged, own, start)
        return
    loop = Loop(scenario.compile(), resolver, scenario.on_conflict, timed=True)
    first, q, delay = _begun(scenario, loop, start)  # imports and compilation are nobody's solve time
    tick = loop.tick if log is None else log.tick(loop, first)
    every = -(-scenario.ticks // max(1, judged))
    for index in range(first, scenario.ticks):
        t = index * scenario.dt + delay
        resolution = tick(q, t)
        step = _step(loop, resolution, (index, t), q, judged=index % every == 0)
        yield step
        q = step.q_next


def _begun(scenario: Scenario, loop: Loop, start: LogStart | None) -> Moment:
    """Start a loop at the start of the scenario, or at a moment of a log."""
    if start is not None:
        return start.begin(loop)
    loop.start(scenario.start, 0.0)
    return Moment(0, scenario.start.copy(), 0.0)


def _step(loop: Loop, resolution: Resolution, when: tuple[int, float], q: Array, *, judged: bool) -> Step:
    """Copy the results of a tick, and take the step."""
    plan, hierarchy, v = loop.plan, loop.plan.hierarchy.copy(), loop.plan.velocity.copy()
    poses = [(task.name, task.desired, task.actual) for task in plan.tasks]
    framed = [(name, x_d, x) for name, x_d, x in poses if x_d is not None and x is not None]
    return Step(
        resolver=loop.resolver.name,
        index=when[0],
        t=when[1],
        q=q,
        q_next=plan.next_posture(q),
        v=v,
        hierarchy=hierarchy,
        resolution=resolution,
        seconds=loop.seconds.resolver,
        build_seconds=loop.seconds.rows,
        solver_seconds=loop.seconds.solver,
        errors={task.name: task.error.copy() for task in plan.tasks},
        desired={name: x_d.copy() for name, x_d, _ in framed},
        actual={name: x.copy() for name, _, x in framed},
        closed_form=loop.resolver.closed_form(resolution.problem),
        distances={name: limit.distances.measured() for name, limit in plan.distance_limits.items()},
        moving={name: pose.copy() for name, pose in plan.moving.items()},
        judged=_is_judged(resolution, chosen=judged),
    )


def _is_judged(resolution: Resolution, *, chosen: bool) -> bool:
    """Return True for an answer to be judged; one that brakes aims at no optimum and is not judged."""
    if resolution.status is Status.BRAKED:
        return False
    return chosen or (resolution.claimed and not resolution.kkt_met())


def tracking_error(step: Step) -> float:
    """Return the tracking error of a step, ‖e‖.

    Args:
        step: The step.

    Returns:
        Norm [m] of those error rows that are in metres, for the first task that is in force and has a frame
        and such rows. If there is no such task, the norm of all error rows of the first task [m, rad].
    """
    blocks = [block for block in step.hierarchy.layout.blocks if block.level > 0]
    for block in blocks:
        metres = np.array([unit.startswith("m") for unit in block.row_units])
        metres &= np.isfinite(step.hierarchy.lower[block.rows])
        if block.name in step.desired and metres.any():
            return float(np.linalg.norm(step.errors[block.name][metres]))
    return float(np.linalg.norm(step.errors[blocks[0].name]))


def _inside(value: Array, lower: Array, upper: Array) -> bool:
    """Return True if lower ≤ value ≤ upper holds up to rounding."""
    below = lower - CLOSED_FORM_INSIDE * np.maximum(1.0, np.abs(lower))
    above = upper + CLOSED_FORM_INSIDE * np.maximum(1.0, np.abs(upper))
    return bool(((below <= value) & (value <= above)).all())
