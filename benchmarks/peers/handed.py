"""Hands a benchmark case, or problems, to a peer in another environment: a folder, and a process in turns.

The folder holds `robot.urdf` (no meshes, velocity limits as in the case), `case.json` and `poses.npy`; or
`problems.json`, hierarchies as rows. What runs on the other side calls `served.serve`.
"""

import json
import os
import subprocess
import tempfile
from collections.abc import Sequence
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree as ET

import cases
import numpy as np

from taskopt import Hierarchy
from taskopt.arrays import Array
from taskopt.errors import InvalidValue

HERE = Path(__file__).parent
SHIPPED = {
    "panda": "panda_description/urdf/panda.urdf",
    "talos_reduced": "talos_data/robots/talos_reduced.urdf",
}


class Remote:
    """The script of a peer under an interpreter of its own, told block by block which ticks to run.

    Args:
        python: The interpreter.
        script: Path of the script; a name alone is that of a script in this folder.
        folder: What `hand_over` or `hand_over_rows` wrote.
        solver: Name of the QP solver.
        clock: "wall" or "cpu".

    Attributes:
        name: What it calls itself.
        answers: Its answers to problems so far, (n,) each, None where it found none.
    """

    def __init__(self, python: str, script: str, folder: Path, solver: str, clock: str) -> None:
        command = [python, str(HERE / script), str(folder), solver, clock]
        own = {**os.environ, "PYTHONPATH": str(HERE)}  # where `served` is; this library is not there
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=own
        )
        self.name, self.answers = json.loads(self._answer()), list[list[float] | None]()

    def block(self, first: int, stop: int) -> Array:
        """Return the time of the ticks from `first` to `stop` [µs]; NaN from the one at which it gave up."""
        assert self._process.stdin is not None
        print(first, stop, file=self._process.stdin, flush=True)
        told = json.loads(self._answer())
        self.answers += told["answers"]
        return np.array(told["times"], dtype=float)

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"{self._process.args} ended; its own message stands above")
        return line

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def hand_over(case: cases.BenchmarkCase, dt: float = cases.DT, gain: float = cases.GAIN * cases.DT) -> Path:
    """Write the case into a temporary folder, and return that folder.

    Args:
        case: The case.
        dt: Δt [s].
        gain: Share of its error that the hand makes up in a tick.
    """
    folder = Path(tempfile.mkdtemp(prefix=f"taskopt-{case.name}-"))
    robot, weights = case.robot, cases.weights(case.name)
    floating = robot.nq != robot.nv
    angles = {
        name: float(case.q0[robot.position_index[robot.velocity_index(name).start]])
        for name in robot.joints
        if name != "root_joint"
    }
    told = {
        "hand": case.frame,
        "hard": "h" in case.name,
        "dt": dt,
        "gain": gain,
        "damping": cases.DAMPING,
        "kappa": cases.POSITION_GAIN,
        "weights": weights,
        "feet": list(cases.FEET) if floating else [],
        "angles": angles,
        "base": case.q0[:7].tolist() if floating else None,
        "speeds": robot_speeds(case),
    }
    (folder / "case.json").write_text(json.dumps(told), encoding="utf-8")
    np.save(folder / "poses.npy", np.array(case.poses))
    robots = distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots")
    _write_bare(Path(str(robots)) / SHIPPED[robot.name], folder / "robot.urdf", told["speeds"])
    return folder


def hand_over_rows(problems: Sequence[Hierarchy]) -> Path:
    """Write problems into a temporary folder, and return that folder.

    Args:
        problems: Hierarchies whose levels are equalities, and whose norm is 1. Rows are handed over times the
            root of their weight, which is the same problem.

    Raises:
        InvalidValue: A problem has other levels, or another norm.
    """
    folder = Path(tempfile.mkdtemp(prefix="taskopt-rows-"))
    told = []
    for problem in problems:
        levels = [problem.level(k) for k in range(1, problem.layout.level_count + 1)]
        if not all((one.lower == one.upper).all() for one in levels) or not (problem.norm == 1.0).all():
            raise InvalidValue(
                "levels have inequalities, or the norm has weights: not every peer states that"
            )
        roots = [np.sqrt(one.weight) for one in levels]
        end = int(problem.layout.offsets[1])
        hard = problem.A[:end], problem.lower[:end], problem.upper[:end]
        told.append(
            {
                "box": [problem.box_lower.tolist(), problem.box_upper.tolist()],
                "hard": [part.tolist() for part in hard],
                "levels": [
                    ((root[:, None] * one.A).tolist(), (root * one.upper).tolist())
                    for root, one in zip(roots, levels, strict=True)
                ],
            }
        )
    (folder / "problems.json").write_text(json.dumps(told), encoding="utf-8")
    return folder


def robot_speeds(case: cases.BenchmarkCase) -> dict[str, float]:
    """Return the velocity limit of each joint, as the case scales it [rad/s, m/s]."""
    scale = cases.VELOCITY_SCALE.get(case.name, 1.0)
    limit = case.robot.velocity_limit
    return {
        name: scale * float(limit[case.robot.velocity_index(name).start])
        for name in case.robot.joints
        if name != "root_joint"
    }


def _write_bare(source: Path, target: Path, speeds: dict[str, float]) -> None:
    """The robot without meshes, joints that the case locks fixed, velocity limits as given."""
    root = ET.parse(source).getroot()
    for child in [c for c in root if c.tag not in ("link", "joint")]:
        root.remove(child)
    for link in root.findall("link"):
        for child in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(child)
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("name") in speeds and limit is not None:
            limit.set("velocity", repr(speeds[str(joint.get("name"))]))
        elif joint.get("type") != "fixed":
            joint.set("type", "fixed")
            for tag in ("limit", "axis", "mimic", "dynamics", "safety_controller"):
                for child in joint.findall(tag):
                    joint.remove(child)
    ET.ElementTree(root).write(target)
