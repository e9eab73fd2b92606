"""The figures of one resolver's run, which the comparison, the report and the viewer show."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import IntArray
from taskopt.hierarchy.layout import Layout
from taskopt.loop.continuity import Continuity
from taskopt.loop.run import Step, tracking_error
from taskopt.recording.batch import Batch
from taskopt.recording.judged import JudgedTicks
from taskopt.recording.violation import LimitGauge


@dataclass
class Summary:
    """The figures of one resolver, accumulated batch by batch.

    Violations are those of the limits that the stack declares: of position limits after each step, and of
    velocity limits that do not change with time.

    Attributes:
        resolver: The name of the resolver.
        gauge: Measures positions and velocities against the limits of the run.
        tracking: The tracking error of each tick, see `tracking_error`, (ticks,) [m].
        position_violation: The largest violation of a position limit [rad, m].
        velocity_violation: The largest violation of a velocity limit [rad/s, m/s].
        acceleration_violation: The largest violation of an acceleration limit at order 2 [rad/s², m/s²].
        least_distance: The least distance that each distance limit measured [m].
        closed_form_distances: The distance to the closed-form answer at each tick at which nothing binds,
            in the unit of the answers.
        path_difference: The largest ‖q ⊖ q of the baseline resolver‖∞ at the same tick [rad, m].
        claimed: The number of ticks at which the resolver claims an optimum.
        judged: The verdicts on the judged ticks, and their largest error bound.
        kkt_residual: The largest KKT residual.
        fallbacks: The number of ticks that a fallback of the resolver answered.
        damped: The number of ticks that were damped, see `RestDamping`.
        damping_distance: The largest distance of such an answer to that without damping, in the unit of the
            answers.
        causes: The number of ticks at which each kind of cause makes the answer differ from its closed form.
        seconds: The solve time of each tick, (ticks,) [s].
        solver_seconds: The part of it that was spent inside the package of a solver, (ticks,) [s].
        active: The number of ticks at which each bound or inequality is active, by name.
        ticks_active: The number of ticks at which at least one bound or inequality is active.
        continuity: The jumps, alternating limits and conflicts.
        stopped: The message of the error that ended the run early; empty if there was none.
    """

    resolver: str
    gauge: LimitGauge
    tracking: list[float] = field(default_factory=list)
    position_violation: float = 0.0
    velocity_violation: float = 0.0
    acceleration_violation: float = 0.0
    least_distance: dict[str, float] = field(default_factory=dict)
    closed_form_distances: list[float] = field(default_factory=list)
    path_difference: float = 0.0
    claimed: int = 0
    judged: JudgedTicks = field(init=False)
    kkt_residual: float = 0.0
    fallbacks: int = 0
    damped: int = 0
    damping_distance: float = 0.0
    causes: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    solver_seconds: list[float] = field(default_factory=list)
    active: Counter[str] = field(default_factory=Counter)
    ticks_active: int = 0
    continuity: Continuity = field(init=False)
    stopped: str = ""

    def __post_init__(self) -> None:
        self.continuity = Continuity(self.gauge.info.plan)
        self.judged = JudgedTicks()

    @property
    def layout(self) -> Layout:
        """The names and units of the unknowns."""
        return self.gauge.info.plan.layout

    @property
    def ticks(self) -> int:
        """The number of ticks so far."""
        return len(self.seconds)

    def add(self, batch: Batch) -> None:
        """Add a batch.

        Args:
            batch: The steps that follow those of the last call, of the same resolver.
        """
        for step in batch.steps:
            self.tracking.append(tracking_error(step))
            self.continuity.add(step.t, step.resolution)
            if step.resolution.review is not None:
                self.causes.update({cause.kind for cause in step.resolution.review.causes})
            self.fallbacks += step.resolution.fallback is not None
            self.damped += step.resolution.is_damped
            self.damping_distance = max(self.damping_distance, step.resolution.damping_distance)
            if step.nothing_binds:
                self.closed_form_distances.append(step.closed_form_distance)
        if self.gauge.keeps_positions:
            excess = float(self.gauge.position_violation(batch).max())
            self.position_violation = max(self.position_violation, excess)
        excess = float(self.gauge.velocity_violation(batch).max())
        self.velocity_violation = max(self.velocity_violation, excess)
        if self.gauge.info.accelerates:
            beyond = float((np.abs(batch.x) - self.gauge.acceleration_limit).max())
            self.acceleration_violation = max(self.acceleration_violation, beyond)
        for limit in batch.distance_limits:
            least = float(batch.distance(limit).min())
            self.least_distance[limit] = min(self.least_distance.get(limit, np.inf), least)
        self.claimed += int(batch.claimed.sum())
        self.judged.add(batch)
        self.kkt_residual = max(self.kkt_residual, float(batch.kkt_residual.max()))
        self.seconds += batch.seconds.tolist()
        self.solver_seconds += batch.solver_seconds.tolist()
        self._add_active(batch)

    def compare_path(self, step: Step, baseline: Step) -> None:
        """Compare the path with that of another resolver.

        Args:
            step: A step of this resolver.
            baseline: The step of the other resolver at the same tick.
        """
        robot = self.gauge.info.scenario.robot
        difference = np.abs(robot.difference(baseline.q_next, step.q_next)).max()
        self.path_difference = max(self.path_difference, float(difference))

    def _add_active(self, batch: Batch) -> None:
        """Count the active bounds and inequalities by name."""
        code: IntArray = batch.active_code
        self.ticks_active += int((code != 0).any(axis=1).sum())
        ticks, rows = np.nonzero(code)
        counted = Counter(zip(rows.tolist(), code[ticks, rows].tolist(), strict=True))
        for (row, value), count in counted.items():
            self.active[batch.active_name(row, value)] += count
