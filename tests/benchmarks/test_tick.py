"""Ticks beside peers, and beside an older commit."""

from argparse import Namespace
from typing import cast

import numpy as np
import pytest
from against import BAR, Pass, Worker, compare, table
from cases import NAMES, benchmark_case
from checkout import ROOT, full_name, subject
from tick import Ours, interleave
from worker import Ticks


@pytest.mark.parametrize("name", ["W1", "W1v", "W1s", "W1x", "W1xs"])
def test_a_case_is_proven_on_its_first_ticks(name: str) -> None:
    """Every answer of the Panda's cases is certified, and none comes from a fallback."""
    case = benchmark_case(name, 5)
    ours = Ours(case)
    for tick in range(5):
        ours.tick(tick)
        assert ours.last.kkt_met()
        assert ours.last.fallback is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["W2", "W2s", "W2h", "W2x", "W2xs", "W2xh"])
def test_a_case_of_talos_is_proven_on_its_first_ticks(name: str) -> None:
    """The same for TALOS, which is slow to load."""
    test_a_case_is_proven_on_its_first_ticks(name)


def test_letters_change_the_case_as_they_say() -> None:
    """s has strict levels, v lower velocity limits, x a target 1 m ahead."""
    plain, strict, slow, far = (benchmark_case(name, 2) for name in ("W1", "W1s", "W1v", "W1x"))
    assert len(plain.stack.levels) == 1
    assert len(strict.stack.levels) == 2
    assert slow.stack.limits[1] != plain.stack.limits[1]
    assert np.allclose(far.poses[0][:3, 3] - plain.poses[0][:3, 3], [1.0, 0.0, 0.0])


def test_contestants_take_turns() -> None:
    """Each contestant is timed at every tick, block by block."""
    ours = [Ours(benchmark_case("W1", 6)) for _ in range(2)]
    times = interleave(ours, 6, 4)
    assert [len(taken) for taken in times] == [6, 6]
    assert all((taken > 0.0).all() for taken in times)


class Stub:
    """A worker whose ticks take a given time."""

    def __init__(self, microseconds: float) -> None:
        self.microseconds, self.asked = microseconds, []

    def ask(self, line: str) -> dict[str, object] | None:
        """Answer as `worker.py` does."""
        self.asked.append(line)
        what, *numbers = line.split()
        if what == "case":
            return None
        count = int(numbers[1]) - int(numbers[0])
        return {"times": [self.microseconds] * count, "fallbacks": 1, "searches": 2}


def test_the_ratio_is_new_over_old_and_fallbacks_are_counted() -> None:
    """Blocks alternate, and the medians and counts are those of the workers."""
    old, new = Stub(20.0), Stub(10.0)
    done = compare(cast("Worker", old), cast("Worker", new), "W1", 1000)
    assert done.ratio == 0.5
    assert done.fallbacks == (10, 10)
    assert done.searches == (20, 20)
    assert old.asked[:3] == ["case W1 1000", "block 0 100", "block 100 200"]
    assert len(done.old) == 5  # the first 500 ticks do not count


def test_planted_fault_a_slower_case_is_marked() -> None:
    """The table marks a case above the bar, and no other."""
    old = np.array([10.0, 20.0])
    fine, slow = Pass(old, old, (0, 0), (0, 0)), Pass(old, BAR * old + 0.1, (0, 0), (0, 0))
    lines = table({"W1": [fine, fine, slow], "W2": [slow, slow, fine]}, "old").splitlines()
    assert "slower" not in lines[2]
    assert "slower" in lines[3]


def test_the_worker_counts_the_search() -> None:
    """Ticks of a case within reach are all of the fast path; times and counts are complete."""
    done = Ticks(subject(ROOT, "W1", 5)).block(0, 5)
    assert len(cast("list[float]", done["times"])) == 5
    assert done["fallbacks"] == done["searches"] == 0


def test_scenarios_and_cases_are_subjects() -> None:
    """A scenario brings its own number of ticks and its time; a case is always at time 0."""
    of = subject(ROOT, "planar_circle")
    assert of.aim(3) == 3 * of.dt
    assert of.ticks > 100
    assert subject(ROOT, "planar_circle", 7).ticks == 7
    assert subject(ROOT, "W1", 4).aim(3) == 0.0


def test_an_unknown_commit_is_refused() -> None:
    """The message says which commit is missing."""
    with pytest.raises(SystemExit, match="no commit nowhere"):
        full_name("nowhere")


def test_arguments_of_peers_are_optional() -> None:
    """Without interpreters for them, only this library runs (and pink, where it is installed)."""
    from tick import rows

    arguments = Namespace(ticks=4, warm=1, block=2, resolver=["active-set", "hqp/daqp"], clock="cpu")
    arguments.peers = arguments.with_own = None
    found = {name: inside for name, taken, inside in rows("W1s", arguments) if len(taken) == 3}
    assert next(iter(found)) == "taskopt active-set"
    assert not found["taskopt active-set"].any()
    assert (found["taskopt hqp/daqp"] > 0.0).all()  # the time inside DAQP
    assert "W1" in NAMES
