"""A pytest plugin that ends a test as soon as it has taken TEST_TIME_LIMIT seconds of CPU.

`mutants.py` runs tests without compilation. While it finds out which test executes which line, a test that
takes too long is skipped, and so stays out of the map; the tests of a mutant fail instead, since a fault that
makes the search run for ever has been noticed. The clock is that of the CPU, so that the map is the same on a
busy machine. Works by a signal, hence on Unix only.
"""

import os
import signal
from collections.abc import Iterator
from types import FrameType

import pytest

LIMIT = "TEST_TIME_LIMIT"  # environment variable: seconds
ACTION = "TEST_TOO_LONG"  # environment variable: "skip" or "fail"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:  # noqa: ARG001 (pytest names it)
    """Set a timer for the call of one test, and end the test when it rings.

    Args:
        item: The test.
    """
    limit, end = float(os.environ[LIMIT]), pytest.skip if os.environ[ACTION] == "skip" else pytest.fail

    def ring(_signal: int, _frame: FrameType | None) -> None:
        end(f"takes more than {limit:g} s without compilation")

    former = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, limit, 1.0)  # again each second, where a first one is swallowed
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, former)
