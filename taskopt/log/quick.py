"""The compiled copy of an ordinary tick into the ring, which is what a control loop pays for its log.

A tick is ordinary if it was resolved in one compiled call, claims its optimum, and needed no damping, no
fallback and no words. All others, which are rare, are copied by `RawLog.add` into slots of the same form. A
statement of Python costs a loop that sleeps between its ticks several times what it costs one that does not,
so that here Python reads a few attributes and calls one function, which finds everything else by itself:

    ring      the shared memory, with its counters
    plan      the form of a slot, and where each of its parts comes from, as integers
    numbers   all floats of the plan, among them most errors and poses, and bounds that never change
    kept      what is elsewhere: the velocity before the tick if it was given, errors and poses of tasks that
              Python fills, and the memory that the tick began with

Each array that Python passes costs as much as copying some hundred numbers, hence so few of them.
"""

from itertools import pairwise
from time import perf_counter_ns

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import borrowed
from taskopt.log.of_plan import PlanTicks
from taskopt.log.raw import STATUS_NUMBERS, RawLog
from taskopt.log.ring import Counter
from taskopt.log.slots import NUMBERS, offsets_of, slot_size

_SOLVED = Status.SOLVED  # a look-up in the Enum on every tick would cost as much as a short call
_FIELDS = ("numbers", "times", "q", "x", "answer", "state", "memory")
_TICK, _CLOCK, _ITERATIONS = NUMBERS.index("tick"), NUMBERS.index("clock"), NUMBERS.index("iterations")
_UNDAMPED = NUMBERS.index("undamped_iterations")
_ALTERNATES, _GIVEN = NUMBERS.index("alternates"), NUMBERS.index("given")
_WRITTEN, _CONSUMED = int(Counter.WRITTEN), int(Counter.CONSUMED)
_FAILED, _CLOSED = int(Counter.FAILED), int(Counter.CLOSED)
_COUNTERS, _NUMBERS, _FORM = len(Counter), len(NUMBERS), 4 + len(_FIELDS)
_FLOAT = 8  # bytes


