"""EmbodiK as a peer; started by `handed.py` in an interpreter that has it.

EmbodiK has strict levels by saturation in the null space, and scales a task that limits do not let it meet,
unless it is told to minimise the error. It has no weights between tasks, so that the tasks of a case are
levels: feet, hand, centre of mass, posture. "refined" is its own option that looks once more at scaled tasks
of rows; it changes nothing in a case.
"""

from types import SimpleNamespace

import embodik  # pyright: ignore[reportMissingImports]
import numpy as np
from served import Made, serve


class NoSuccess(Exception):
    """EmbodiK says that it found no answer."""


def stack(case: SimpleNamespace) -> Made:
    robot = embodik.RobotModel(case.urdf, floating_base=bool(case.base))
    q = np.array(robot.neutral_configuration())
    if case.base:
        q[:7] = case.base
    for joint, angle in case.angles.items():
        q[robot.get_joint_config_index(joint)] = angle
    robot.update_configuration(q)
    solver = embodik.KinematicsSolver(robot)
    solver.dt = case.dt
    solver.enable_velocity_limits(True)
    solver.enable_position_limits(True)
    hand = solver.add_frame_task("hand", case.hand)
    feet = [solver.add_frame_task(foot, foot) for foot in case.feet]
    for foot, name in zip(feet, case.feet, strict=True):
        pose = robot.get_frame_pose(name)
        foot.set_target_pose(np.array(pose.translation), np.asfortranarray(pose.rotation))
    balance = [solver.add_com_task("balance")] if case.base else []
    for task in balance:
        task.set_target_position(np.array(robot.get_com_position()))
    posture = solver.add_posture_task("posture")
    posture.set_target_configuration(q.copy())
    for priority, task in enumerate([*feet, hand, *balance, posture]):
        task.priority, task.weight = priority, 1.0 / case.dt
        task.solve_mode = embodik.TaskSolveMode.MIN_ERROR
    state = [q]

    def tick(i: int) -> None:
        pose = case.poses[i]
        hand.set_target_pose(pose[:3, 3].copy(), np.asfortranarray(pose[:3, :3]))
        found = solver.solve_velocity(state[0], True)
        if found.status != embodik.SolverStatus.SUCCESS:
            raise NoSuccess(f"{found.status} {found.status_message}")
        state[0] = robot.integrate(state[0], np.array(found.joint_velocities), case.dt)

    return "EmbodiK", tick


def rows(problems: list[SimpleNamespace], solver: str) -> Made:
    def answer(i: int) -> np.ndarray:
        one = problems[i]
        A, lower, upper = one.hard
        C = np.asfortranarray(np.vstack([np.eye(len(one.box[0])), A]))
        found = embodik.computeMultiObjectiveVelocitySolutionEigen(
            [b for _, b in one.levels],
            [np.asfortranarray(rows_of) for rows_of, _ in one.levels],
            C,
            np.clip(np.concatenate([one.box[0], lower]), -1e9, 1e9),
            np.clip(np.concatenate([one.box[1], upper]), -1e9, 1e9),
            refine_partial_scale=solver == "refined",
        )
        if found.status != embodik.SolverStatus.SUCCESS:
            raise NoSuccess(f"{found.status} {found.status_message}")
        return np.array(found.solution)

    return f"EmbodiK {solver}, levels", answer


if __name__ == "__main__":
    serve(stack, rows, NoSuccess)
