"""Plant the faults of `faults.py` one at a time, and run the quick tests that cover the faulty line.

    python benchmarks/accept/mutants.py --out benchmarks/accept/mutants.txt  # all faults; the committed table
    python benchmarks/accept/mutants.py --only "no row is ever dropped" --map map.json
    python benchmarks/accept/mutants.py --sample 3 --seed 1 --again          # what the test suite does

A fault is a name, a file, and a piece of its text with what stands there instead. The tests run in a copy
of the checkout and without compilation (NUMBA_DISABLE_JIT=1), so that coverage sees the lines of the
numeric core and no mutant waits for the compiler. First the quick tests of the packages that faults
touch run once, and which test executes which line is written down (`coverage_map.py`; with --map it is kept
in a file). With a mutant, only tests that execute its line run, until the first one fails; with --again, only
the test that killed the fault in the committed table. A mutant is *killed* if a test fails, and *survives* if
none does. Faults that cannot change an answer are listed with the reason, and must survive. All of it takes
about a quarter of an hour on two cores, most of it for the map.
"""

import argparse
import json
import queue
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from coverage_map import CoverageMap, measure, without_compilation
from faults import FAULTS, Fault

import taskopt

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("mutants.txt")
PACKAGE = Path(taskopt.__file__).parent
BESIDE_THE_PACKAGE = ("tests", "tasks", "benchmarks", "docs", "README.md", "pyproject.toml")
TOO_LONG = 30.0  # [s] a test of a mutant that takes longer has failed; none takes that long without a fault
ENOUGH = 20.0  # [s] tests are chosen up to this time in all, those of the folder of the faulty file first


class Runner:
    """Runs tests in a copy of the checkout, in processes forked from one that has loaded all libraries.

    Args:
        checkout: Top folder of the copy.
    """

    def __init__(self, checkout: Path) -> None:
        self.checkout = checkout
        self._server = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("pytest_server.py"))],
            cwd=checkout,
            env=without_compilation(checkout, TOO_LONG, "fail"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def failing_test(self, tests: Sequence[str]) -> str:
        """Run tests until the first failure.

        Args:
            tests: Ids of tests, or folders.

        Returns:
            The name of the test that failed, or "".

        Raises:
            RuntimeError: The tests could not be run.
        """
        listed, output = self.checkout / "chosen_tests.txt", self.checkout / "output.txt"
        listed.write_text("\n".join(tests), encoding="utf-8")
        options = ["-x", "-q", "--no-header", "--tb=no", "-m", "not slow", "-p", "no:cacheprovider"]
        request = [[*options, "-p", "time_limit", f"@{listed}"], str(output)]
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps(request) + "\n")
        self._server.stdin.flush()
        code = int(self._server.stdout.readline())
        if code == 0:
            return ""
        told = output.read_text(encoding="utf-8")
        names = [
            line.split(" ", 1)[1].split(" - ")[0]
            for line in told.splitlines()
            if line.startswith(("FAILED", "ERROR"))
        ]
        if code not in (1, 2) or not names:
            raise RuntimeError(f"the tests could not be run:\n{told[-2000:]}")
        return names[0]

    def stop(self) -> None:
        """End the server."""
        assert self._server.stdin is not None
        self._server.stdin.close()
        self._server.wait()


@dataclass(frozen=True)
class Verdict:
    """Result of one mutant.

    Attributes:
        fault: The fault that was planted.
        outcome: "killed", "survives", or "not covered".
        test: The first test that failed, or "".
        seconds: Wall time of the run [s].
    """

    fault: Fault
    outcome: str
    test: str
    seconds: float

    @property
    def expected(self) -> bool:
        """True if the outcome is the one that the table of faults promises."""
        return (self.outcome == "survives") == bool(self.fault.harmless)

    def __str__(self) -> str:
        mark = " " if self.expected else "!"
        told = self.test if self.outcome == "killed" else self.fault.harmless
        return f"{mark} {self.outcome:11s} {self.fault.name:58s} {told}".rstrip()


