"""The manifest of a log, a JSON file with everything that is needed to judge or repeat the run."""

import json
import platform
from pathlib import Path
from tempfile import TemporaryFile

from taskopt.log.provenance import Json, commit_of, machine, now, versions
from taskopt.loop.run_log import scenario_facts
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo

FILE = "manifest.json"
RESERVE = 1 << 16  # bytes that are kept for the end of a manifest, on a disk that becomes full


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
        self._reserve = TemporaryFile(dir=self.path.parent)  # noqa: SIM115 (closed at the end)
        self._reserve.write(bytes(RESERVE))
        self._reserve.flush()
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
        self._content["ended"] = now()
        self._reserve.close()
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
        Plain data for JSON: scenario with its text, robot, start posture, order and units of the
        unknowns, resolvers, seed, time, commit,
        versions and machine.
    """
    scenario = info.scenario
    return {
        "scenario": scenario_facts(scenario, info.source),
        "robot": {"name": scenario.robot.name, "nq": scenario.robot.nq, "nv": scenario.robot.nv},
        "q0": scenario.start.tolist(),
        "order": scenario.stack.order,
        "unknowns": dict(zip(info.plan.layout.unknowns, info.plan.layout.unknown_units, strict=True)),
        "resolvers": list(info.resolvers),
        "seed": info.seed,
        "started": now(),
        "git_commit": commit_of(info.source),
        "python": platform.python_version(),
        "versions": versions(),
        "machine": machine(),
    }
