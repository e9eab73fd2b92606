"""The compiled copy of an ordinary tick into the ring, which is what a control loop pays for its log.

A tick is ordinary if it was resolved in one compiled call, claims its optimum, and needed no damping, no
fallback and no words. All others, which are rare, are copied by `RawLog.add` into slots of the same form. A
statement of Python costs a loop that sleeps between its ticks several times what it costs one that does not,
so that here Python reads a few attributes and calls one function. It finds the rest in a table of arrays that
stay where they are: the ring, the form of a slot, and whatever tasks and plan keep of their tick.
"""

from collections.abc import Sequence
from time import perf_counter_ns

import numpy as np

from taskopt.arrays import Array, StateArray
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.jit import kernel, kernel_apart
from taskopt.jit.borrowed import ArrayTable, borrowed, floats_in, integers_in, states_in
from taskopt.kinematics.changes import Applied
from taskopt.log.of_plan import PlanTicks
from taskopt.log.raw import STATUS_NUMBERS, RawLog
from taskopt.log.ring import Counter
from taskopt.log.slots import NUMBERS, offsets_of, slot_size
from taskopt.log.words import words

_SOLVED = Status.SOLVED  # a look-up in the Enum on every tick would cost as much as a short call
_FIELDS = ("numbers", "times", "q", "x", "answer", "state", "memory")
_TICK, _CLOCK, _ITERATIONS = NUMBERS.index("tick"), NUMBERS.index("clock"), NUMBERS.index("iterations")
_UNDAMPED = NUMBERS.index("undamped_iterations")
_ALTERNATES, _GIVEN = NUMBERS.index("alternates"), NUMBERS.index("given")
_TEXT = NUMBERS.index("text")
_WRITTEN, _CONSUMED = int(Counter.WRITTEN), int(Counter.CONSUMED)
_FAILED, _CLOSED = int(Counter.FAILED), int(Counter.CLOSED)
_NUMBERS, _FORM = len(NUMBERS), 3 + len(_FIELDS)
_FLOAT = 8  # bytes
# Numbers of the arrays in the table: the counters, and the ring as floats and as bytes; the form of a slot;
# posture; memory of the compiled call, and a copy from before the tick; whatever has a place in a slot.
COUNTERS, RING, BYTES, FORM, POSTURE, HISTORY, MEMORY, PARTS = range(8)


class QuickCopy:
    """Copies ordinary ticks of a loop that resolves them in one compiled call.

    Args:
        log: The log.
        ticks: The parts of a tick that its plan knows.
        history: The memory of the compiled call, (3, n + M).

    Attributes:
        memory: Copy of that memory from before the present tick. A copied tick renews it for the next one;
            if anything else has changed the history, `begin` does.
    """

    def __init__(self, log: RawLog, ticks: PlanTicks, history: StateArray) -> None:
        self._plan, self._sent, self._begin = ticks.plan, log.sent, log.begin
        ring, n = log.ring, ticks.plan.layout.n
        self._ring = ring
        offsets = offsets_of(ring.form)
        self._before, self._history, self.memory = np.zeros(n), history, history.copy()
        pieces, targets, self._held = [self._before], [offsets["v_before"]], []
        for part in ticks.parts():
            if part.owner is not None and not np.may_share_memory(part.numbers, ticks.plan.tick[1]):
                self._held.append((part.owner, part.name, getattr(part.owner, part.name)))
            target = offsets[part.field] + _FLOAT * part.start
            for piece in _runs(part.numbers):
                pieces.append(piece)
                targets.append(target)
                target += piece.nbytes
        form = [ring.start, ring.slots, slot_size(ring.form), *(offsets[name] for name in _FIELDS)]
        memory, plan = ring.memory, np.array([*form, *_usual_numbers(), *targets])
        self._usual = plan[_FORM : _FORM + _NUMBERS]
        views = ring.counters, memory.view(np.float64), memory.view(np.int8)
        arrays = *views, plan, ticks.plan.tick[2], history, self.memory
        self._table = ArrayTable(*arrays, *pieces)
        compile_copy()

    def begin(self) -> StateArray:
        """Copy the memory that the next tick begins with, and return the copy, (3, n + M)."""
        self.memory[:] = self._history
        return self.memory

    def add(self, t: float, v_before: Array, answer: Resolution, changes: Sequence[Applied] = ()) -> bool:
        """Copy a tick into the ring.

        Args:
            t: Time [s].
            v_before: Velocity before the tick, (nv,).
            answer: What was sent.
            changes: Changes of parameters that the tick has applied.

        Returns:
            False if the tick is not an ordinary one, if a task has another array than before, if there is no
            free slot, or if the log is closed or has failed; nothing was copied then.
        """
        plan = self._plan
        if answer.status is not _SOLVED or answer.is_damped or answer.source is not plan.hierarchy:
            return False
        if answer.notes or answer.fallback:
            return False
        for owner, name, array in self._held:
            if getattr(owner, name) is not array:
                return False
        given = v_before is not self._sent.get(0)
        if given:
            self._before[:] = v_before
        if changes and not self._say(words(changes=changes)):
            return False
        numbers = t, plan.dt, perf_counter_ns() - self._begin, answer.iterations, given
        done = copy_tick(self._table.handle, answer.answer, answer.state, *numbers)
        if changes:
            self._usual[_TEXT] = 0
        if done:
            self._sent[0] = answer.x
        return done

    def _say(self, text: bytes) -> bool:
        """Write words into the next slot, for the next tick that is copied; return False if it is full."""
        ring = self._ring
        written = int(ring.counters[Counter.WRITTEN])
        if written - ring.counters[Counter.CONSUMED] >= ring.slots:
            return False
        ring.fields["text"][written % ring.slots, : len(text)] = np.frombuffer(text, dtype=np.uint8)
        self._usual[_TEXT] = len(text)
        return True


