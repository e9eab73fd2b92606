"""Plant a wrong sign or factor in a formula of the chapter, and run the test that its table names.

    python benchmarks/accept/chapter.py --out benchmarks/accept/chapter.txt  # all faults; the committed table
    python benchmarks/accept/chapter.py --only 3.30 3.91
    python benchmarks/accept/chapter.py --sample 3 --seed 1                  # what the test suite does

The faults are in `chapter_faults.py`, one for each equation. The tests are those that the last table of
`docs/chapter.md` names for the equations. First all these tests run without a fault, and must pass; then each
fault is planted in a copy of the checkout, and the test of its equation alone has to fail. As in `mutants.py`
nothing is compiled, so that no fault waits for the compiler. All of it takes a few minutes.
"""

import argparse
import random
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from chapter_faults import FAULTS
from faults import Fault
from mutants import ROOT, Runner, copy_of_checkout, planted

TABLE = Path(__file__).with_name("chapter.txt")
PAGE = ROOT / "docs" / "chapter.md"


def main() -> int:
    """Run the command line; return 0 if the test of the table catches every fault."""
    arguments = _arguments()
    faults = _chosen(arguments.only, arguments.sample, arguments.seed)
    tests = named_tests(PAGE.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(copy_of_checkout(Path(folder) / "checkout"))
        failing = runner.failing_test(sorted({tests[equation] for equation, _ in faults}))
        if failing:
            runner.stop()
            print(f"fails without any fault: {failing}")
            return 1
        lines = []
        for equation, fault in faults:
            lines.append(verdict(equation, fault, tests[equation], runner))
            print(lines[-1], flush=True)
        runner.stop()
    missed = sum(line.startswith("!") for line in lines)
    head = f"{len(faults)} equations with a planted fault: {len(faults) - missed} caught, {missed} missed"
    print(f"\n{head}")
    if arguments.out:
        arguments.out.write_text("\n".join([head, "", *lines, ""]), encoding="utf-8")
    return 1 if missed else 0


def named_tests(page: str) -> dict[str, str]:
    """Read the test of each equation from the table.

    Args:
        page: Text of `docs/chapter.md`.

    Returns:
        Path and name of the test, from the top folder, by number of the equation.
    """
    rows = re.findall(r"^\| \((3\.\d+)\) \|.*\| `(\S+)` \|$", page, re.MULTILINE)
    return {number: f"tests/{test}" for number, test in rows}


def verdict(equation: str, fault: Fault, test: str, runner: Runner) -> str:
    """Plant one fault and run the test of its equation.

    Args:
        equation: Number of the equation.
        fault: The fault.
        test: Path and name of the test.
        runner: Runs tests in the copy, which is left as it was found.

    Returns:
        A line of the table; it begins with "!" if the test passes in spite of the fault.
    """
    with planted(fault, runner.checkout):
        failed = runner.failing_test([test])
    return f"{line_begins(equation, fault, bool(failed))} {test}"


def line_begins(equation: str, fault: Fault, caught: bool) -> str:
    """Write the beginning of a line of the table, all but the test.

    Args:
        equation: Number of the equation.
        fault: The fault.
        caught: Whether the test failed, as it should.

    Returns:
        The text.
    """
    return f"{' ' if caught else '!'} {'caught' if caught else 'missed':7s} ({equation:5s}) {fault.name:62s}"


def _arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", metavar="NUMBER", help="numbers of equations")
    parser.add_argument("--sample", type=int, metavar="N", help="so many equations, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="seed of the sample")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the table there, too")
    return parser.parse_args()


def _chosen(only: Sequence[str] | None, sample: int | None, seed: int) -> list[tuple[str, Fault]]:
    """Return the faults that the command line asks for."""
    if only:
        known = dict(FAULTS)
        unknown = [number for number in only if number not in known]
        if unknown:
            raise SystemExit(f"no fault is planted in {', '.join(unknown)}; there are {', '.join(known)}")
        return [(number, known[number]) for number in only]
    return random.Random(seed).sample(FAULTS, sample) if sample else list(FAULTS)


if __name__ == "__main__":
    sys.exit(main())
