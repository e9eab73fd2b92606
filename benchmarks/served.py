"""The other side of `handed.py`, for an interpreter that has a peer and NumPy, and not this library."""

import gc
import json
import os
import sys

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy is imported

from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns, thread_time_ns
from types import SimpleNamespace

import numpy as np


def handed_case() -> SimpleNamespace:
    """Contents of the folder that the first argument names; `poses` (ticks, 4, 4), `urdf` its path."""
    folder = Path(sys.argv[1])
    case = SimpleNamespace(**json.loads((folder / "case.json").read_text(encoding="utf-8")))
    case.poses, case.urdf, case.solver = (
        np.load(folder / "poses.npy"),
        str(folder / "robot.urdf"),
        sys.argv[2],
    )
    return case


def serve(name: str, tick: Callable[[int], None], failure: type[Exception]) -> None:
    """Run the blocks of ticks that are asked for on standard input, and answer with their microseconds.

    A `failure` ends the peer's turns, and is said.
    """
    clock = thread_time_ns if sys.argv[3] == "cpu" else perf_counter_ns
    print(json.dumps(name), flush=True)
    gc.disable()
    gone = False
    for line in sys.stdin:
        first, stop = map(int, line.split())
        times = [float("nan")] * (stop - first)
        for i in range(first, stop):
            if gone:
                break
            begin = clock()
            try:
                tick(i)
            except failure as error:
                print(f"{name} gave up at tick {i}: {type(error).__name__}: {error}"[:200], file=sys.stderr)
                gone = True
                break
            times[i - first] = (clock() - begin) * 1e-3
        gc.collect()
        print(json.dumps(times), flush=True)
