"""The ring of slots through which a control loop passes its ticks to the process that writes them.

The loop and the writer share the memory and nothing else: no lock, and in particular no interpreter lock. The
loop fills the slot `written` modulo the number of slots and then counts `written` up; the writer reads up to
that count and then counts `consumed` up. The writer takes only what it has seen counted at its look before,
some milliseconds ago, since a processor may show another one the count before the content of a slot.
"""

import mmap
import os
from collections.abc import Sequence
from enum import IntEnum
from tempfile import TemporaryFile

import numpy as np

from taskopt.log.slots import Field, slot_size, view_fields

BYTES = 1 << 25  # of the slots: a second at least of a robot with two arms at 1 kHz
LEAST_SLOTS = 64
_HEAD = 4096  # bytes before the slots: the counters, and a message
_MESSAGE = 1024  # where the message begins


class Counter(IntEnum):
    """The counters at the beginning of a ring."""

    WRITTEN = 0  # slots that the loop has filled
    CONSUMED = 1  # slots that the writer has copied
    FAILED = 2  # 1 when the writer has given up; the message says why
    READY = 3  # 1 when the writer has opened the file
    WAITS = 4  # ticks at which the loop had to wait for a free slot
    WAITED = 5  # time that it waited [ns]
    CLOSED = 6  # an `End` when the loop has written its last slot, else 0
    MESSAGE = 7  # length of the message in bytes


class End(IntEnum):
    """How a log ended."""

    CUT_OFF = 0  # the process of the loop ended without closing the log
    FINISHED = 1
    INTERRUPTED = 2  # by an error or a signal, which the message names


class Ring:
    """The shared memory of a loop and its writer.

    Args:
        fields: Fields of a slot.
        file: Descriptor of the memory that another process made; None to make a new one.

    Attributes:
        file: Descriptor of the memory, which a child process may inherit.
        slots: Number of slots.
        counters: The counters, see `Counter`.
        memory: All of the memory, in bytes.
        start: The first byte of the slots.
        form: Fields of a slot.
        fields: Array (slots, size) of each field, by its name.
    """

    def __init__(self, fields: Sequence[Field], file: int | None = None) -> None:
        length = slot_size(fields)
        slots = max(LEAST_SLOTS, BYTES // length)
        self.file = _new_memory(_HEAD + slots * length) if file is None else file
        size = os.fstat(self.file).st_size
        self.slots = (size - _HEAD) // length
        populate = getattr(mmap, "MAP_POPULATE", 0)  # no tick waits for the first touch of a page
        self._map = mmap.mmap(self.file, size, flags=mmap.MAP_SHARED | populate)
        memory = self.memory = np.frombuffer(self._map, dtype=np.uint8)
        self.counters = memory[: 8 * len(Counter)].view(np.int64)
        self._message = memory[_MESSAGE:_HEAD]
        self.form, self.start = tuple(fields), _HEAD
        self.fields = view_fields(memory[_HEAD:], fields, self.slots)

    @property
    def message(self) -> str:
        """What the writer says about its failure, or the loop about its end."""
        length = int(self.counters[Counter.MESSAGE])
        return self._message[:length].tobytes().decode("utf-8", "replace")

    def tell(self, counter: Counter, value: int, message: str) -> None:
        """Leave a message, then set a counter.

        Args:
            counter: The counter that says that there is a message.
            value: Its value.
            message: The message.
        """
        text = message.encode()[: self._message.size]
        self._message[: len(text)] = np.frombuffer(text, dtype=np.uint8)
        self.counters[Counter.MESSAGE] = len(text)
        self.counters[counter] = value


def _new_memory(size: int) -> int:
    """Return the descriptor of new memory that no file system shows, and that ends with its last user."""
    if hasattr(os, "memfd_create"):
        file = os.memfd_create("taskopt-log")
    else:
        with TemporaryFile() as made:
            file = os.dup(made.fileno())
    os.ftruncate(file, size)
    return file