class QuickCopy:
    """Copies ordinary ticks of a loop that resolves them in one compiled call.

    Args:
        log: The log.
        ticks: The parts of a tick that its plan knows.
        history: The memory of the compiled call, (3, n + M).

    Attributes:
        memory: Copy of that memory from before the present tick, see `begin`.
    """

    def __init__(self, log: RawLog, ticks: PlanTicks, history: StateArray) -> None:
        self._plan, self._sent, self._begin = ticks.plan, log.sent, log.begin
        ring, n, numbers = log.ring, ticks.plan.layout.n, ticks.plan.tick[1]
        offsets = offsets_of(ring.form)
        pieces, loose, size = [1, 0, n, offsets["v_before"]], [], n
        for part in ticks.parts():
            array, target = part.read(), offsets[part.field] + _FLOAT * part.start
            if np.may_share_memory(array, numbers):
                for place, count, into in _runs(numbers, array):
                    pieces += [0, place, count, target + _FLOAT * into]
            else:
                loose.append((part.read, slice(size, size + array.size), array.shape))
                pieces += [1, size, array.size, target]
                size += array.size
        kept = np.zeros(size + -(-history.nbytes // _FLOAT))
        self.memory = kept[size:].view(np.int8)[: history.size].reshape(history.shape)
        self._from, self._into = history.data.cast("B"), self.memory.data.cast("B")
        self._before = kept[:n]
        self._loose = [(kept[place].reshape(shape), read) for read, place, shape in loose]
        form = [ring.start, ring.slots, slot_size(ring.form), size, *(offsets[name] for name in _FIELDS)]
        plan = np.array([*form, *_usual_numbers(), *pieces])
        self._arguments = ring.memory, plan, numbers, ticks.plan.tick[2], kept
        compile_copy()

    def begin(self) -> StateArray:
        """Copy the memory that the next tick begins with, and return the copy, (3, n + M)."""
        self._into[:] = self._from
        return self.memory

    def add(self, t: float, v_before: Array, answer: Resolution) -> bool:
        """Copy a tick into the ring.

        Args:
            t: Time [s].
            v_before: Velocity before the tick, (nv,).
            answer: What was sent.

        Returns:
            False if the tick is not an ordinary one, if there is no free slot, or if the log is closed or has
            failed; nothing was copied then.
        """
        plan = self._plan
        if answer.status is not _SOLVED or answer.is_damped or answer.source is not plan.hierarchy:
            return False
        if answer.notes or answer.fallback:
            return False
        given = v_before is not self._sent.get(0)
        if given:
            self._before[:] = v_before
        for place, read in self._loose:
            place[...] = read()
        clock = perf_counter_ns() - self._begin
        numbers = t, plan.dt, clock, answer.iterations, given
        done = copy_tick(self._arguments, answer.answer, answer.state, *numbers)
        if done:
            self._sent[0] = answer.x
        return done


def compile_copy() -> None:
    """Compile the copy, so that the first tick does not have to wait for the compiler."""
    ring, none = np.zeros(_FLOAT * len(Counter), dtype=np.uint8), np.zeros(0)
    ring.view(np.int64)[_CLOSED] = 1
    fixed = ring, np.zeros(_FORM, dtype=np.int64), none, none, none
    copy_tick(fixed, none, np.zeros(0, dtype=np.int8), 0.0, 0.0, 0, 0, False)


def _usual_numbers() -> list[int]:
    """Return the integers of a slot as they are at ordinary ticks; the copy writes some of them anew."""
    usual = dict.fromkeys(NUMBERS, 0)
    usual["status"] = usual["undamped_status"] = STATUS_NUMBERS[_SOLVED]
    usual["remembers"] = usual["has_previous"] = 1
    return list(usual.values())


def _runs(numbers: Array, array: Array) -> list[tuple[int, int, int]]:
    """Return the runs of consecutive numbers that a view consists of: place, length, place in the view."""
    first = (array.ctypes.data - numbers.ctypes.data) // _FLOAT
    counted = np.arange(numbers.size)[first:]
    places = np.lib.stride_tricks.as_strided(counted, array.shape, array.strides).ravel()
    starts = [0, *(np.flatnonzero(np.diff(places) != 1) + 1).tolist(), places.size]
    return [(int(places[start]), stop - start, start) for start, stop in pairwise(starts)]


@kernel_apart
def copy_tick(fixed, answer, state, t, dt, clock, iterations, given):
    """Copy a tick into the next slot, and count it.

    Args:
        fixed: Ring, plan, numbers, q and kept, see above.
        answer: The flat answer.
        state: Its active set.
        t: Time [s].
        dt: Time until the next tick [s].
        clock: Time since the log was opened [ns].
        iterations: Iterations of the resolver.
        given: Whether kept has the velocity before the tick.

    Returns:
        False if no slot is free, or if nobody would write it.
    """
    ring, plan, numbers, q, kept = fixed
    ring, plan = borrowed(ring), borrowed(plan)
    counters = ring[: _COUNTERS * _FLOAT].view(np.int64)
    first, slots, length, memory = plan[0], plan[1], plan[2], plan[3]
    of_numbers, of_times, of_q, of_x, of_answer, of_state, of_memory = plan[4:_FORM]
    written = counters[_WRITTEN]
    if counters[_FAILED] != 0 or counters[_CLOSED] != 0 or written - counters[_CONSUMED] >= slots:
        return False
    start = first + (written % slots) * length
    slot = ring[start : start + length]
    floats, small, kept = slot.view(np.float64), slot.view(np.int8), borrowed(kept)
    own = slot[of_numbers : of_numbers + _NUMBERS * _FLOAT].view(np.int64)
    for i in range(_NUMBERS):
        own[i] = plan[_FORM + i]
    history, state = kept[memory:].view(np.int8), borrowed(state)
    own[_TICK], own[_CLOCK], own[_GIVEN] = written, clock, given
    own[_ITERATIONS], own[_UNDAMPED], own[_ALTERNATES] = iterations, iterations, history[2 * state.size] != 0
    times = floats[of_times // _FLOAT :]
    times[0], times[1], times[2], times[3] = t, dt, 0.0, 0.0
    q, answer = borrowed(q), borrowed(answer)
    _copy(q, floats, of_q)
    _copy(answer, floats, of_answer)
    _copy(answer[: (of_answer - of_x) // _FLOAT], floats, of_x)
    for i in range(state.size):
        small[of_state + i] = state[i]
    for i in range(3 * state.size):
        small[of_memory + i] = history[i]
    numbers = borrowed(numbers)
    for i in range(_FORM + _NUMBERS, plan.size, 4):
        source = kept if plan[i] else numbers
        _copy(source[plan[i + 1] : plan[i + 1] + plan[i + 2]], floats, plan[i + 3])
    counters[_WRITTEN] = written + 1
    return True


@kernel
def _copy(source, target, place):
    """Copy numbers to a place in bytes."""
    begin = place // _FLOAT
    for i in range(source.size):
        target[begin + i] = source[i]
