"""The faults planted in the chapter's equations fit the code, and the tests of the table catch a sample."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from chapter import PAGE, TABLE, line_begins, named_tests
from chapter_faults import FAULTS
from checkout import ROOT
from faults import Fault

import taskopt


@pytest.mark.parametrize(("equation", "fault"), FAULTS, ids=[equation for equation, _ in FAULTS])
def test_the_text_of_a_fault_stands_once_in_its_file(equation: str, fault: Fault) -> None:
    """A fault whose text is gone would not be planted; what stands there then is Python all the same."""
    text = (Path(taskopt.__file__).parent / fault.file).read_text(encoding="utf-8")
    assert text.count(fault.old) == 1
    assert fault.new != fault.old
    compile(text.replace(fault.old, fault.new), fault.file, "exec")


def test_at_least_forty_equations_have_a_fault_of_their_own() -> None:
    """No equation twice, and each has its test in the table."""
    equations = [equation for equation, _ in FAULTS]
    assert len(set(equations)) == len(equations) >= 40
    assert set(equations) <= set(named_tests(PAGE.read_text(encoding="utf-8")))


def test_the_committed_table_has_every_fault_caught_by_the_test_of_its_equation() -> None:
    """No line is missing or left over, and each names the test that the table of the chapter names now."""
    head, _, *lines = TABLE.read_text(encoding="utf-8").splitlines()
    tests = named_tests(PAGE.read_text(encoding="utf-8"))
    expected = [f"{line_begins(number, fault, True)} {tests[number]}" for number, fault in FAULTS]
    assert lines == expected
    assert re.fullmatch(rf"{len(FAULTS)} equations with .*: {len(FAULTS)} caught, 0 missed", head)


@pytest.mark.slow
def test_a_sample_of_faults_is_caught() -> None:
    """Three faults, drawn by a fixed seed, fail the tests that pass without them."""
    command = [sys.executable, str(ROOT / "benchmarks" / "accept" / "chapter.py")]
    done = subprocess.run(
        [*command, "--sample", "3", "--seed", "9"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(Path(taskopt.__file__).parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 caught, 0 missed" in done.stdout
