"""W1 through PlaCo, for an interpreter that has it: prints microseconds a tick as JSON.

    python placo_tick.py WORK TICKS WARM

PlaCo models a floating base (masked here by six equalities), has no gain (each tick goes all the way),
weighs squared errors, and lets a joint reach its limit in one tick.
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

VELOCITY_SCALE = {"W1": 1.0, "W1v": 0.51}
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
POSTURE = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
Q0 = {f"panda_joint{i}": value for i, value in enumerate(POSTURE, start=1)}
PANDA = "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"


def urdf(scale: float) -> str:
    """The Panda without meshes, fingers fixed, velocity limits scaled; the path of a temporary file."""
    paths = [Path(p) / PANDA for p in sys.path]
    root = ET.parse(next(p for p in paths if p.exists())).getroot()
    for link in root.findall("link"):
        for child in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(child)
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("name") in FINGERS:
            joint.set("type", "fixed")
            for child in [*joint.findall("mimic"), *joint.findall("limit"), *joint.findall("axis")]:
                joint.remove(child)
        elif limit is not None:
            limit.set("velocity", str(scale * float(limit.get("velocity", "0"))))
    out = Path(tempfile.mkdtemp()) / "panda.urdf"
    ET.ElementTree(root).write(out)
    return str(out)


def main() -> None:
    name, ticks, warm = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    robot = placo.RobotWrapper(urdf(VELOCITY_SCALE[name]), placo.Flags.ignore_collisions)
    for joint, value in Q0.items():
        robot.set_joint(joint, value)
    robot.update_kinematics()
    solver = robot.make_solver()
    solver.dt = 0.002
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.mask_fbase(True)
    start = robot.get_T_world_frame("panda_hand_tcp")
    hand = solver.add_frame_task("panda_hand_tcp", start)
    hand.configure("hand", "soft", 1.0, 1.0)
    posture = solver.add_joints_task()
    posture.set_joints({joint: robot.get_joint(joint) for joint in robot.joint_names()})
    posture.configure("posture", "soft", 1e-6)
    phase = np.pi * 0.002 * np.arange(1, ticks + 1)
    poses = np.repeat(start[None], ticks, axis=0)
    poses[:, 1, 3] += 0.1 * np.sin(phase)
    poses[:, 2, 3] += 0.1 * (1.0 - np.cos(phase))
    poses, times = list(poses), []
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
