"""The manifest of a log, a JSON file with everything that is needed to judge or repeat the run."""

import hashlib
import json
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TypeAlias

import numpy as np

from taskopt.record.batch import Batch
from taskopt.record.run_info import RunInfo

Json: TypeAlias = "Mapping[str, Json] | Sequence[Json] | str | int | float | bool | None"

FILE = "manifest.json"
PACKAGES = (
    "taskopt", "numpy", "scipy", "numba", "pin", "coal", "daqp", "proxsuite", "clarabel", "qpsolvers",
    "cvxpy", "quadprog", "piqp", "osqp", "scs", "highspy", "rerun-sdk", "pyarrow", "example-robot-data",
)  # fmt: skip


class ManifestSink:
    """Write the manifest when a run begins, and again with status and tick counts when it ends."""

    def __init__(self, path: Path) -> None:
        """Prepare a manifest, which `open` writes.

        Args:
            path: The file to write.
        """
        self.path = path

    def open(self, info: RunInfo) -> None:
        """Write the manifest of a run that is about to begin.

        Args:
            info: The facts about the run.
        """
        self._content = manifest(info)
        self._ticks = dict.fromkeys(info.resolvers, 0)
        self._write("running")

    def take(self, batch: Batch) -> None:
        """Count the ticks of a batch; nothing is written.

        Args:
            batch: Consecutive steps of one resolver.
        """
        self._ticks[batch.resolver] = self._ticks.get(batch.resolver, 0) + len(batch.steps)

    def close(self, status: str) -> None:
        """Write the manifest again, with the time at which the run ended.

        Args:
            status: "finished", or "interrupted" if the run ended early.
        """
        self._content["ended"] = _now()
        self._write(status)

    def _write(self, status: str) -> None:
        """Replace the file in one step, so that a kill never leaves half a manifest."""
        self._content |= {"status": status, "ticks": self._ticks}
        fresh = self.path.with_suffix(".part")
        fresh.write_text(json.dumps(self._content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        fresh.replace(self.path)


def manifest(info: RunInfo) -> dict[str, Json]:
    """Collect everything that a reader needs to judge or repeat a run.

    Args:
        info: The facts about the run.

    Returns:
        Plain data for JSON: scenario with its text, robot, start posture, resolvers, seed, time, commit,
        versions and machine.
    """
    scenario = info.scenario
    return {
        "scenario": {
            "name": scenario.name,
            "description": scenario.description,
            "duration_s": scenario.duration,
            "dt_s": scenario.dt,
            "settings": {name: _plain(value) for name, value in scenario.settings.items()},
            **_source(info.source),
        },
        "robot": {"name": scenario.robot.name, "nq": scenario.robot.nq, "nv": scenario.robot.nv},
        "q0": scenario.start.tolist(),
        "resolvers": list(info.resolvers),
        "seed": info.seed,
        "started": _now(),
        "git_commit": _commit(info.source),
        "python": platform.python_version(),
        "versions": versions(),
        "machine": machine(),
    }


def _plain(value: object) -> Json:
    """Return a setting as plain data for JSON; a target that moves as its text."""
    if isinstance(value, bool | int | float | str):
        return value
    try:
        return np.asarray(value, dtype=np.float64).tolist()
    except (TypeError, ValueError):
        return repr(value)


def versions() -> dict[str, str]:
    """Find the versions of the packages that a run uses.

    Returns:
        The version of each package of `PACKAGES` that is installed, by name.
    """
    found = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, Json]:
    """Describe the machine that a run is timed on.

    Returns:
        The processor ("cpu"), the number of cores that this process may use ("cores"), the operating system
        ("system") and the environment variables that set numbers of threads ("threads").
    """
    threads = {
        key: os.environ[key] for key in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS") if key in os.environ
    }
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "system": platform.platform(),
        "threads": threads,
    }


def _cpu() -> str:
    """Return the name of the processor, from Linux if it states it, else from Python."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _source(source: Path | None) -> dict[str, Json]:
    """Return file name, hash and text of a scenario; the text is kept for readers and never executed."""
    if source is None or not source.is_file():
        return {}
    text = source.read_bytes()
    return {
        "file": str(source),
        "sha256": hashlib.sha256(text).hexdigest(),
        "text": text.decode("utf-8", errors="replace"),
    }


def _commit(source: Path | None) -> str | None:
    """Return the commit of the checkout that holds the scenario, with "+" if files were changed since."""
    folder = source.resolve().parent if source is not None else Path.cwd()

    def git(*words: str) -> str | None:
        """Return the output of a git command; None if it fails or does not answer within 5 s."""
        try:
            done = subprocess.run(
                ["git", *words], cwd=folder, capture_output=True, text=True, timeout=5, check=False
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        return done.stdout.strip() if done.returncode == 0 else None

    commit = git("rev-parse", "HEAD")
    return None if commit is None else commit + ("+" if git("status", "--porcelain") else "")


def _now() -> str:
    """Return the present time in UTC, as ISO 8601 text."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
