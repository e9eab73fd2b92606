"""The figures of one resolver's run, which the comparison, the report and the viewer show."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from taskopt.arrays import IntArray
from taskopt.hierarchy.alternation import AlternationWatch
from taskopt.hierarchy.status import Status
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task.transition import Transition, transitions
from taskopt.loop.run import Step, tracking_error
from taskopt.record.batch import Batch
from taskopt.record.violation import LimitGauge

_SHOWN = 3  # largest number of alternating limits that are named in a report
_TOLD = {Status.RELAXED: "relaxed", Status.BRAKED: "braked", Status.FORMULA: "stuck"}  # if there are notes


class Continuity:
    """Record how smoothly a resolver moves the robot: jumps, alternating limits, conflicts, stuck ticks.

    A jump is |v_k − v_(k−1)| of one velocity [rad/s, m/s]. Jumps during transitions of tasks are recorded
    separately, because a task that comes or goes is expected to change the velocities.
    """

    def __init__(self, plan: Plan) -> None:
        """Begin a run.

        Args:
            plan: The compiled stack, which has the time step and the transitions of its tasks.
        """
        self._dt, self._transitions = plan.dt, transitions(plan.tasks)
        self._jumps: dict[tuple[Transition, ...], float] = {}
        self._alternation = AlternationWatch(plan.dt)
        self._previous: Step | None = None
        self._noted: Counter[str] = Counter()  # ticks whose answer has notes, by what became of it
        self._first_notes = ""

    def add(self, step: Step) -> None:
        """Add the next step.

        Args:
            step: The step after that of the last call.
        """
        self._alternation.add(step.resolution)
        if self._previous is not None:
            under_way = tuple(
                transition
                for transition in self._transitions
                if transition.begin <= step.t <= transition.end + self._dt
            )
            jump = float(abs(step.v - self._previous.v).max())
            self._jumps[under_way] = max(self._jumps.get(under_way, 0.0), jump)
        self._previous = step
        notes, status = step.resolution.notes, step.resolution.status
        if notes and status in _TOLD:
            self._first_notes = self._first_notes or f"at {step.t:g} s: {' '.join(notes)}"
            self._noted[_TOLD[status]] += 1

    @property
    def jump(self) -> float:
        """The largest jump of the whole run [rad/s, m/s]; 0 before the second step."""
        return max(self._jumps.values(), default=0.0)

    def sentences(self) -> list[str]:
        """Describe conflicts, stuck ticks, jumps during transitions and alternating limits.

        Returns:
            One sentence for each of them; empty for a run without any.
        """
        elsewhere = f"{self._jumps.get((), 0.0):.2g} elsewhere"
        during = [f"{jump:.2g} while {_words(moves)}" for moves, jump in self._jumps.items() if moves]
        jumps = f"largest change of a velocity in one tick [rad/s]: {'; '.join([*during, elsewhere])}"
        found = self._alternation.found()
        lines = [f"alternates: {limit}" for limit in found[:_SHOWN]]
        more = [f"alternates: {len(found) - _SHOWN} more limits"] if len(found) > _SHOWN else []
        return [*self._sentence_of_notes(), *([jumps] if during else []), *lines, *more]

    def _sentence_of_notes(self) -> list[str]:
        """Count the ticks that conflict or are stuck, and quote the first of them; nothing without any."""
        if not self._noted:
            return []
        counts = " and ".join(f"{ticks} ticks {what}" for what, ticks in self._noted.items())
        return [f"{counts}, first {self._first_notes}"]


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
        least_distance: The least distance that each distance limit measured [m].
        closed_form_distances: The distance to the closed-form answer at each tick at which nothing binds
            [rad/s, m/s].
        path_difference: The largest ‖q ⊖ q of the baseline resolver‖∞ at the same tick [rad, m].
        certificates: The largest KKT residual of each tick, (ticks,).
        claimed: The number of ticks at which the resolver claims an optimum.
        certified: The number of ticks at which the certificate proves an optimum.
        fallbacks: The number of ticks that a fallback of the resolver answered.
        damped: The number of ticks that were damped, see `RestDamping`.
        damping_distance: The largest distance of such an answer to that without damping [rad/s, m/s].
        judged: The number of ticks whose active set was solved again, to find the error of x.
        accurate: The number of judged ticks at which the answer has the requested accuracy.
        error: The largest relative error of x at the judged ticks.
        causes: The number of ticks at which each kind of cause makes the answer differ from its closed form.
        seconds: The solve time of each tick, (ticks,) [s].
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
    least_distance: dict[str, float] = field(default_factory=dict)
    closed_form_distances: list[float] = field(default_factory=list)
    path_difference: float = 0.0
    certificates: list[float] = field(default_factory=list)
    claimed: int = 0
    certified: int = 0
    fallbacks: int = 0
    damped: int = 0
    damping_distance: float = 0.0
    judged: int = 0
    accurate: int = 0
    error: float = 0.0
    causes: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    active: Counter[str] = field(default_factory=Counter)
    ticks_active: int = 0
    continuity: Continuity = field(init=False)
    stopped: str = ""

    def __post_init__(self) -> None:
        self.continuity = Continuity(self.gauge.info.plan)

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
            self.continuity.add(step)
            self._add_review(step)
            self.fallbacks += step.resolution.fallback is not None
            self.damped += step.resolution.undamped is not None
            self.damping_distance = max(self.damping_distance, step.resolution.damping_distance)
            if step.nothing_binds:
                self.closed_form_distances.append(step.closed_form_distance)
        if self.gauge.keeps_positions:
            excess = float(self.gauge.position_violation(batch).max())
            self.position_violation = max(self.position_violation, excess)
        excess = float(self.gauge.velocity_violation(batch).max())
        self.velocity_violation = max(self.velocity_violation, excess)
        for limit in batch.distance_limits:
            least = float(batch.distance(limit).min())
            self.least_distance[limit] = min(self.least_distance.get(limit, np.inf), least)
        self.certificates += batch.certificate.tolist()
        self.claimed += int(batch.claimed.sum())
        self.certified += int(batch.certified.sum())
        self.seconds += batch.seconds.tolist()
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

    def _add_review(self, step: Step) -> None:
        """Count accuracy and causes, if a resolver reviews its answers."""
        review = step.resolution.review
        if review is None:
            return
        if not np.isnan(review.error):
            self.judged += 1
            self.error = max(self.error, review.error)
            self.accurate += step.resolution.accurate
        self.causes.update({cause.kind for cause in review.causes})


def _words(moves: tuple[Transition, ...]) -> str:
    """Name transitions that are under way together, with the time from the first to the last of them."""
    begin, end = min(move.begin for move in moves), max(move.end for move in moves)
    return f"{' and '.join(f'{move.task} {move.what}' for move in moves)} ({begin:g} to {end:g} s)"
