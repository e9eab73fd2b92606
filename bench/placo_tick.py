"""W1 or W2 through PlaCo, for an interpreter that has it: prints microseconds a tick as JSON.

    python placo_tick.py WORK TICKS WARM

PlaCo models a floating base (masked for the Panda by six equalities), has no gain (each tick goes all
the way), weighs squared errors, and lets a joint reach its limit in one tick.
"""

import gc
import json
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from time import perf_counter_ns

import numpy as np
import placo

VELOCITY_SCALE = {"W1v": 0.51}
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
PANDA = {
    f"panda_joint{i + 1}": angle for i, angle in enumerate([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
}
BENT = {
    "gripper_left_joint": -0.1,
    "gripper_right_joint": -0.1,
    "arm_left_4_joint": -1.3,
    "arm_right_4_joint": -1.3,
}
FEET = ("left_sole_link", "right_sole_link")


def shipped(path: str) -> Path:
    """A file of example-robot-data."""
    folders = [Path(p) / "cmeel.prefix/share/example-robot-data/robots" for p in sys.path]
    return next(folder / path for folder in folders if (folder / path).exists())


def bare(path: Path, scale: float) -> str:
    """The robot without meshes, fingers fixed, velocity limits scaled; the path of a temporary file."""
    root = ET.parse(path).getroot()
    for link in root.findall("link"):
        for child in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(child)
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("name") in FINGERS:
            joint.set("type", "fixed")
            for child in [*joint.findall("mimic"), *joint.findall("limit"), *joint.findall("axis")]:
                joint.remove(child)
        elif limit is not None and limit.get("velocity"):
            limit.set("velocity", str(scale * float(limit.get("velocity", "0"))))
    out = Path(tempfile.mkdtemp()) / "robot.urdf"
    ET.ElementTree(root).write(out)
    return str(out)


def half_sitting() -> tuple[dict[str, float], list[float]]:
    """Joint angles and base pose of the shipped posture, arms bent."""
    root = ET.parse(shipped("talos_data/srdf/talos.srdf")).getroot()
    state = next(g for g in root.findall("group_state") if g.get("name") == "half_sitting")
    values = {j.get("name", ""): j.get("value", "") for j in state.findall("joint")}
    base = [float(x) for x in values.pop("root_joint").split()]
    return {name: float(value) for name, value in values.items()} | BENT, base


def loaded(work: str) -> tuple[placo.RobotWrapper, str]:
    """The robot at its start, and the name of its hand."""
    talos = work.startswith("W2")
    path = "talos_data/robots/talos_reduced.urdf" if talos else "panda_description/urdf/panda.urdf"
    robot = placo.RobotWrapper(
        bare(shipped(path), VELOCITY_SCALE.get(work, 1.0)), placo.Flags.ignore_collisions
    )
    angles, base = half_sitting() if talos else (PANDA, [0.0] * 7)
    for joint in robot.joint_names():
        if joint in angles:
            robot.set_joint(joint, angles[joint])
    robot.update_kinematics()
    if talos:
        pose = np.eye(4)
        pose[:3, 3] = base[:3]
        robot.set_T_world_fbase(pose)
        robot.update_kinematics()
    return robot, "gripper_right_base_link" if talos else "panda_hand_tcp"


def main() -> None:
    name, ticks, warm = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    talos = name.startswith("W2")
    robot, frame = loaded(name)
    solver = robot.make_solver()
    solver.dt = 0.002
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.mask_fbase(not talos)
    start = robot.get_T_world_frame(frame)
    hand = solver.add_frame_task(frame, start)
    hand.configure("hand", "soft", 1.0, 1.0)
    for foot in FEET if talos else ():
        solver.add_frame_task(foot, robot.get_T_world_frame(foot)).configure(foot, "soft", 100.0, 100.0)
    if talos:
        solver.add_com_task(robot.com_world()).configure("com", "soft", 1.0)
    posture = solver.add_joints_task()
    posture.set_joints({joint: robot.get_joint(joint) for joint in robot.joint_names()})
    posture.configure("posture", "soft", 1e-4 if talos else 1e-6)
    phase = np.pi * 0.002 * np.arange(1, ticks + 1)
    path = np.repeat(start[None], ticks, axis=0)
    path[:, 1, 3] += 0.1 * np.sin(phase)
    path[:, 2, 3] += 0.1 * (1.0 - np.cos(phase))
    poses, times = list(path), []
    gc.disable()
    for pose in poses:
        begin = perf_counter_ns()
        hand.T_world_frame = pose
        solver.solve(True)
        robot.update_kinematics()
        times.append((perf_counter_ns() - begin) * 1e-3)
    print(json.dumps(times[warm:]))


if __name__ == "__main__":
    main()
