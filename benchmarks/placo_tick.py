"""A work of `works.py` through PlaCo, for an interpreter that has it; started by `tick.py`.

PlaCo models a floating base (masked for the Panda by six equalities), has no gain (each tick goes all
the way), weighs squared errors, and lets a joint reach its limit in one tick.
"""

import numpy as np
import placo
from served import handed_work, serve


def main() -> None:
    work = handed_work()
    robot = placo.RobotWrapper(work.urdf, placo.Flags.ignore_collisions)
    for joint, angle in work.angles.items():
        robot.set_joint(joint, angle)
    robot.update_kinematics()
    if work.base:
        pose = np.eye(4)
        pose[:3, 3] = work.base[:3]  # upright in both works
        robot.set_T_world_fbase(pose)
        robot.update_kinematics()
    solver = robot.make_solver()
    solver.dt = work.dt
    solver.enable_joint_limits(True)
    solver.enable_velocity_limits(True)
    solver.mask_fbase(not work.base)
    weights = work.weights
    hand = solver.add_frame_task(work.hand, robot.get_T_world_frame(work.hand))
    hand.configure("hand", "soft", weights["hand"], weights["hand"])
    for foot in work.feet:
        task = solver.add_frame_task(foot, robot.get_T_world_frame(foot))
        task.configure(foot, "hard" if work.hard else "soft", weights["feet"], weights["feet"])
    if work.base:
        solver.add_com_task(robot.com_world()).configure("com", "soft", weights["centre of mass"])
    posture = solver.add_joints_task()
    posture.set_joints(work.angles)
    posture.configure("posture", "soft", weights["posture"])
    poses = list(work.poses)

    def tick(i: int) -> None:
        hand.T_world_frame = poses[i]
        solver.solve(True)
        robot.update_kinematics()

    serve("PlaCo eiquadprog", tick, RuntimeError)


if __name__ == "__main__":
    main()
