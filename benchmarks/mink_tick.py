"""A work of `works.py` through mink, for an interpreter that has it; started by `tick.py`.

mink reads the robot through MuJoCo's own URDF reader (a floating joint to the world where the base moves),
and weighs errors before they are squared, so that its costs are the roots of our weights.
"""

from xml.etree import ElementTree as ET

import mink
import mujoco
import numpy as np
from served import handed_work, serve


def loaded(work) -> mujoco.MjModel:
    """MuJoCo's model of the robot; frames stay bodies of their own."""
    root = ET.parse(work.urdf).getroot()
    settings = {
        "fusestatic": "false",
        "balanceinertia": "true",
        "boundmass": "1e-6",
        "boundinertia": "1e-9",
    }
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", settings)
    if work.base:
        ET.SubElement(root, "link", name="world")
        joint = ET.SubElement(root, "joint", name="root_joint", type="floating")
        ET.SubElement(joint, "parent", link="world")
        ET.SubElement(joint, "child", link="base_link")
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def started(work, model: mujoco.MjModel) -> mink.Configuration:
    q = model.qpos0.copy()
    for joint, angle in work.angles.items():
        q[model.jnt_qposadr[model.joint(joint).id]] = angle
    if work.base:
        at = model.jnt_qposadr[model.joint("root_joint").id]
        x, y, z, i, j, k, real = work.base
        q[at : at + 7] = x, y, z, real, i, j, k
    return mink.Configuration(model, q)


def main() -> None:
    work = handed_work()
    model = loaded(work)
    configuration = started(work, model)
    cost = {name: float(np.sqrt(weight)) for name, weight in work.weights.items()}
    hand = mink.FrameTask(work.hand, "body", cost["hand"], cost["hand"])
    feet = [mink.FrameTask(foot, "body", cost["feet"], cost["feet"]) for foot in work.feet]
    balance = [mink.ComTask(cost=cost["centre of mass"])] if work.base else []
    posture = mink.PostureTask(model, cost=cost["posture"])
    for task in [hand, *feet, *balance, posture]:
        task.set_target_from_configuration(configuration)
    tasks = [hand, *([] if work.hard else feet), *balance, posture]
    limits = [mink.ConfigurationLimit(model, gain=work.kappa), mink.VelocityLimit(model, work.speeds)]
    poses = [mink.SE3.from_matrix(pose) for pose in work.poses]
    constraints = feet if work.hard else None

    def tick(i: int) -> None:
        hand.set_target(poses[i])
        v = mink.solve_ik(
            configuration, tasks, work.dt, work.solver, work.damping, limits=limits, constraints=constraints
        )
        configuration.integrate_inplace(v, work.dt)

    serve(f"mink {work.solver}", tick, mink.MinkError)


if __name__ == "__main__":
    main()