def main() -> int:
    """Run the command line; return 0 if every outcome is as the table of faults promises."""
    arguments = _arguments()
    faults = _chosen(arguments.only, arguments.sample, arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        copies = [copy_of_checkout(Path(folder) / str(job)) for job in range(arguments.jobs)]
        covered = None if arguments.again else _coverage_map(arguments.map, copies[0])
        runners = [Runner(copy) for copy in copies]
        idle: queue.SimpleQueue[Runner] = queue.SimpleQueue()
        for runner in runners:
            idle.put(runner)

        def judge(fault: Fault) -> Verdict:
            runner = idle.get()
            try:
                verdict = plant(fault, runner, covered)
            finally:
                idle.put(runner)
            print(f"{verdict}  [{verdict.seconds:.0f} s]", flush=True)
            return verdict

        with ThreadPoolExecutor(arguments.jobs) as pool:
            verdicts = list(pool.map(judge, faults))
        for runner in runners:
            runner.stop()
    table = _table(verdicts)
    print(f"\n{table.splitlines()[0]}")
    if arguments.out:
        coverage = f"\nStatements that quick tests execute:\n\n{covered.tower()}\n" if covered else ""
        arguments.out.write_text(table + coverage, encoding="utf-8")
    return 0 if all(verdict.expected for verdict in verdicts) else 1


def plant(fault: Fault, runner: Runner, covered: CoverageMap | None) -> Verdict:
    """Plant one fault in a copy of the checkout, run tests that execute it, and take it out again.

    Args:
        fault: The fault.
        runner: Runs tests in the copy, which is left as it was found.
        covered: Which tests execute which lines. None: only the test that the committed table names runs.

    Returns:
        The verdict.

    Raises:
        ValueError: The text of the fault does not stand in its file exactly once.
    """
    source = (runner.checkout / "taskopt" / fault.file).read_text(encoding="utf-8")
    groups = _recorded(fault) if covered is None else chosen_tests(fault, source, covered)
    if not groups:
        return Verdict(fault, "not covered", "", 0.0)
    begin = time.monotonic()
    with planted(fault, runner.checkout):
        failed = next(filter(None, map(runner.failing_test, groups)), "")
    return Verdict(fault, "killed" if failed else "survives", failed, time.monotonic() - begin)


@contextmanager
def planted(fault: Fault, checkout: Path) -> Iterator[None]:
    """Plant a fault in a copy of the checkout, and take it out again at the end of the block.

    Args:
        fault: The fault.
        checkout: Top folder of the copy.

    Yields:
        Nothing.

    Raises:
        ValueError: The text of the fault does not stand in its file exactly once.
    """
    path = checkout / "taskopt" / fault.file
    source = path.read_text(encoding="utf-8")
    if source.count(fault.old) != 1:
        raise ValueError(
            f"fault '{fault.name}': its text stands {source.count(fault.old)} times in {fault.file}; once is "
            "needed, so bring the table of faults up to date"
        )
    path.write_text(source.replace(fault.old, fault.new), encoding="utf-8")
    try:
        yield
    finally:
        path.write_text(source, encoding="utf-8")


def chosen_tests(fault: Fault, source: str, covered: CoverageMap) -> list[list[str]]:
    """Return tests that execute the faulty lines, at most `ENOUGH` seconds of them.

    A constant is executed when its module is imported, by no test in particular; there the tests count that
    execute a line which mentions the constant, in any file of the package.

    Args:
        fault: The fault.
        source: Text of its file, without the fault.
        covered: Which tests execute which lines.

    Returns:
        Ids of tests, the quickest first: those of the test folder beside the file, then others.
    """
    first = source[: source.index(fault.old)].count("\n") + 1
    numbers = range(first, first + fault.old.count("\n") + 1)
    own = covered.lines.get(fault.file, {})
    found = {test for number in numbers for test in own.get(str(number), ())}
    if fault.constant:
        found |= set(_users(fault.constant, covered))
    beside = f"{_beside(fault)}/"
    total: float = 0.0
    groups: dict[bool, list[str]] = {True: [], False: []}
    turns = _turns(found, covered)
    for test in sorted(found, key=lambda test: (not test.startswith(beside), turns[test])):
        total += covered.seconds[test]
        if total > ENOUGH:
            break
        groups[test.startswith(beside)].append(test)
    return [group for group in groups.values() if group]


def _recorded(fault: Fault) -> list[list[str]]:
    """Return the test that killed a fault in the committed table; nothing if none did."""
    head = str(Verdict(fault, "killed", "tests/", 0.0))
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    return [["tests/" + line.removeprefix(head)] for line in lines if line.startswith(head)]


def _turns(tests: Iterable[str], covered: CoverageMap) -> dict[str, tuple[int, float]]:
    """Return keys by which every test function has its quickest case run before any has its second one."""
    turns, seen = {}, Counter[str]()
    for test in sorted(tests, key=covered.seconds.__getitem__):
        function = test.split("[")[0]
        turns[test] = seen[function], covered.seconds[test]
        seen[function] += 1
    return turns


def _users(constant: str, covered: CoverageMap) -> Iterator[str]:
    """Yield the tests that execute a line which mentions a constant."""
    word = re.compile(rf"\b{re.escape(constant)}\b")
    for file, lines in covered.lines.items():
        for number, text in enumerate((PACKAGE / file).read_text(encoding="utf-8").splitlines(), 1):
            if word.search(text):
                yield from lines.get(str(number), ())


def _beside(fault: Fault) -> PurePosixPath:
    """Return the folder of tests that mirrors the folder of the faulty file, or the nearest one above it."""
    folder = "tests" / PurePosixPath(fault.file).parent
    while not (ROOT / folder).is_dir():
        folder = folder.parent
    return folder


def copy_of_checkout(folder: Path) -> Path:
    """Copy the package that is imported here, and the tests with what they read, into an empty folder.

    Args:
        folder: The folder; it is made here.

    Returns:
        The folder.
    """
    ignored = shutil.ignore_patterns("__pycache__", ".*")
    shutil.copytree(PACKAGE, folder / "taskopt", ignore=ignored)
    for name in BESIDE_THE_PACKAGE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=ignored)
        else:
            shutil.copy2(ROOT / name, folder / name)
    return folder


