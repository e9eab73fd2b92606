"""A benchmark case of `cases.py` through mink, for an interpreter that has it; started by `tick.py`.

mink reads the robot through MuJoCo's own URDF reader (a floating joint to the world where the base moves),
and weighs errors before they are squared, so that its costs are the roots of our weights.
"""

# MuJoCo ships no stubs that name its classes.
# pyright: reportAttributeAccessIssue=false

from xml.etree import ElementTree as ET

import mink  # pyright: ignore[reportMissingImports]
import mujoco  # pyright: ignore[reportMissingImports]
import numpy as np
from served import handed_case, serve


def loaded(case) -> mujoco.MjModel:
    """MuJoCo's model of the robot; frames stay bodies of their own."""
    root = ET.parse(case.urdf).getroot()
    settings = {
        "fusestatic": "false",
        "balanceinertia": "true",
        "boundmass": "1e-6",
        "boundinertia": "1e-9",
    }
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", settings)
    if case.base:
        ET.SubElement(root, "link", name="world")
        joint = ET.SubElement(root, "joint", name="root_joint", type="floating")
        ET.SubElement(joint, "parent", link="world")
        ET.SubElement(joint, "child", link="base_link")
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def started(case, model: mujoco.MjModel) -> mink.Configuration:
    q = model.qpos0.copy()
    for joint, angle in case.angles.items():
        q[model.jnt_qposadr[model.joint(joint).id]] = angle
    if case.base:
        at = model.jnt_qposadr[model.joint("root_joint").id]
        x, y, z, i, j, k, real = case.base
        q[at : at + 7] = x, y, z, real, i, j, k
    return mink.Configuration(model, q)


def main() -> None:
    case = handed_case()
    model = loaded(case)
    configuration = started(case, model)
    cost = {name: float(np.sqrt(weight)) for name, weight in case.weights.items()}
    hand = mink.FrameTask(case.hand, "body", cost["hand"], cost["hand"])
    feet = [mink.FrameTask(foot, "body", cost["feet"], cost["feet"]) for foot in case.feet]
    balance = [mink.ComTask(cost=cost["centre of mass"])] if case.base else []
    posture = mink.PostureTask(model, cost=cost["posture"])
    for task in [hand, *feet, *balance, posture]:
        task.set_target_from_configuration(configuration)
    tasks = [hand, *([] if case.hard else feet), *balance, posture]
    limits = [mink.ConfigurationLimit(model, gain=case.kappa), mink.VelocityLimit(model, case.speeds)]
    poses = [mink.SE3.from_matrix(pose) for pose in case.poses]
    constraints = feet if case.hard else None

    def tick(i: int) -> None:
        hand.set_target(poses[i])
        v = mink.solve_ik(
            configuration, tasks, case.dt, case.solver, case.damping, limits=limits, constraints=constraints
        )
        configuration.integrate_inplace(v, case.dt)

    serve(f"mink {case.solver}", tick, mink.MinkError)


if __name__ == "__main__":
    main()
