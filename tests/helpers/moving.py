"""Targets that move, rows that are filled, and the derivative of a task's error as an oracle."""

import numpy as np

from taskopt.arrays import Array
from taskopt.hierarchy.problem import LevelRows
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.pose import exp6
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.target import Function
from taskopt.kinematics.task import BoundTask, Task
from tests.helpers.robots import generic_q


def tumbling(pose: Array, seed: int, speed: float = 1.0) -> Function:
    """A screw motion about a generic axis near `pose`, with its exact twist in world axes."""
    rng = np.random.default_rng(seed)
    near, twist = pose @ exp6(0.5 * rng.normal(size=6)), speed * rng.normal(size=6)

    def rate(t: float) -> Array:
        R = (near @ exp6(t * twist))[:3, :3]
        return np.concatenate([R @ twist[:3], R @ twist[3:]])

    return Function(lambda t: near @ exp6(t * twist), rate)


def fresh_rows(task: BoundTask, nv: int) -> LevelRows:
    """Rows as a plan hands them over, prepared."""
    m = len(task.row_names)
    rows = LevelRows(np.zeros((m, nv)), np.zeros(m), np.zeros(m), np.ones(m))
    task.prepare(rows)
    return rows


def bound(task: Task, at: Configuration, t: float = 0.0) -> tuple[BoundTask, LevelRows]:
    """The task bound to the robot and started there, and rows that have been filled once."""
    ready = task.bind(at.robot, "task")
    ready.start(at, t)
    rows = fresh_rows(ready, at.robot.nv)
    ready.fill(at, t, rows)
    return ready, rows


def derivative_mismatch(task: Task, of: Robot, seed: int, t: float = 0.3, h: float = 1e-5) -> float:
    """max |ė − (ẋ_d − A v)| with ė by central differences along a generic v, on the manifold.

    ẋ_d = b − K e is what the task adds for its moving target; a right task has no mismatch but the
    truncation of the differences.
    """
    q, v = generic_q(of, seed), np.random.default_rng(seed + 1).normal(size=of.nv)
    start = Configuration(of, generic_q(of, seed + 2))
    ready, rows = bound(task, start)

    def error(s: float) -> Array:
        ready.fill(Configuration(of, of.integrate(q, v, s)), t + s, rows)
        return ready.error.copy()

    numeric = (error(h) - error(-h)) / (2.0 * h)
    ready.fill(Configuration(of, q), t, rows)
    feedforward = rows.lower - ready.gain * ready.error
    return float(np.abs(numeric - (feedforward - rows.A @ v)).max())
