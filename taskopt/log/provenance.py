"""What a log says about where it comes from: versions, machine, commit, the text of a scenario."""

import hashlib
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TypeAlias

import numpy as np

Json: TypeAlias = "Mapping[str, Json] | Sequence[Json] | str | int | float | bool | None"

PACKAGES = (
    "taskopt", "numpy", "scipy", "numba", "pin", "coal", "daqp", "proxsuite", "clarabel", "qpsolvers",
    "cvxpy", "quadprog", "piqp", "osqp", "scs", "highspy", "rerun-sdk", "pyarrow", "example-robot-data",
)  # fmt: skip


def plain(value: object) -> Json:
    """Turn a setting into plain data for JSON.

    Args:
        value: A number, text, truth value or array; or a target that moves.

    Returns:
        The same as plain data; a target that moves as its text.
    """
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


def source_of(source: Path | None) -> dict[str, Json]:
    """Read the file of a scenario, whose text is kept for readers and never executed.

    Args:
        source: The file; None if the scenario was made in code.

    Returns:
        Its name, hash and text; nothing if there is no file.
    """
    if source is None or not source.is_file():
        return {}
    text = source.read_bytes()
    return {
        "file": str(source),
        "sha256": hashlib.sha256(text).hexdigest(),
        "text": text.decode("utf-8", errors="replace"),
    }


def commit_of(source: Path | None) -> str | None:
    """Find the commit of the checkout that holds a scenario.

    Args:
        source: The file of the scenario; None for the working directory.

    Returns:
        The commit, with "+" if files were changed since; None outside a checkout.
    """
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


def now() -> str:
    """Return the present time in UTC, as ISO 8601 text."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
