"""A scenario resolved tick by tick: the loop yields, recorders listen.

    v_k resolves the hierarchy of (q_k, t_k),    q_{k+1} = q_k ⊕ v_k Δt    (3.48),

one time index for error, feedforward and step. One clock times every resolver, and nothing but the
resolver: not the kinematics, not the copies that a step keeps, not the closed form beside it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter_ns

import numpy as np

from taskopt.arrays import Array
from taskopt.errors import NotSolved
from taskopt.hierarchy.certificate import RESIDUALS, TOLERANCE
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.collision.measure import Measured
from taskopt.kinematics.stack import Plan
from taskopt.loop.scenario import Scenario
from taskopt.resolver.base import Memory, Resolver
from taskopt.resolver.infeasible import apply_conflict_policy

ANSWERED = frozenset({Status.FORMULA, Status.RELAXED, Status.BRAKED})
KEPT = {Status.SOLVED: 1e-6, Status.ITERATION_LIMIT: TOLERANCE}  # relative, of what a hard limit allows
PRIMAL = RESIDUALS.index("primal")
_KEEPS = 1e-12  # a closed form that is over a bound by less than this (relative) keeps it


@dataclass(frozen=True, eq=False)
class Step:
    """One tick of one resolver; every array is the step's own."""

    resolver: str
    index: int
    t: float  # [s]
    q: Array  # (nq,) where the hierarchy was built
    q_next: Array  # (nq,) after the Euler step
    v: Array  # (nv,) [rad/s, m/s]
    hierarchy: Hierarchy
    resolution: Resolution
    seconds: float  # in the resolver
    build_seconds: float  # kinematics and rows
    errors: dict[str, Array]  # e = x_d − x of each task, unweighted
    targets: dict[str, Array]  # desired pose (4, 4) of each frame task
    actuals: dict[str, Array]  # actual pose (4, 4)
    twin: Array  # (n,) the closed form of the same problem
    distances: Mapping[str, Measured] = field(default_factory=dict)  # at q, of each limit that keeps any

    @cached_property
    def twin_distance(self) -> float:
        """‖v − v of the closed form of the same hierarchy‖∞."""
        return float(np.abs(self.v - self.twin).max())

    @cached_property
    def free(self) -> bool:
        """Whether no row binds at any level: the closed form keeps every bound, and so is the optimum."""
        h = self.hierarchy
        if (self.twin < _low(h.box_lower)).any() or (self.twin > _high(h.box_upper)).any():
            return False
        bounded = h.lower < h.upper
        bounded[h.layout.rows_of_level(0)] = True
        value = h.A[bounded] @ self.twin
        return bool((value >= _low(h.lower[bounded])).all() and (value <= _high(h.upper[bounded])).all())


def run(scenario: Scenario, resolver: Resolver) -> Iterator[Step]:
    """Yield the steps of a run; what becomes of them is the caller's affair.

    Raises `NotSolved`, which keeps the resolution and its hierarchy, at the first tick whose answer may
    not be sent to a robot, and `Infeasible` where limits contradict each other, if that is the policy.
    """
    plan = scenario.stack.compile(scenario.robot, scenario.dt)
    q, memory = scenario.start.copy(), None
    plan.start(q, 0.0)
    resolver(plan.at(q, 0.0), None)  # imports and compilation are nobody's solve time
    for index in range(scenario.ticks):
        step, memory = _tick(scenario, plan, resolver, index, q, memory)
        yield step
        q = step.q_next


def _tick(
    scenario: Scenario, plan: Plan, resolver: Resolver, index: int, q: Array, memory: Memory | None
) -> tuple[Step, Memory]:
    t = index * scenario.dt
    begin = perf_counter_ns()
    hierarchy = plan.at(q, t)
    built = perf_counter_ns()
    resolution, memory = resolver(hierarchy, memory)
    end = perf_counter_ns()
    kept = hierarchy.copy()
    if not usable(resolution):
        when = f"tick {index}, t = {t:.6g} s"
        resolution = apply_conflict_policy(
            scenario.on_conflict, resolver, kept, resolution, plan.brakes(), when
        )
        if not usable(resolution):
            raise not_solved(resolver.name, resolution, when)
    v = resolution.v.copy()
    plan.moved(v)
    poses = [(task.name, task.desired, task.actual) for task in plan.tasks]
    framed = [(name, x_d, x) for name, x_d, x in poses if x_d is not None and x is not None]
    step = Step(
        resolver=resolver.name,
        index=index,
        t=t,
        q=q,
        q_next=scenario.robot.integrate(q, v, scenario.dt),
        v=v,
        hierarchy=kept,
        resolution=resolution,
        seconds=(end - built) * 1e-9,
        build_seconds=(built - begin) * 1e-9,
        errors={task.name: task.error.copy() for task in plan.tasks},
        targets={name: x_d.copy() for name, x_d, _ in framed},
        actuals={name: x.copy() for name, _, x in framed},
        twin=resolver.closed_form(kept),
        distances={name: limit.distances.measured() for name, limit in plan.distance_limits.items()},
    )
    return step, memory


def tracking_error(step: Step) -> float:
    """‖e‖ [m] of the first task with a frame and rows in metres; where there is none, of the first task."""
    blocks = [block for block in step.hierarchy.layout.blocks if block.level > 0]
    for block in blocks:
        metres = np.array([unit.startswith("m") for unit in block.row_units])
        metres &= np.isfinite(step.hierarchy.lower[block.rows])  # a task out of force misses nothing
        if block.name in step.targets and metres.any():
            return float(np.linalg.norm(step.errors[block.name][metres]))
    return float(np.linalg.norm(step.errors[blocks[0].name]))


def usable(resolution: Resolution) -> bool:
    """Whether an answer may be sent to a robot: it is finite, and is what the resolver stands for.

    An optimum that is claimed, or one that was not quite reached, must keep the hard limits; the
    certificate tells, whatever the claim.
    """
    if not np.isfinite(resolution.x).all():
        return False
    if resolution.status in KEPT:
        broken = float(resolution.certificate.residuals[:, PRIMAL].max())
        return broken <= KEPT[resolution.status]
    return resolution.status in ANSWERED


def not_solved(resolver: str, resolution: Resolution, when: str) -> NotSolved:
    """The error that stops a loop, with the resolution for a post-mortem."""
    verdict = resolution.status.name.lower().replace("_", " ")
    if not np.isfinite(resolution.x).all() and (resolution.claimed or resolution.status in ANSWERED):
        verdict = "not a number"
    elif resolution.claimed:
        verdict = "a velocity that breaks a hard limit"
    return NotSolved(f"{resolver} at {when}: {verdict}; {resolution.status.value}", resolution)


def _low(bound: Array) -> Array:
    return bound - _KEEPS * np.maximum(1.0, np.abs(bound))


def _high(bound: Array) -> Array:
    return bound + _KEEPS * np.maximum(1.0, np.abs(bound))