def compile_copy() -> None:
    """Compile the copy, so that the first tick does not have to wait for the compiler."""
    counters, none = np.zeros(len(Counter), dtype=np.int64), np.zeros(0)
    counters[_CLOSED] = 1
    state = np.zeros(0, dtype=np.int8)
    table = ArrayTable(counters, none, state, np.zeros(_FORM, dtype=np.int64))
    copy_tick(table.handle, none, state, 0.0, 0.0, 0, 0, False)


def _usual_numbers() -> list[int]:
    """Return the integers of a slot as they are at ordinary ticks; the copy writes some of them anew."""
    usual = dict.fromkeys(NUMBERS, 0)
    usual["status"] = usual["undamped_status"] = STATUS_NUMBERS[_SOLVED]
    usual["remembers"] = usual["has_previous"] = 1
    return list(usual.values())


def _runs(array: Array) -> list[Array]:
    """Return the runs of consecutive numbers in memory of which an array consists, as views, in its order."""
    if array.flags.c_contiguous:
        return [array]
    parts = [array[i] if array.ndim > 1 else array[i : i + 1] for i in range(len(array))]
    return [run for part in parts for run in _runs(part)]


@kernel_apart
def copy_tick(table, answer, state, t, dt, clock, iterations, given):
    """Copy a tick into the next slot, and count it.

    Args:
        table: Handle of the arrays, see above.
        answer: The flat answer.
        state: Its active set.
        t: Time [s].
        dt: Time until the next tick [s].
        clock: Time since the log was opened [ns].
        iterations: Iterations of the resolver.
        given: Whether the first of the parts has the velocity before the tick.

    Returns:
        False if no slot is free, or if nobody would write it.
    """
    counters, form = integers_in(table, COUNTERS), integers_in(table, FORM)
    first, slots, length = form[0], form[1], form[2]
    of_numbers, of_times, of_q, of_x, of_answer, of_state, of_memory = form[3:_FORM]
    written = counters[_WRITTEN]
    if counters[_FAILED] != 0 or counters[_CLOSED] != 0 or written - counters[_CONSUMED] >= slots:
        return False
    start = first + (written % slots) * length
    slot = floats_in(table, RING)[start // _FLOAT : (start + length) // _FLOAT]
    small = states_in(table, BYTES)[start : start + length]
    own = slot[of_numbers // _FLOAT :].view(np.int64)
    for i in range(_NUMBERS):
        own[i] = form[_FORM + i]
    answer, state = borrowed(answer), borrowed(state)
    own[_TICK], own[_CLOCK], own[_GIVEN] = written, clock, given
    memory, history = states_in(table, MEMORY), states_in(table, HISTORY)
    own[_ITERATIONS], own[_UNDAMPED], own[_ALTERNATES] = iterations, iterations, memory[2 * state.size] != 0
    times = slot[of_times // _FLOAT :]
    times[0], times[1], times[2], times[3] = t, dt, 0.0, 0.0
    _copy(floats_in(table, POSTURE), slot, of_q)
    _copy(answer, slot, of_answer)
    _copy(answer[: (of_answer - of_x) // _FLOAT], slot, of_x)
    for i in range(state.size):
        small[of_state + i] = state[i]
    for i in range(memory.size):
        small[of_memory + i], memory[i] = memory[i], history[i]
    targets = form[_FORM + _NUMBERS :]
    for i in range(targets.size):
        _copy(floats_in(table, PARTS + i), slot, targets[i])
    counters[_WRITTEN] = written + 1
    return True


@kernel
def _copy(source, target, place):
    """Copy numbers to a place in bytes."""
    begin = place // _FLOAT
    for i in range(source.size):
        target[begin + i] = source[i]
