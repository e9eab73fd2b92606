"""mink as a peer; started by `handed.py` in an interpreter that has it.

mink reads the robot through MuJoCo's own URDF reader (a floating joint to the world where the base moves),
and weighs errors before they are squared, so that its costs are the roots of our weights. Rows go to it as a
task and a limit of one's own, on a robot of as many slides as there are unknowns.
"""

# MuJoCo ships no stubs that name its classes.
# pyright: reportAttributeAccessIssue=false

from types import SimpleNamespace
from xml.etree import ElementTree as ET

import mink  # pyright: ignore[reportMissingImports]
import mujoco  # pyright: ignore[reportMissingImports]
import numpy as np
from served import RATIO, DeclaredRows, Made, one_sided, serve, stated

FAILURE = mink.MinkError


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


def stack(case: SimpleNamespace) -> Made:
    model = loaded(case)
    configuration = started(case, model)
    cost = {name: float(np.sqrt(weight)) for name, weight in case.weights.items()}
    hand = mink.FrameTask(case.hand, "body", cost["hand"], cost["hand"], gain=case.gain)
    feet = [mink.FrameTask(foot, "body", cost["feet"], cost["feet"]) for foot in case.feet]
    balance = [mink.ComTask(cost=cost["centre of mass"])] if case.base else []
    posture = mink.PostureTask(model, cost=cost["posture"])
    for task in [hand, *feet, *balance, posture]:
        task.set_target_from_configuration(configuration)
    tasks = [hand, *([] if case.hard else feet), *balance, posture]
    limits = [mink.ConfigurationLimit(model, gain=case.kappa), mink.VelocityLimit(model, case.speeds)]
    poses = [mink.SE3.from_matrix(pose) for pose in case.poses]
    constraints = feet if case.hard else None

    def tick(i: int) -> np.ndarray:
        hand.set_target(poses[i])
        v = mink.solve_ik(
            configuration, tasks, case.dt, case.solver, case.damping, limits=limits, constraints=constraints
        )
        configuration.integrate_inplace(v, case.dt)
        return v

    return f"mink {case.solver}", tick


class Rows(DeclaredRows, mink.Task):
    """Rows as a task of mink."""


class Limits(mink.Limit):
    """The box and the hard rows of a problem as a limit."""

    def __init__(self, one: SimpleNamespace) -> None:
        self.kept = mink.Constraint(*one_sided(one))

    def compute_qp_inequalities(self, configuration: object, dt: float) -> mink.Constraint:  # noqa: ARG002
        return self.kept


def slides(n: int) -> mink.Configuration:
    """A robot of n slides, at zero."""
    root = ET.Element("mujoco")
    body = ET.SubElement(root, "worldbody")
    for k in range(n):
        body = ET.SubElement(body, "body", name=f"body {k}")
        ET.SubElement(body, "joint", type="slide")
        ET.SubElement(body, "geom", size="0.1")
    return mink.Configuration(mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode")))


def rows(problems: list[SimpleNamespace], solver: str) -> Made:
    made = stated(problems, slides, Rows, Limits)

    def answer(i: int) -> np.ndarray:
        configuration, tasks, limits = made[i]
        return mink.solve_ik(configuration, tasks, 1.0, solver, RATIO ** len(tasks), limits=limits)

    return f"mink {solver}, weights", answer


if __name__ == "__main__":
    serve(stack, rows, FAILURE)
