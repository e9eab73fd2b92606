"""The table of planted faults fits the code as it stands, and a sample of the faults is noticed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT
from faults import FAULTS, Fault
from mutants import TABLE
from time_limit import ACTION, LIMIT

import taskopt


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_text_of_a_fault_stands_once_in_its_file(fault: Fault) -> None:
    """A fault whose text is gone, or ambiguous, would not be planted, or in the wrong place."""
    text = (Path(taskopt.__file__).parent / fault.file).read_text(encoding="utf-8")
    assert text.count(fault.old) == 1
    assert fault.new != fault.old
    compile(text.replace(fault.old, fault.new), fault.file, "exec")


def test_faults_have_names_of_their_own() -> None:
    """At least 60 faults, no two of one name: the table names each by its name only."""
    names = [fault.name for fault in FAULTS]
    assert len(names) >= 60
    assert len(set(names)) == len(names)


@pytest.mark.slow
def test_a_test_that_takes_too_long_ends(tmp_path: Path) -> None:
    """An endless test fails at the limit, so that a fault that makes the search run for ever is killed."""
    (tmp_path / "test_endless.py").write_text("def test_endless():\n    while True:\n        pass\n")
    plugin = str(ROOT / "benchmarks" / "accept")
    environment = os.environ | {LIMIT: "0.2", ACTION: "fail", "PYTHONPATH": plugin}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "time_limit", "-p", "no:cacheprovider", str(tmp_path)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    assert done.returncode == 1
    assert "takes more than 0.2 s" in done.stdout


def test_the_committed_table_knows_every_fault() -> None:
    """Each fault has its line, and survives only where the table of faults says why it cannot do harm."""
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    for fault in FAULTS:
        outcome = "survives" if fault.harmless else "killed"
        assert any(line.startswith(f"  {outcome:11s} {fault.name:58s} ") for line in lines), fault.name


@pytest.mark.slow
def test_a_sample_of_faults_is_noticed() -> None:
    """Three faults, drawn by a fixed seed, are killed by the tests that the committed table names."""
    command = [sys.executable, str(ROOT / "benchmarks" / "accept" / "mutants.py")]
    done = subprocess.run(
        [*command, "--sample", "3", "--seed", "8", "--again", "--jobs", "2"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(Path(taskopt.__file__).parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
