"""The motions of the package `pink_motions`, run through pink and through ours at the same postures.

    pip install pink_motions pin-pink==4.4.0 quadprog example-robot-data
    python benchmarks/accept/motions_of_pink.py             # all of them; writes motions_of_pink.txt
    python benchmarks/accept/motions_of_pink.py --only ur5  # some of them, without writing

A motion states a robot, a start, frame tasks with costs and gains, targets over 10 s, and limits. pink solves
the stack in one weighted program with the damping 1e-12. Ours has the same rows with cost² as weight and
gain/Δt as gain, the same limits, and the same damping twice: "in one level" beside the tasks, as in pink, and
"on a level below" them, where it decides exactly what the tasks leave free. Each tick is solved by all three
at the same posture and with the same targets; the second of ours moves the robot. If the start is outside the
position limits, where pink stops by design, the motion is run again from the nearest start inside them.

`pink_motions` fetches its robots from the network. Here it is handed those that `example-robot-data` has,
also under another name; all others are named as not run. A difference is that of our velocity from pink's,
relative to the largest entry of pink's and to 1 rad/s or m/s.
"""

# pink and pink_motions belong to no extra of ours, and Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false, reportMissingTypeStubs=false

import argparse
import sys
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from taskopt import (
    Controller,
    DampingTask,
    FrameTask,
    JointPositionLimit,
    JointVelocityLimit,
    Latest,
    Resolution,
    Robot,
    Stack,
)
from taskopt.arrays import Array
from taskopt.errors import TaskoptError

ROBOTS = {
    "bolt_description": "bolt",
    "gen2_description": "kinova",
    "icub_description": "icub",
    "panda_description": "panda",
    "romeo_description": "romeo",
    "talos_description": "talos_full_v2",
    "ur10_official_description": "ur10_robot",
    "ur3_official_description": "ur3_robot",
    "ur5_official_description": "ur5_robot",
    "z1_description": "z1",
}
DT = 5e-3  # [s]
DAMPING, POSITION_GAIN = 1e-12, 0.5  # pink's defaults
WAYS = "in one level", "on a level below"
OUTPUT = Path(__file__).with_suffix(".txt")


class Outcome(NamedTuple):
    """What came of one motion.

    Attributes:
        start: Where it started, in words.
        ticks: Number of ticks.
        claimed: Ticks that both of ours claim, with small KKT residuals; this is no proof.
        solved: Ticks that pink solved.
        apart: Differences of our two velocities from pink's at each tick that all solved, (k, 2).
        ours: Reasons of ours for the other ticks, with their numbers.
        pinks: Reasons of pink for the other ticks, with their numbers.
    """

    start: str
    ticks: int
    claimed: int
    solved: int
    apart: Array
    ours: Counter[str]
    pinks: Counter[str]

    def __str__(self) -> str:
        """Return one line, and a line for each reason."""
        line = f"{self.start}: ours claimed {self.claimed} of {self.ticks}, pink solved {self.solved}"
        for way, apart in zip(WAYS, self.apart.T, strict=True):
            if not apart.size:
                continue
            line += f"; {way} {np.median(apart):.0e}, {np.percentile(apart, 99):.0e}, {apart.max():.0e}"
        told = [("ours", self.ours), ("pink", self.pinks)]
        return "\n".join(
            [line, *(f"    {who}, {n} ticks: {why}" for who, whys in told for why, n in whys.items())]
        )


def scene_of(scenario: Any, robot: Robot) -> Any:
    """Return the scene of a scenario of pink_motions, on a copy of the tree of a robot of ours."""
    from pink_motions import scene

    def handed(description_name: str, root_joint: object) -> pin.RobotWrapper:  # noqa: ARG001
        return pin.RobotWrapper(robot.model.copy())

    fetch, scene.load_robot_description = scene.load_robot_description, handed
    try:
        return scene.Scene(replace(scenario, trajectories=deepcopy(scenario.trajectories)))
    finally:
        scene.load_robot_description = fetch


def our_stacks(scene: Any, targets: list[Latest]) -> tuple[Stack, Stack]:
    """Return the stack of a scene in our words, with the damping in one level, and on a level below."""
    tasks = [
        FrameTask(task.frame, target=target, gain=task.gain / DT, weight=task.cost**2, name=f"task {i}")
        for i, (task, target) in enumerate(zip(scene.tasks, targets, strict=True))
    ]
    for task in scene.tasks:
        if task.lm_damping:
            raise ValueError(f"the task of {task.frame} has a damping of its own, which is not translated")
    speed = scene.scenario.velocity_limit
    limits = [JointPositionLimit(POSITION_GAIN), JointVelocityLimit(velocity=speed)]
    damping = DampingTask(DAMPING)
    return Stack([[*tasks, damping]], limits), Stack([tasks, [damping]], limits)


