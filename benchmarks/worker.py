"""Runs blocks of ticks of one checkout, when told to; the other side of `against.py`.

Usage: python worker.py CHECKOUT, with PYTHONPATH set to that checkout. A line on standard input is
"case NAME TICKS", which begins a case anew, or "block FIRST STOP", which runs some of its ticks. The answer
to each is one line of JSON.
"""

import gc
import json
import sys
from pathlib import Path
from time import thread_time_ns

from checkout import Subject, subject

from taskopt import Controller


class Ticks:
    """The closed loop of one subject.

    Args:
        of: The subject.
    """

    def __init__(self, of: Subject) -> None:
        self._of, self._q = of, of.q0.copy()
        self._control = Controller(of.robot, of.stack, "active-set", of.dt)
        self._control.start(self._q)

    def block(self, first: int, stop: int) -> dict[str, object]:
        """Run ticks.

        Args:
            first: The first tick.
            stop: The tick after the last.

        Returns:
            Time of this thread for each tick [µs], the number of ticks that another method had to answer,
            and the number of ticks that needed the search.
        """
        times, fallbacks, searches = [], 0, 0
        of, step, integrate = self._of, self._control.step, self._of.robot.integrate
        for tick in range(first, stop):
            begin = thread_time_ns()
            time = of.aim(tick)
            resolution = step(self._q, time)
            self._q = integrate(self._q, resolution.v, of.dt)
            times.append((thread_time_ns() - begin) * 1e-3)
            searches += resolution.iterations > 0
            # Until 8dbc6b4 a note was the only trace of a fallback.
            fallbacks += bool(resolution.fallback if hasattr(resolution, "fallback") else resolution.notes)
        return {"times": times, "fallbacks": fallbacks, "searches": searches}


def main() -> None:
    """Serve until standard input ends."""
    folder = Path(sys.argv[1])
    ticks: Ticks | None = None
    gc.disable()
    for line in sys.stdin:
        what, *words = line.split()
        answer: object = None
        if what == "case":
            ticks = Ticks(subject(folder, words[0], int(words[1])))
            gc.collect()  # not after each block, which would then begin with a cold cache
        elif ticks is not None:
            answer = ticks.block(int(words[0]), int(words[1]))
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
