"""A commit of this repository beside the working tree, and the same benchmarks in either of them.

`worktree` checks a commit out for as long as it is needed. `Subject` hides what differs between the
commits: until 8dbc6b4 the cases lay in `bench/works.py`, and some modules had other names. A process runs
the code of one checkout only; `environment` makes it that of a given one.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fcntl import LOCK_EX, flock
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from taskopt import Robot, Stack

ROOT = Path(__file__).resolve().parents[1]
BEFORE = "8dbc6b4"  # the last commit before the folders became the towers
_STAMP = 1_000_000_000.0  # [s] the modification time of all files: old commits compare it


@dataclass(frozen=True, eq=False)
class Subject:
    """A benchmark case or a scenario.

    Attributes:
        name: Name of the case, or of the file in tasks/.
        robot: The robot.
        q0: Start posture, (nq,) [rad, m].
        stack: Tasks and limits.
        dt: Time from tick to tick [s].
        ticks: Number of ticks.
        aim: Sets the targets of a tick, and returns its time [s].
    """

    name: str
    robot: "Robot"
    q0: "NDArray[np.float64]"
    stack: "Stack"
    dt: float
    ticks: int
    aim: "Callable[[int], float]"


def cache_of(commit: str) -> Path:
    """Return the folder in which a commit and its compiled kernels are kept from call to call."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(home) / "taskopt" / "benchmarks" / commit


def full_name(commit: str) -> str:
    """Return the full name of a commit, tag or branch.

    Raises:
        SystemExit: The repository has no such commit.
    """
    done = subprocess.run(
        ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", f"{commit}^{{commit}}"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"there is no commit {commit} in this repository; git fetch may get it")
    return done.stdout.strip()


@contextmanager
def worktree(commit: str) -> "Iterator[Path]":
    """Check a commit out into a worktree of Git, and remove it afterwards.

    The place and the times of its files are the same on every call, so that the kernels which it has
    compiled are found again.

    Args:
        commit: Any name of a commit.

    Yields:
        The folder of the checkout.
    """
    folder = cache_of(full_name(commit)) / "checkout"
    git = ["git", "-C", str(ROOT), "worktree"]
    folder.parent.mkdir(parents=True, exist_ok=True)
    with (folder.parent / "lock").open("w") as lock:
        flock(lock, LOCK_EX)  # another benchmark may be using the place; wait for it
        shutil.rmtree(folder, ignore_errors=True)  # left over from a process that was killed
        subprocess.run([*git, "prune"], check=True)
        subprocess.run([*git, "add", "--quiet", "--detach", str(folder), commit], check=True)
        try:
            for path in folder.rglob("*.py"):
                os.utime(path, (_STAMP, _STAMP))
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def environment(folder: Path, cache: Path | None = None) -> dict[str, str]:
    """Return the variables of a process that runs the code of one checkout, on one thread.

    Args:
        folder: The checkout.
        cache: Where its compiled kernels are kept; where the user keeps them, if it is None.
    """
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    kept = {"NUMBA_CACHE_DIR": str(cache)} if cache else {}
    return os.environ | threads | kept | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}


def subject(folder: Path, name: str, ticks: int | None = None) -> Subject:
    """Make a benchmark case, or load a scenario of tasks/, with the code that this process runs.

    Args:
        folder: The checkout whose code this is.
        name: Name of a case, or of a file in tasks/.
        ticks: Number of ticks; for a scenario None means its own duration.

    Returns:
        The subject.
    """
    return _case(folder, name, ticks or 1000) if name.startswith("W") else _scenario(folder, name, ticks)


def undamped(of: Subject) -> Subject:
    """Return a subject whose stack has no damping at rest, which older commits do not know.

    Args:
        of: The subject.
    """
    known = getattr(of.stack, "damping", None) is not None
    return replace(of, stack=replace(of.stack, damping=None)) if known else of


def _case(folder: Path, name: str, ticks: int) -> Subject:
    """Make a benchmark case; a commit before the move had it in `bench/works.py`."""
    if (folder / "bench" / "works.py").is_file():
        sys.path.insert(0, str(folder / "bench"))
        works = import_module("works")
        made, dt = works.work(name, ticks), works.DT
    else:
        cases = import_module("cases")
        made, dt = cases.benchmark_case(name, ticks), cases.DT

    def aim(tick: int) -> float:
        made.hand.set(made.poses[tick])
        return 0.0

    return Subject(name, made.robot, made.q0, made.stack, dt, ticks, aim)


def _scenario(folder: Path, name: str, ticks: int | None) -> Subject:
    """Load a scenario, whose targets depend on time."""
    place = "taskopt.loop.scenario" if find_spec("taskopt.loop") else "taskopt.scenario"
    made = import_module(place).load_scenario(folder / "tasks" / f"{name}.py")
    count = min(ticks or made.ticks, made.ticks)
    return Subject(name, made.robot, made.start, made.stack, made.dt, count, lambda tick: tick * made.dt)
