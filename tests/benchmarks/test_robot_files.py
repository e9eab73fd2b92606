"""A sample of damaged robot files, and what the benchmark that damages them must not overlook."""

import importlib.util
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest
from robot_file_kinds import Kind, kinds
from robot_files import all_outcomes, damaged, outcome_of

from taskopt import MissingFile, Robot

NEEDED = {"xacro": "xacrodoc", "MJCF": "mujoco"}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings to a file in the current folder."""
    monkeypatch.chdir(tmp_path)


def kind(name: str) -> Kind:
    """A kind by its name; skip the test if the package that reads it is not installed."""
    if importlib.util.find_spec(NEEDED.get(name, "numpy")) is None:
        pytest.skip(f"{NEEDED[name]} is not installed")
    return next(k for k in kinds() if k.name == name)


@pytest.mark.parametrize("name", [k.name for k in kinds()])
def test_a_damaged_file_is_refused_by_our_errors_or_read_rightly(name: str, tmp_path: Path) -> None:
    """Seeds that the committed table does not hold; some files are read, and some are refused."""
    of = kind(name)
    outcomes = [outcome_of(of, seed, tmp_path) for seed in range(10_000, 10_060)]
    assert [outcome for outcome in outcomes if outcome.startswith("!")] == []
    assert 0 < outcomes.count("read") < len(outcomes)


@pytest.mark.parametrize("name", [k.name for k in kinds()])
def test_whole_files_are_read(name: str, tmp_path: Path) -> None:
    """Without damage nothing is refused, and the judges find no difference."""
    of = kind(name)
    for ending, content in of.files:
        path = tmp_path / f"file{ending}"
        path.write_bytes(content)
        assert of.farthest(path, of.read(path)) < 1e-12


def test_a_reader_that_is_wrong_is_found(tmp_path: Path) -> None:
    """A joint that turns the other way and a bare exception are failures; an error of ours is none."""
    of = kind("URDF")

    def mirrored(path: Path) -> Robot:
        path.write_bytes(of.files[0][1].replace(b'"0.6 0 0.8"', b'"-0.6 0 -0.8"'))
        robot = of.read(path)
        path.write_bytes(of.files[0][1])
        return robot

    def bare(path: Path) -> Robot:
        raise KeyError(path.name)

    def ours(path: Path) -> Robot:
        raise MissingFile(path.name)

    outcomes = [outcome_of(replace(of, read=read), 1, tmp_path) for read in (mirrored, bare, ours)]
    said = [outcome.split(",")[0].split(":")[0] for outcome in outcomes]
    assert said == ["!read wrongly", "!KeyError", "MissingFile"]


@pytest.mark.slow
def test_a_crash_and_a_hang_are_told_from_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that reads is started anew after either, and all other files are still judged."""
    monkeypatch.setattr("robot_files._PATIENCE", 4.0)
    of = kind("mesh")

    def read(path: Path) -> Robot:
        size = len(path.read_bytes())
        if size == crashing:
            os._exit(3)
        if size == hanging:
            time.sleep(60.0)
        raise MissingFile(path.name)

    sizes = {seed: len(damaged(of, seed)[1]) for seed in range(8)}
    crashing, hanging = sizes[2], sizes[5]
    outcomes = all_outcomes(replace(of, read=read), range(8))
    said = {seed: outcome.split(":")[0] for seed, outcome in outcomes.items()}
    for seed, size in sizes.items():
        expected = {crashing: "!the process ended with status 768", hanging: "!more than 4 s"}
        assert said[seed] == expected.get(size, "MissingFile")
