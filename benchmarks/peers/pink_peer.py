"""pink as a peer; started by `handed.py` in an interpreter that has it, and by `tick.py` in its own.

pink weighs errors before they are squared, so that its costs are the roots of our weights. Rows go to it as a
task and a limit of one's own, on a robot of as many slides as there are unknowns.
"""

# pink belongs to no extra of ours, and Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false

from types import SimpleNamespace

import numpy as np
import pink
import pinocchio as pin
from pink.exceptions import PinkError
from pink.limits import ConfigurationLimit, Limit, VelocityLimit
from pink.tasks import ComTask, FrameTask, PostureTask, Task
from served import RATIO, DeclaredRows, Made, one_sided, serve, stated

FAILURE = PinkError


class Stack:
    """A case in pink, through its documented loop.

    Args:
        case: The case, see `served.handed_case`.
    """

    def __init__(self, case: SimpleNamespace) -> None:
        root = [pin.JointModelFreeFlyer()] if case.base else []
        model, self.case = pin.buildModelFromUrdf(case.urdf, *root), case
        q = pin.neutral(model)
        if case.base:
            q[:7] = case.base
        for joint, angle in case.angles.items():
            q[model.joints[model.getJointId(joint)].idx_q] = angle
        self.configuration = pink.Configuration(model, model.createData(), q)
        cost = {name: float(np.sqrt(weight)) for name, weight in case.weights.items()}
        self.hand = FrameTask(case.hand, cost["hand"], cost["hand"], gain=case.gain)
        feet = [FrameTask(foot, cost["feet"], cost["feet"]) for foot in case.feet]
        balance = [ComTask(cost=cost["centre of mass"])] if case.base else []
        self.constraints = feet if case.hard else []
        self.tasks = [self.hand, *([] if case.hard else feet), *balance, PostureTask(cost=cost["posture"])]
        for task in [*self.tasks, *self.constraints]:
            task.set_target_from_configuration(self.configuration)
        self.limits = [ConfigurationLimit(model, case.kappa), VelocityLimit(model)]
        self.poses = [pin.SE3(pose) for pose in case.poses]

    def velocity(self) -> np.ndarray:
        """Return its answer at its own posture, (nv,) [rad/s, m/s]."""
        return pink.solve_ik(
            self.configuration,
            self.tasks,
            self.case.dt,
            solver=self.case.solver,
            damping=self.case.damping,
            limits=self.limits,
            constraints=self.constraints or None,
        )

    def tick(self, i: int) -> np.ndarray:
        """Do one tick, and return its velocity."""
        self.hand.set_target(self.poses[i])
        v = self.velocity()
        self.configuration.integrate_inplace(v, self.case.dt)
        return v

    def velocity_at(self, q: np.ndarray, i: int) -> np.ndarray:
        """Return its answer at another posture, (nv,) [rad/s, m/s]; this is not timed."""
        self.configuration.update(q)
        self.hand.set_target(self.poses[i])
        return self.velocity()


class Rows(DeclaredRows, Task):
    """Rows as a task of pink."""

    def __repr__(self) -> str:
        return f"Rows({len(self.b)})"


class Limits(Limit):
    """The box and the hard rows of a problem as a limit."""

    def __init__(self, one: SimpleNamespace) -> None:
        self.kept = one_sided(one)

    def compute_qp_inequalities(self, q: object, dt: float) -> tuple[np.ndarray, np.ndarray]:  # noqa: ARG002
        return self.kept


def slides(n: int) -> pink.Configuration:
    """A robot of n slides, at zero."""
    model = pin.Model()
    for k in range(n):
        model.addJoint(k, pin.JointModelPX(), pin.SE3.Identity(), f"slide {k}")
    return pink.Configuration(model, model.createData(), np.zeros(n))


def stack(case: SimpleNamespace) -> Made:
    return f"pink {case.solver}", Stack(case).tick


def rows(problems: list[SimpleNamespace], solver: str) -> Made:
    made = stated(problems, slides, Rows, Limits)

    def answer(i: int) -> np.ndarray:
        configuration, tasks, limits = made[i]
        return pink.solve_ik(configuration, tasks, 1.0, solver, damping=RATIO ** len(tasks), limits=limits)

    return f"pink {solver}, weights", answer


if __name__ == "__main__":
    serve(stack, rows, FAILURE)
