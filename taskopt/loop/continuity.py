"""How smoothly a loop moves its robot: jumps with their causes, alternating limits, conflicts."""

from collections import Counter

from taskopt.hierarchy.alternation import AlternationWatch
from taskopt.hierarchy.jumps import JumpWatch
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task.transition import Transition, transitions

_SHOWN = 3  # largest number of alternating limits that are named in a report
_TOLD = {Status.RELAXED: "relaxed", Status.BRAKED: "braked", Status.FORMULA: "stuck"}  # if there are notes


class Continuity:
    """Record how smoothly a resolver moves the robot: jumps, alternating limits, conflicts, stuck ticks.

    A jump is |x_k − x_(k−1)| of one unknown. Jumps during transitions of tasks are recorded separately,
    because a task that comes or goes is expected to change the answer.

    Args:
        plan: The compiled stack, which has the time step and the transitions of its tasks.

    Attributes:
        jumps: The largest jump, and the largest relative to the change of the problem, with their causes.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan, self._transitions = plan, transitions(plan.tasks)
        self.jumps = JumpWatch()
        self._jumps: dict[tuple[Transition, ...], float] = {}
        self._alternation = AlternationWatch(plan.dt)
        self._noted: Counter[str] = Counter()  # ticks whose answer has notes, by what became of it
        self._first_notes = ""

    def add(self, t: float, resolution: Resolution) -> None:
        """Add the next tick.

        Args:
            t: Time [s].
            resolution: The answer of the tick after that of the last call.
        """
        self._alternation.add(resolution)
        last = self._plan.dt
        under_way = tuple(move for move in self._transitions if move.begin <= t <= move.end + last)
        jump = self.jumps.add(resolution, in_transition=bool(under_way) or self._plan.altered)
        self._jumps[under_way] = max(self._jumps.get(under_way, 0.0), jump)
        notes, status = resolution.notes, resolution.status
        if notes and status in _TOLD:
            self._first_notes = self._first_notes or f"at {t:g} s: {' '.join(notes)}"
            self._noted[_TOLD[status]] += 1

    @property
    def jump(self) -> float:
        """The largest jump of the whole run, in the unit of the unknowns; 0 before the second step."""
        return max(self._jumps.values(), default=0.0)

    def sentences(self) -> list[str]:
        """Describe conflicts, stuck ticks, jumps during transitions, abrupt changes and alternating limits.

        Returns:
            One sentence for each of them; empty for a run without any.
        """
        elsewhere = f"{self._jumps.get((), 0.0):.2g} elsewhere"
        during = [f"{jump:.2g} while {_words(moves)}" for moves, jump in self._jumps.items() if moves]
        noun, unit = self._plan.layout.noun, self._plan.layout.angular_unit
        jumps = f"largest change of {noun} in one tick [{unit}]: {'; '.join([*during, elsewhere])}"
        found = self._alternation.found()
        lines = [f"alternates: {limit}" for limit in found[:_SHOWN]]
        more = [f"alternates: {len(found) - _SHOWN} more limits"] if len(found) > _SHOWN else []
        steepest = self.jumps.steepest
        is_told = steepest is None or steepest.cause == "transition" or not steepest.is_abrupt
        abrupt = [] if is_told else [f"abrupt: {steepest}"]
        return [*self._sentence_of_notes(), *([jumps] if during else []), *abrupt, *lines, *more]

    def _sentence_of_notes(self) -> list[str]:
        """Count the ticks that conflict or are stuck, and quote the first of them; nothing without any."""
        if not self._noted:
            return []
        counts = " and ".join(f"{ticks} ticks {what}" for what, ticks in self._noted.items())
        return [f"{counts}, first {self._first_notes}"]


def _words(moves: tuple[Transition, ...]) -> str:
    """Name transitions that are under way together, with the time from the first to the last of them."""
    begin, end = min(move.begin for move in moves), max(move.end for move in moves)
    return f"{' and '.join(f'{move.task} {move.what}' for move in moves)} ({begin:g} to {end:g} s)"