class Duel:
    """One motion in both.

    Args:
        scene: The scene of pink_motions.
        robot: The robot, without couplings, since pink knows none.
        q: Start, (nq,) [rad, m].
    """

    def __init__(self, scene: Any, robot: Robot, q: Array) -> None:
        self.scene, self.q = scene, q
        self._targets = [Latest(np.eye(4)) for _ in scene.tasks]
        self._controls = [Controller(robot, stack, dt=DT) for stack in our_stacks(scene, self._targets)]
        self.robot = robot

    def tick(self, t: float) -> tuple[list[Resolution] | str, Array | str]:
        """Move the targets and solve in all ways.

        Args:
            t: Time [s].

        Returns:
            Our two answers and pink's velocity, or the reason why there is none.
        """
        self.scene.step_targets(DT)
        for target, task in zip(self._targets, self.scene.tasks, strict=True):
            target.set(task.transform_target_to_world.np)
        try:
            mine: list[Resolution] | str = [control.step(self.q, t) for control in self._controls]
        except TaskoptError as error:
            mine = f"{type(error).__name__}: {str(error).splitlines()[0]}"
        return mine, self._pinks()

    def _pinks(self) -> Array | str:
        """Return pink's velocity at the present posture, or the reason why there is none."""
        from pink import solve_ik
        from pink.exceptions import PinkError

        configuration = self.scene.configuration
        configuration.update(self.q)
        try:
            return solve_ik(configuration, self.scene.tasks, DT, "quadprog", limits=self.scene.limits)
        except PinkError as error:
            return type(error).__name__


def play(scene: Any, robot: Robot, q: Array, start: str, ticks: int) -> Outcome:
    """Run a motion through both.

    Args:
        scene: The scene of pink_motions, reset.
        robot: The robot.
        q: Start, (nq,) [rad, m].
        start: The start in words.
        ticks: Number of ticks.

    Returns:
        What came of it.
    """
    duel, apart, ours, pinks = Duel(scene, robot, q), [], Counter[str](), Counter[str]()
    claimed = solved = k = 0
    while k < ticks:
        mine, theirs = duel.tick(k * DT)
        k += 1
        solved += not isinstance(theirs, str)
        pinks.update([theirs] if isinstance(theirs, str) else [])
        if isinstance(mine, str):
            ours.update([f"{mine}; stopped there"])
            break
        lost = [f"not claimed, {one.status.name}" for one in mine if not one.kkt_met()]
        claimed += not lost
        ours.update(lost[:1])
        if not isinstance(theirs, str):
            apart.append([difference(one.v, theirs) for one in mine])
        duel.q = robot.integrate(duel.q, mine[1].v, DT)
    return Outcome(start, k, claimed, solved, np.array(apart).reshape(-1, 2), ours, pinks)


def difference(mine: Array, theirs: Array) -> float:
    """Return the largest difference of two velocities, relative to the largest of pink's and to 1."""
    return float(np.abs(mine - theirs).max() / max(1.0, np.abs(theirs).max()))


def outcomes(name: str, ticks: int | None = None) -> list[Outcome] | str:
    """Run one motion of pink_motions, from its start, and from inside the limits if that is outside.

    Args:
        name: Name of the motion.
        ticks: Number of ticks; None: all.

    Returns:
        What came of each run, or the reason why the motion was not run.
    """
    from pink_motions import SCENARIOS

    scenario = SCENARIOS[name]
    if scenario.robot_description not in ROBOTS:
        return f"not run: {scenario.robot_description} is fetched from the network, and not in the extra"
    loaded = Robot.load(ROBOTS[scenario.robot_description], floating=scenario.root_joint is not None)
    robot = Robot(loaded.model, name=loaded.name)
    ticks = ticks or round(scenario.duration / DT)
    try:
        scene = scene_of(scenario, robot)
    except (IndexError, KeyError, ValueError) as error:
        return f"not run: {ROBOTS[scenario.robot_description]} does not fit: {str(error).splitlines()[0]}"
    missing = [task.frame for task in scene.tasks if not robot.model.existFrame(task.frame)]
    if missing:
        return f"not run: {robot.name} has no frame {', '.join(missing)}"
    q, outside = scene.q_init, robot.outside(scene.q_init)
    if not outside:
        return [play(scene, robot, q, "from its start", ticks)]
    where = f"from its start, where {len(outside)} joints are outside their limits"
    inside = np.array(q)
    has = robot.position_index >= 0
    places = robot.position_index[has]
    inside[places] = np.clip(q[places], robot.position_lower[has], robot.position_upper[has])
    runs = [play(scene, robot, q, where, ticks)]
    return [*runs, play(scene_of(scenario, robot), robot, inside, "from inside the limits", ticks)]


def main() -> int:
    """Print what came of every motion."""
    parser = argparse.ArgumentParser(description="The motions of pink_motions in pink and in ours.")
    parser.add_argument("--only", nargs="+", default=None, metavar="MOTION")
    only = parser.parse_args().only
    try:
        from pink_motions import SCENARIOS
    except ImportError as error:
        sys.exit(f"{error}; pip install pink_motions pin-pink==4.4.0 quadprog example-robot-data")
    text = ["differences: median, 99 %, largest", ""]
    print(*text, sep="\n")
    for name in only or SCENARIOS:
        found = outcomes(name)
        lines = found if isinstance(found, str) else "\n  ".join(["", *map(str, found)])
        robot = ROBOTS.get(SCENARIOS[name].robot_description)
        text.append(f"{name}{f' ({robot})' if robot else ''}: {lines}")
        print(text[-1], flush=True)
    if only is None:
        OUTPUT.write_text("\n".join(text) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
