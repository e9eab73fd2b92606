"""Run pytest over and over in processes that are forked from this one, in which the libraries are loaded.

`mutants.py` starts it in a checkout, writes one line of JSON with the arguments of pytest and the file for
its output, and reads a line with the exit code. The package under test is not loaded here, but anew in each
process, since its files change from run to run. To load the libraries takes longer than most tests.
"""

import contextlib
import importlib
import json
import os
import sys
from pathlib import Path

LIBRARIES = ("numpy", "scipy.linalg", "scipy.optimize", "scipy.sparse", "numba", "pinocchio", "hypothesis")


def main() -> None:
    """Serve requests until the input ends."""
    for name in (*LIBRARIES, "coal", "clarabel", "daqp", "proxsuite", "qpsolvers", "pytest"):
        with contextlib.suppress(ImportError):  # an optional solver may be missing
            importlib.import_module(name)
    for line in sys.stdin:
        arguments, output = json.loads(line)
        child = os.fork()
        if child == 0:
            _run(arguments, output)
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


def _run(arguments: list[str], output: str) -> None:
    """Run pytest with its output in a file, and end the process with its exit code."""
    import pytest

    with Path(output).open("w", encoding="utf-8") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
        code = 3  # of pytest, for an internal error
        with contextlib.suppress(BaseException):
            code = int(pytest.main(arguments))
        sys.stdout.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
