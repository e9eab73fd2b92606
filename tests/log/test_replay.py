"""Runs are solved again from data alone, and what is derived from a log does not depend on its batches."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from taskopt import Controller, Log, RestDamping, load_scenario, open_log, run, solve_again
from taskopt.log import story
from taskopt.log.batches import END
from taskopt.log.claims import claims
from taskopt.log.report import html, markdown
from taskopt.log.spans import spans
from taskopt.loop.scenario import scenario_files
from tests.log.conftest import ARM, DT, START, stack

RANDOM = np.random.default_rng(13)
TICKS = 1000  # random ones of each scenario
THOROUGH = (pytest.mark.slow, pytest.mark.thorough)
BATCHES = (pytest.param(1, marks=THOROUGH), pytest.param(40, marks=pytest.mark.slow), 600, 4000)


def logged_run(path: Path, folder: Path, resolver: str, duration: float) -> tuple[Log, np.ndarray]:
    """Log the run of a scenario's file; return the log, and what was sent."""
    scenario = load_scenario(path)
    scenario = replace(scenario, duration=min(scenario.duration, duration))
    sent = [step.x for step in run(scenario, resolver, judged=1, log=folder / "a.arrow")]
    return open_log(folder / "a.arrow"), np.array(sent)


@pytest.mark.parametrize("path", scenario_files()[::5], ids=lambda path: path.stem)
def test_ticks_of_some_scenarios_are_solved_again_to_the_last_bit(tmp_path, path):
    """The quick part: the beginning of every fifth scenario, tick by tick."""
    log, sent = logged_run(path, tmp_path, "active-set", 0.05)
    assert [solve_again(log.tick(k)).distance for k in range(len(log))] == [0.0] * len(sent)
    assert np.array_equal(log.array("x"), sent)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("path", scenario_files(), ids=lambda path: path.stem)
@pytest.mark.parametrize("resolver", ["active-set", "hqp/daqp"])
def test_a_thousand_ticks_of_every_scenario_are_solved_again_to_the_last_bit(tmp_path, path, resolver):
    """Random ticks in any order, of the whole run with `active-set`, of its first second with a cascade."""
    log, sent = logged_run(path, tmp_path, resolver, 60.0 if resolver == "active-set" else 1.0)
    assert np.array_equal(log.array("x"), sent)
    chosen = RANDOM.permutation(len(log))[:TICKS]
    assert len(chosen) == min(TICKS, len(sent))
    assert {k: again for k in chosen.tolist() if (again := solve_again(log.tick(k)).distance)} == {}


def batched(log: Log, path: Path, size: int) -> Log:
    """Write the rows of a log in batches of another size, with Arrow itself."""
    source = pa.ipc.open_file(log.path)
    rows = source.read_all().combine_chunks()
    end = source.get_batch_with_custom_metadata(source.num_record_batches - 1)[1]
    with pa.ipc.new_file(path, rows.schema) as file:
        for batch in rows.to_batches(max_chunksize=size):
            file.write_batch(batch)
        file.write_batch(pa.RecordBatch.from_pylist([], rows.schema), custom_metadata={END: end[END]})
    return open_log(path)


@pytest.fixture(scope="module")
def long(tmp_path_factory) -> Log:
    """The log of 4,100 ticks, in which limits come and go, and some ticks are damped."""
    path, q = tmp_path_factory.mktemp("long") / "a.arrow", START
    control = Controller(
        ARM, stack((2.0, 0.3, 0.0), damping=RestDamping(), acceleration=None), dt=DT, log=path
    )
    for k in range(4100):
        if k % 400 == 0:
            control.set({"hand.target": [2.0, 0.3, 0.0] if k % 800 else [0.2, 0.9, 0.0]})
        q = ARM.integrate(q, control.step(q, k * DT).v, DT)
    control.log.close()
    return open_log(path)


DERIVED: dict[str, Callable[[Log], object]] = {
    "summary": lambda log: story.summary(log).partition("\n")[2],
    "joint": lambda log: story.of_joint(log, "joint2"),
    "instant": lambda log: story.of_tick(log, 4050),
    "why": story.why,
    "spans": lambda log: spans(log, "active-set"),
    "checks": lambda log: [(claim.text, claim.rows.tolist()) for claim in claims(log)],
    "report": lambda log: markdown(log, claims(log)).partition("\n")[2],
    "page": lambda log: html(log, claims(log)).partition("</h1>")[2],
}


@pytest.mark.parametrize("size", BATCHES)
def test_equal_ticks_give_equal_derived_data_whatever_the_batches(tmp_path, long, size):
    """Summary, spans, prices, checks and report are the same for batches of 1, 40, 600 and 4,000 rows."""
    again = batched(long, tmp_path / "b.arrow", size)
    assert len(again) == len(long) == 4100
    assert again.table().equals(long.table())
    for derive in DERIVED.values():
        assert derive(again) == derive(long)
    assert len(spans(long, "active-set")) > 10


def test_one_changed_row_changes_what_is_derived(tmp_path, long):
    """The planted lie: rows in another order give another summary, and another report."""
    rows = long.table().combine_chunks()
    swapped = rows.take(np.r_[0:2000, 2100:2200, 2000:2100, 2200:4100])
    with pa.ipc.new_file(tmp_path / "c.arrow", rows.schema) as file:
        file.write_table(swapped)
    other = open_log(tmp_path / "c.arrow")
    assert DERIVED["spans"](other) != DERIVED["spans"](long)
