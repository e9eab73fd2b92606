"""Gathering: every step arrives once, in order, soon, and also when a run fails."""

import time

import pytest

import taskopt.recording.recorder as recorder
from taskopt.recording.recorder import BufferedRecorder, record


class Basket:
    """A sink that keeps what it is given."""

    def __init__(self) -> None:
        self.events: list[str] = []
        self.batches: list = []
        self.at: list[float] = []

    def open(self, info) -> None:
        self.events.append("open")

    def take(self, batch) -> None:
        self.batches.append(batch)
        self.at.append(time.monotonic())

    def close(self, status) -> None:
        self.events.append(status)


class Bad(Basket):
    """A sink that cannot open."""

    def open(self, info) -> None:
        raise OSError("no space left")


def test_every_step_arrives_once_and_in_order(info, steps):
    """The batches of a resolver, put together, are its steps."""
    basket = Basket()
    with BufferedRecorder(info, [basket]) as log:
        for ticks in zip(*steps.values(), strict=True):
            for step in ticks:
                log.write(step)
    assert basket.events == ["open", "finished"]
    for name, own in steps.items():
        got = [step for batch in basket.batches if batch.resolver == name for step in batch.steps]
        assert got == own


def test_a_full_memory_is_handed_over_without_waiting(info, steps, monkeypatch):
    """No more than the capacity is ever kept."""
    monkeypatch.setattr(recorder, "_CAPACITY", 20)
    basket = Basket()
    with BufferedRecorder(info, [basket]) as log:
        for step in steps["pinv"]:
            log.write(step)
    assert max(len(batch.steps) for batch in basket.batches) <= 20


@pytest.mark.slow
def test_a_long_tick_does_not_keep_what_came_before_it(info, steps, monkeypatch):
    """While nothing is written, the watchdog hands over what waits, well within a second."""
    monkeypatch.setattr(recorder, "PERIOD", 60.0)
    basket = Basket()
    with BufferedRecorder(info, [basket]) as log:
        log.write(steps["pinv"][0])
        begin = time.monotonic()
        while not basket.at and time.monotonic() - begin < 3.0:
            time.sleep(0.01)
        assert basket.at
        assert basket.at[0] - begin < 1.0


def test_a_run_that_fails_is_closed_as_interrupted(info, steps):
    """The error passes through, and what was written before it is there."""
    basket = Basket()

    def failing():
        yield from steps["pinv"][:3]
        raise RuntimeError("a solver crashed")

    with pytest.raises(RuntimeError, match="a solver crashed"):
        list(record(failing(), BufferedRecorder(info, [basket])))
    assert basket.events == ["open", "interrupted"]
    assert sum(len(batch.steps) for batch in basket.batches) == 3


def test_a_consumer_that_leaves_early_closes_the_log(info, steps):
    """Closing the generator closes the recorders, as interrupted."""
    basket = Basket()
    passed = record(steps["pinv"], BufferedRecorder(info, [basket]))
    next(passed)
    passed.close()
    assert basket.events == ["open", "interrupted"]


def test_a_sink_that_cannot_open_closes_those_before_it(info):
    """No sink is left open, and the error is the sink's own."""
    basket = Basket()
    with pytest.raises(OSError, match="no space left"), BufferedRecorder(info, [basket, Bad()]):
        pass
    assert basket.events == ["open", "interrupted"]


class FullDisk(Basket):
    """A sink that fails at its first batch, and takes all others."""

    def take(self, batch) -> None:
        self.events.append("take")
        if self.events.count("take") == 1:
            raise OSError("disk full")


@pytest.fixture
def impatient(monkeypatch):
    """A watchdog that flushes at once, while `write` leaves it to do so."""
    monkeypatch.setattr(recorder, "PERIOD", 60.0)
    monkeypatch.setattr(recorder, "_PATIENCE", 0.0)


def pauses(log, first, *later, error=None):
    """Yield a step, wait until the watchdog has failed to write it, then yield others or raise an error."""
    yield first
    log._watchdog.join(timeout=10.0)
    assert not log._watchdog.is_alive()
    yield from later
    if error is not None:
        raise error


def test_a_failure_of_the_watchdog_is_raised_by_the_next_write(info, steps, impatient):
    """An error in the background is not lost, and is raised once."""
    log = BufferedRecorder(info, [disk := FullDisk()])
    with pytest.raises(OSError, match="disk full") as caught:
        list(record(pauses(log, *steps["pinv"][:2]), log))
    assert disk.events[-1] == "interrupted"
    assert not hasattr(caught.value, "__notes__")


def test_a_failure_of_the_watchdog_after_the_last_write_is_raised_at_the_end(info, steps, impatient):
    """A log that lacks steps is not closed as finished, even if nothing is written after the failure."""
    log = BufferedRecorder(info, [disk := FullDisk()])
    with pytest.raises(OSError, match="disk full"):
        list(record(pauses(log, steps["pinv"][0]), log))
    assert disk.events[-1] == "interrupted"


def test_an_error_of_the_run_is_told_that_the_log_lacks_steps(info, steps, impatient):
    """The error that ended the run passes through, with a note about the failure of the recorder."""
    log = BufferedRecorder(info, [FullDisk()])
    crash = RuntimeError("a solver crashed")
    with pytest.raises(RuntimeError, match="a solver crashed") as caught:
        list(record(pauses(log, steps["pinv"][0], error=crash), log))
    assert caught.value.__notes__ == ["the log lacks steps, since a recorder failed: disk full"]


def test_sinks_are_closed_as_interrupted_if_the_last_steps_cannot_be_written(info, steps):
    """A disk that becomes full with the last batch does not leave a manifest that says "finished"."""

    class Full(Basket):
        """A sink that takes nothing."""

        def take(self, batch) -> None:
            raise OSError("no space left")

    before, after = Basket(), Basket()
    with (
        pytest.raises(OSError, match="no space left"),
        BufferedRecorder(info, [before, Full(), after]) as log,
    ):
        log.write(steps["pinv"][0])
    assert [before.events, after.events] == [["open", "interrupted"]] * 2
