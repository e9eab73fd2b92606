"""Lines of the package that each quick test executes, measured without compilation (NUMBA_DISABLE_JIT=1)."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import coverage

TEST_FOLDERS = ("tests/hierarchy", "tests/resolver", "tests/solver", "tests/kinematics", "tests/loop")
TOWER = ("hierarchy", "resolver", "solver")  # folders of the optimisation tower
SKIPPED_FROM = 4.0  # [s] a test that takes longer without compilation is left out of the map
HERE = Path(__file__).parent


@dataclass(frozen=True)
class CoverageMap:
    """Quick tests that execute each line, the time of each test, and the share of each file that is executed.

    Attributes:
        lines: For each file of the package, for each line number as a string, the ids of the tests.
        seconds: Duration of each test [s] by id.
        modules: For each file, the number of statements and how many of them some test executes.
    """

    lines: dict[str, dict[str, list[str]]]
    seconds: dict[str, float]
    modules: dict[str, tuple[int, int]]

    def save(self, path: Path) -> None:
        """Write the map as JSON.

        Args:
            path: The file.
        """
        path.write_text(json.dumps(asdict(self)), encoding="utf-8")

    @staticmethod
    def load(path: Path) -> "CoverageMap":
        """Return the map that `save` wrote.

        Args:
            path: The file.

        Returns:
            The map.
        """
        return CoverageMap(**json.loads(path.read_text(encoding="utf-8")))

    def tower(self) -> str:
        """Return the coverage of the optimisation tower as a table, a module a line, with the total."""
        chosen = {file: self.modules[file] for file in sorted(self.modules) if file.split("/")[0] in TOWER}
        chosen = {file: counts for file, counts in chosen.items() if counts[0]}
        total = tuple(sum(counts[i] for counts in chosen.values()) for i in (0, 1))
        rows = [(file, *counts) for file, counts in chosen.items()] + [("all", *total)]
        return "\n".join(
            f"{file:44s} {covered:5d} of {statements:5d} {100 * covered / statements:6.1f} %"
            for file, statements, covered in rows
        )


def without_compilation(checkout: Path, limit: float, too_long: str) -> Mapping[str, str]:
    """Return the environment for tests of a checkout without compilation.

    Args:
        checkout: Top folder of the checkout.
        limit: Longest time that a test may take [s].
        too_long: What becomes of a longer one, "skip" or "fail".

    Returns:
        The environment variables.
    """
    return os.environ | {
        "NUMBA_DISABLE_JIT": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONPATH": os.pathsep.join([str(checkout), str(HERE)]),
        "TEST_TIME_LIMIT": str(limit),
        "TEST_TOO_LONG": too_long,
    }


def measure(checkout: Path) -> CoverageMap:
    """Run the quick tests of `TEST_FOLDERS` once under coverage.

    What does not pass is left out: a test that is ended by the alarm is skipped, or fails, if the alarm rings
    inside of a framework such as Hypothesis.

    Args:
        checkout: Top folder of the checkout.

    Returns:
        The map.

    Raises:
        SystemExit: The tests cannot be run.
    """
    report, data = checkout / "durations.xml", checkout / ".coverage"
    command = [sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=short", "-m", "not slow"]
    options = ["-p", "no:cacheprovider", "-p", "time_limit", f"--junitxml={report}"]
    done = subprocess.run(
        [*command, *options, "--cov=taskopt", "--cov-context=test", "--cov-report=", *TEST_FOLDERS],
        cwd=checkout,
        env=without_compilation(checkout, SKIPPED_FROM, "skip"),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 1) or not report.exists():
        raise SystemExit(f"the quick tests cannot be run:\n{done.stdout[-3000:]}")
    return read_measured(data, [report], checkout / "taskopt")


def read_measured(data: Path, reports: list[Path], package: Path) -> CoverageMap:
    """Turn what coverage and pytest wrote into a map.

    Args:
        data: The data file of coverage.
        reports: The reports of pytest, as JUnit XML.
        package: The folder `taskopt` whose lines were measured.

    Returns:
        The map.
    """
    measured = coverage.Coverage(data_file=str(data), source=[str(package)])
    measured.load()
    seconds = {test: time for report in reports for test, time in _durations(report).items()}
    lines: dict[str, dict[str, list[str]]] = {}
    modules: dict[str, tuple[int, int]] = {}
    for file in sorted(measured.get_data().measured_files()):
        name = Path(file).relative_to(package).as_posix()
        contexts = measured.get_data().contexts_by_lineno(file)
        found = {
            str(n): sorted({c.split("|")[0] for c in tests} & seconds.keys()) for n, tests in contexts.items()
        }
        lines[name] = {number: tests for number, tests in found.items() if tests}
        _, statements, _, missing, _ = measured.analysis2(file)
        modules[name] = len(statements), len(statements) - len(missing)
    return CoverageMap(lines, seconds, modules)


def _durations(report: Path) -> dict[str, float]:
    """Read how long each test that passed took [s] from pytest's report, by test id."""
    found = {}
    for case in ET.parse(report).iter("testcase"):
        if not len(case):  # failures and skips have an element of their own
            file = case.attrib["classname"].replace(".", "/") + ".py"
            found[f"{file}::{case.attrib['name']}"] = float(case.attrib["time"])
    return found
