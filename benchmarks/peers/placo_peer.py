"""PlaCo as a peer; started by `handed.py` in an interpreter that has it.

PlaCo models a floating base (masked for the Panda by six equalities), has no gain (each tick goes all
the way), weighs squared errors, and lets a joint reach its limit in one tick. Rows go to its problem solver
as hard constraints and soft ones with weights.
"""

from types import SimpleNamespace

import numpy as np
import placo  # pyright: ignore[reportMissingImports]
from served import RATIO, Made, serve


def stack(case: SimpleNamespace) -> Made:
    robot = placo.RobotWrapper(case.urdf, placo.Flags.ignore_collisions)
    for joint, angle in case.angles.items():
        robot.set_joint(joint, angle)
    robot.update_kinematics()
    if case.base:
        pose = np.eye(4)
        pose[:3, 3] = case.base[:3]  # upright in all cases
        robot.set_T_world_fbase(pose)
        robot.update_kinematics()
    solver = robot.make_solver()
    solver.dt = case.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.mask_fbase(not case.base)
    weights = case.weights
    hand = solver.add_frame_task(case.hand, robot.get_T_world_frame(case.hand))
    hand.configure("hand", "soft", weights["hand"], weights["hand"])
    for foot in case.feet:
        task = solver.add_frame_task(foot, robot.get_T_world_frame(foot))
        task.configure(foot, "hard" if case.hard else "soft", weights["feet"], weights["feet"])
    if case.base:
        solver.add_com_task(robot.com_world()).configure("com", "soft", weights["centre of mass"])
    posture = solver.add_joints_task()
    posture.set_joints(case.angles)
    posture.configure("posture", "soft", weights["posture"])
    poses = list(case.poses)

    def tick(i: int) -> None:
        hand.T_world_frame = poses[i]
        solver.solve(True)
        robot.update_kinematics()

    return "PlaCo eiquadprog", tick


def rows(problems: list[SimpleNamespace], solver: str) -> Made:
    def answer(i: int) -> np.ndarray:
        one, program = problems[i], placo.Problem()
        x = program.add_variable(len(one.box[0]))
        whole = x.expr()
        for A, lower, upper in ((np.eye(len(one.box[0])), *one.box), one.hard):
            held = whole.left_multiply(A)
            for side, kept in ((upper, held.__le__), (lower, held.__ge__)):
                if len(side):
                    program.add_constraint(kept(np.clip(side, -1e9, 1e9)))  # inf is no number to it
        for k, (A, b) in enumerate(one.levels):
            program.add_constraint(whole.left_multiply(A) == b).configure("soft", RATIO**k)
        program.add_constraint(whole == np.zeros(len(one.box[0]))).configure("soft", RATIO ** len(one.levels))
        program.solve()
        return np.array(x.value).ravel()

    return f"PlaCo {solver}, weights", answer


if __name__ == "__main__":
    serve(stack, rows, RuntimeError)
