"""A benchmark case of `cases.py` through PlaCo, for an interpreter that has it; started by `tick.py`.

PlaCo models a floating base (masked for the Panda by six equalities), has no gain (each tick goes all
the way), weighs squared errors, and lets a joint reach its limit in one tick.
"""

import numpy as np
import placo  # pyright: ignore[reportMissingImports]
from served import handed_case, serve


def main() -> None:
    case = handed_case()
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

    serve("PlaCo eiquadprog", tick, RuntimeError)


if __name__ == "__main__":
    main()
