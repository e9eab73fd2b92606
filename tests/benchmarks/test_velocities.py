"""The acceptance of the velocities: a seeded sample of it, and its verdict."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases import NAMES
from checkout import ROOT, subject
from first_run import drive
from recorder import record, replay, response
from velocities import CHANGED, SAMPLE, Outcome, examine, examine_record, is_saturated, write_declaration

from taskopt import JointAccelerationLimit
from taskopt.arrays import Array

FINE = Outcome("W1x", 10, 1e-13, 1e-13, 0, 0, 1e-12, 1e-12, 10)


def sampled() -> dict[str, tuple[Array, Array, float]]:
    """Postures, velocities and response to one last bit of the old commit, by subject."""
    with np.load(SAMPLE) as kept:
        names = sorted({key.partition("/")[0] for key in kept})
        return {
            name: (kept[f"{name}/q"], kept[f"{name}/v"], float(kept[f"{name}/response"])) for name in names
        }


@pytest.mark.slow
@pytest.mark.parametrize("name", sampled())
def test_velocities_are_those_of_the_old_commit(name: str) -> None:
    """At the recorded postures v differs by at most 10 times what one last bit of q changes."""
    outcome = examine_record(name, *sampled()[name])
    assert outcome.accepted, str(outcome)
    assert outcome.fallbacks == 0


def test_velocities_of_a_short_run_are_reproduced() -> None:
    """A quick one: record and replay by the same code agree to the last bit, and planted faults do not."""
    of = subject(ROOT, "W1s", 10)
    recorded = record(of)
    assert np.array_equal(replay(of, recorded.q, recorded.v), recorded.v)
    largest = float(response(of, recorded).max())
    assert 0.0 < largest < 1e-9
    assert examine(of, recorded.q, recorded.v, largest).accepted
    assert not examine(of, recorded.q, recorded.v + 1e-6, largest).accepted


@pytest.mark.parametrize(
    "fault",
    [{"change": 1e-11}, {"unmet": 1}, {"apart": 1e-8, "apart_in_rows": 1e-8}],
    ids=lambda fault: next(iter(fault)),
)
def test_planted_faults_are_not_accepted(fault: dict[str, float]) -> None:
    """A changed velocity, a missing proof and a distance to the cascade each end the acceptance."""
    assert FINE.accepted
    assert not replace(FINE, **fault).accepted  # pyright: ignore[reportArgumentType]


def test_only_saturated_cases_are_compared_with_the_cascade() -> None:
    """The letter x stands for saturated."""
    assert [name for name in (*NAMES, "damped") if is_saturated(name)] == [
        "W1x",
        "W1xs",
        "W2x",
        "W2xs",
        "W2xh",
    ]
    assert replace(FINE, unmet=1, apart=np.nan).accepted


@pytest.mark.parametrize("name", CHANGED)
def test_a_scenario_that_changed_is_compared_as_it_was(name: str, tmp_path: Path) -> None:
    """The declaration before the change has no limit on accelerations, and the one of today has."""
    if not (ROOT / ".git").exists():
        pytest.skip("the old declaration is in the history of the repository")
    write_declaration(name, tmp_path)
    before, now = subject(tmp_path, name), subject(ROOT, name)
    kept = [any(isinstance(x, JointAccelerationLimit) for x in of.stack.limits) for of in (before, now)]
    assert kept == [False, True]
    assert np.array_equal(before.q0, now.q0)


def test_a_recording_ends_at_the_first_conflict() -> None:
    """`planar_conflict` is recorded up to the tick before its hard limits contradict each other."""
    of = subject(ROOT, "planar_conflict")
    assert 0 < len(record(of).q) < of.ticks


def test_first_run_needs_a_tick_with_the_search() -> None:
    """Too few ticks would not compile the search, and the figure would be wrong."""
    drive(ROOT, 1)
    with pytest.raises(SystemExit, match="no tick needed the search"):
        drive(ROOT, 2)
