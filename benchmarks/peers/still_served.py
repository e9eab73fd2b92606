"""Still targets through a peer, in its own environment; started by `still.py`.

The arguments are a folder of `handed.hand_over`, whose poses are one target for each run, the script of the
peer, a solver, and the number of ticks. The velocities of all runs go to `answers.npy` in that folder,
(runs, ticks, nv) [rad/s]; they are NaN from the tick on at which the peer gave up.
"""

import sys
from copy import copy
from importlib import import_module
from pathlib import Path

import numpy as np
from served import handed_case

folder, script, solver, ticks = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])
peer, case = import_module(script.stem), handed_case(folder, solver)
answers = np.full((len(case.poses), ticks, len(case.angles)), np.nan)
for run, pose in enumerate(case.poses):
    own = copy(case)
    own.poses = [pose] * ticks
    _, tick = peer.stack(own)
    try:
        for i in range(ticks):
            answers[run, i] = tick(i)
    except peer.FAILURE as error:
        print(f"run {run}, tick {i}: {type(error).__name__}: {error}"[:200], file=sys.stderr)
np.save(folder / "answers.npy", answers)