def _coverage_map(kept: Path | None, checkout: Path) -> CoverageMap:
    """Read the map that an earlier call kept, or measure it and keep it."""
    if kept and kept.exists():
        return CoverageMap.load(kept)
    print("running the quick tests once, to see which test executes which line ...", flush=True)
    covered = measure(checkout)
    if kept:
        covered.save(kept)
    return covered


def _arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="names of faults")
    parser.add_argument(
        "--sample", type=int, metavar="N", help="so many faults that are not harmless, drawn at random"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the sample")
    parser.add_argument("--map", type=Path, metavar="FILE", help="read the coverage map, or write it there")
    parser.add_argument("--again", action="store_true", help="no map: run the tests that the table names")
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time, each in a copy of its own")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the table there, too")
    return parser.parse_args()


def _chosen(only: Sequence[str] | None, sample: int | None, seed: int) -> list[Fault]:
    """Return the faults that the command line asks for."""
    known = {fault.name: fault for fault in FAULTS}
    if only:
        unknown = [name for name in only if name not in known]
        if unknown:
            raise SystemExit(f"no fault is named {unknown}; known: {', '.join(known)}")
        return [known[name] for name in only]
    if sample:
        return random.Random(seed).sample([fault for fault in FAULTS if not fault.harmless], sample)
    return list(FAULTS)


def _table(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as text, the counts in the first line."""
    killed = sum(verdict.outcome == "killed" for verdict in verdicts)
    wrong = sum(not verdict.expected for verdict in verdicts)
    head = (
        f"{len(verdicts)} faults: {killed} killed by quick tests, {len(verdicts) - killed} not, "
        f"{wrong} of them unexpectedly"
    )
    return "\n".join([head, "", *map(str, verdicts), ""])


if __name__ == "__main__":
    sys.exit(main())
