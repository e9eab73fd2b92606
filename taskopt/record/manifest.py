"""What a run was made of: versions, machine, scenario, resolvers. One JSON file a log."""

import hashlib
import json
import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from taskopt.record.batch import Batch
from taskopt.record.recorder import RunInfo

FILE = "manifest.json"
PACKAGES = (
    "taskopt", "numpy", "scipy", "numba", "pin", "coal", "daqp", "proxsuite", "clarabel", "qpsolvers",
    "cvxpy", "quadprog", "piqp", "osqp", "scs", "highspy", "rerun-sdk", "pyarrow", "example-robot-data",
)  # fmt: skip


class ManifestSink:
    """Writes the manifest when a run opens, and again when it ends, with status and tick counts."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def open(self, info: RunInfo) -> None:
        self._content = manifest(info)
        self._ticks = dict.fromkeys(info.resolvers, 0)
        self._write("running")

    def take(self, batch: Batch) -> None:
        self._ticks[batch.resolver] = self._ticks.get(batch.resolver, 0) + len(batch.steps)

    def close(self, status: str) -> None:
        self._content["ended"] = _now()
        self._write(status)

    def _write(self, status: str) -> None:
        self._content |= {"status": status, "ticks": self._ticks}
        fresh = self.path.with_suffix(".part")
        fresh.write_text(json.dumps(self._content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        fresh.replace(self.path)


def manifest(info: RunInfo) -> dict[str, Any]:
    """Everything that a reader needs to judge or repeat a run, as plain data."""
    scenario = info.scenario
    return {
        "scenario": {
            "name": scenario.name,
            "description": scenario.description,
            "duration_s": scenario.duration,
            "dt_s": scenario.dt,
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


def versions() -> dict[str, str]:
    """Version of each package that has a hand in a run, as far as it is installed."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, Any]:
    """Processor, cores that this process may use, system, and the thread settings in force."""
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
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _source(source: Path | None) -> dict[str, Any]:
    """File, hash and text of a scenario: the text is kept to be read, never to be run."""
    if source is None or not source.is_file():
        return {}
    text = source.read_bytes()
    return {
        "file": str(source),
        "sha256": hashlib.sha256(text).hexdigest(),
        "text": text.decode("utf-8", errors="replace"),
    }


def _commit(source: Path | None) -> str | None:
    """Commit of the checkout that the scenario stands in, with '+' where files were changed."""
    folder = source.resolve().parent if source is not None else Path.cwd()

    def git(*words: str) -> str | None:
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
    return datetime.now(UTC).isoformat(timespec="milliseconds")
