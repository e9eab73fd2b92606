"""How smoothly a run goes: jumps of its velocities by transition, limits that chatter, conflicts."""

from collections import Counter

from taskopt.hierarchy.alternation import ChatterWatch
from taskopt.kinematics.stack import Plan
from taskopt.kinematics.task.transition import Transition, transitions
from taskopt.loop.run import Step

_SHOWN = 3  # limits that chatter, named in a summary


class Continuity:
    """Largest |v_k − v_(k−1)| of any velocity [rad/s, m/s] of one resolver, and what chatters."""

    def __init__(self, plan: Plan) -> None:
        self._dt, self._moves = plan.dt, transitions(plan.tasks)
        self._jumps: dict[tuple[Transition, ...], float] = {}
        self._watch = ChatterWatch(plan.dt)
        self._last: Step | None = None
        self._settled: Counter[str] = Counter()  # ticks without an optimum to send, by what was sent instead
        self._conflict = ""  # the first of them

    def add(self, step: Step) -> None:
        """Take the next step in."""
        self._watch.add(step.resolution)
        if self._last is not None:
            under_way = tuple(move for move in self._moves if move.begin <= step.t <= move.end + self._dt)
            jump = float(abs(step.v - self._last.v).max())
            self._jumps[under_way] = max(self._jumps.get(under_way, 0.0), jump)
        self._last = step
        if step.resolution.notes:
            self._conflict = self._conflict or f"at {step.t:g} s: {' '.join(step.resolution.notes)}"
            self._settled[step.resolution.status.name.lower()] += 1

    @property
    def jump(self) -> float:
        """The largest of all."""
        return max(self._jumps.values(), default=0.0)

    def sentences(self) -> list[str]:
        """Conflicts; the jump while each transition is under way and elsewhere, if any; what chatters."""
        rest = f"{self._jumps.get((), 0.0):.2g} elsewhere"
        during = [f"{jump:.2g} while {_words(moves)}" for moves, jump in self._jumps.items() if moves]
        told = f"largest change of a velocity in one tick [rad/s]: {'; '.join([*during, rest])}"
        found = self._watch.found()
        lines = [f"chatters: {chatter}" for chatter in found[:_SHOWN]]
        more = [f"chatters: {len(found) - _SHOWN} more limits"] if len(found) > _SHOWN else []
        return [*self._conflicts(), *([told] if during else []), *lines, *more]

    def _conflicts(self) -> list[str]:
        if not self._settled:
            return []
        counts = " and ".join(f"{ticks} ticks {status}" for status, ticks in self._settled.items())
        return [f"{counts}, first {self._conflict}"]


def _words(moves: tuple[Transition, ...]) -> str:
    begin, end = min(move.begin for move in moves), max(move.end for move in moves)
    return f"{' and '.join(f'{move.task} {move.what}' for move in moves)} ({begin:g} to {end:g} s)"
