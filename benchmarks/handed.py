"""Hands a benchmark case to a peer in another environment: a folder, and a process that takes turns.

The folder holds `robot.urdf` (no meshes, velocity limits as in the case), `case.json` and `poses.npy`; what
runs on the other side begins with `served.py`.
"""

import json
import subprocess
import tempfile
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree as ET

import cases
import numpy as np

from taskopt.arrays import Array

HERE = Path(__file__).parent
SHIPPED = {
    "panda": "panda_description/urdf/panda.urdf",
    "talos_reduced": "talos_data/robots/talos_reduced.urdf",
}


class Remote:
    """The script of a peer under an interpreter of its own, told block by block which ticks to run.

    Args:
        python: The interpreter.
        script: Name of the script in this folder.
        folder: What `hand_over` wrote.
        solver: Name of the QP solver.
        clock: "wall" or "cpu".
    """

    def __init__(self, python: str, script: str, folder: Path, solver: str, clock: str) -> None:
        command = [python, str(HERE / script), str(folder), solver, clock]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.name = json.loads(self._answer())

    def block(self, first: int, stop: int) -> Array:
        """Return the time of the ticks from `first` to `stop` [µs]; NaN from the one at which it gave up."""
        assert self._process.stdin is not None
        print(first, stop, file=self._process.stdin, flush=True)
        return np.array(json.loads(self._answer()), dtype=float)

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


def hand_over(case: cases.BenchmarkCase) -> Path:
    """Write the case into a temporary folder, and return that folder."""
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
        "dt": cases.DT,
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
