"""The closed form of W1s for many arms in plain NumPy, without bounds and without proof.

It is what a user writes without a compiler: arrays with one entry for each arm, in blocks that fit into the
cache, and LAPACK for the 6 × 6 systems.
"""

from collections.abc import Sequence

import numpy as np

from taskopt import Robot
from taskopt.arrays import Array

BLOCK = 512  # arms
Vector = Sequence[Array] | Array


class NumpyArms:
    """Pandas whose hands follow poses strictly, above a posture.

    Args:
        robot: A chain of revolute joints.
        frame: Name of the frame at its end.
        gain: K of both tasks [1/s].
    """

    def __init__(self, robot: Robot, frame: str, gain: float) -> None:
        model = robot.model
        self.gain = gain
        self.axes = ["XYZ".index(joint.shortname()[-1]) for joint in list(model.joints)[1:]]
        self.places = [place.homogeneous for place in list(model.jointPlacements)[1:]]
        self.last = model.frames[robot.frame_id(frame)].placement.homogeneous

    def step(self, q: Array, goals: Array, posture: Array) -> Array:
        """Return the velocities (N, n) [rad/s] for postures (N, n) [rad] and goals (N, 4, 4)."""
        v = np.empty_like(q)
        for first in range(0, len(q), BLOCK):
            part = slice(first, first + BLOCK)
            v[part] = self._block(q[part], goals[part], posture)
        return v

    def _block(self, q: Array, goals: Array, posture: Array) -> Array:
        """Return the velocities of one block: x0 + Aᵀ (A Aᵀ)⁻¹ (b − A x0)."""
        A, b = self._rows(q.T.copy(), goals.transpose(1, 2, 0).copy())
        x0 = self.gain * (posture - q)
        missing = b - np.matmul(A, x0[:, :, None])
        dual = np.linalg.solve(np.matmul(A, A.transpose(0, 2, 1)), missing)
        return x0 + np.matmul(A.transpose(0, 2, 1), dual)[:, :, 0]

    def _rows(self, q: Array, goal: Array) -> tuple[Array, Array]:
        """Return the rows (N, 6, n) and right-hand sides (N, 6, 1) of the hand, in its own axes."""
        R, p, origins, turns = self._forward(q)
        X = [[_dot(goal[:3, i], R[j]) for j in range(3)] for i in range(3)]
        moved = [p[k] - goal[k, 3] for k in range(3)]
        t = [_dot(goal[:3, i], moved) for i in range(3)]
        log, jlog3, coupling = _log6(X, t)
        A = np.empty((q.shape[1], 6, len(q)))
        for j, (origin, w) in enumerate(zip(origins, turns, strict=True)):
            linear = _cross(w, [p[k] - origin[k] for k in range(3)])
            v = [_dot(R[i], linear) for i in range(3)]
            w = [_dot(R[i], w) for i in range(3)]
            for i in range(3):
                A[:, i, j] = _dot(jlog3[i], v) + _dot(coupling[i], w)
                A[:, 3 + i, j] = _dot(jlog3[i], w)
        return A, -self.gain * np.stack(log, axis=1)[:, :, None]

    def _forward(self, q: Array) -> tuple[list[Vector], Vector, list[Vector], list[Vector]]:
        """Return the columns of the hand's rotation, its origin, and origin and axis of each joint."""
        zero, one = np.zeros(q.shape[1]), np.ones(q.shape[1])
        R: list[Vector] = [[one, zero, zero], [zero, one, zero], [zero, zero, one]]
        p: Vector = [zero, zero, zero]
        origins, turns = [], []
        for angle, axis, place in zip(q, self.axes, self.places, strict=True):
            R, p = _placed(R, p, place)
            c, s = np.cos(angle), np.sin(angle)
            k, m = (axis + 1) % 3, (axis + 2) % 3
            turned = [c * R[k][i] + s * R[m][i] for i in range(3)]
            R[m] = [c * R[m][i] - s * R[k][i] for i in range(3)]
            R[k] = turned
            origins.append(p)
            turns.append(R[axis])
        R, p = _placed(R, p, self.last)
        return R, p, origins, turns


def _placed(R: list[Vector], p: Vector, place: Array) -> tuple[list[Vector], Vector]:
    """Return the pose of a frame that stands in another one."""
    rows = [[R[k][i] for k in range(3)] for i in range(3)]
    columns: list[Vector] = [[_dot(place[:3, c], row) for row in rows] for c in range(3)]
    return columns, [p[i] + _dot(place[:3, 3], rows[i]) for i in range(3)]


def _dot(a: Vector, b: Vector) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> list[Array]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _log6(R: Sequence[Vector], p: Vector) -> tuple[list[Array], list[Vector], list[Vector]]:
    """Return the logarithm of poses, and the two blocks of its derivative, for angles below 1 rad."""
    half = [0.5 * (R[2][1] - R[1][2]), 0.5 * (R[0][2] - R[2][0]), 0.5 * (R[1][0] - R[0][1])]
    sine = np.sqrt(_dot(half, half))
    angle = np.arctan2(sine, 0.5 * (R[0][0] + R[1][1] + R[2][2] - 1.0))
    w = [part * np.where(sine > 1e-8, angle / np.maximum(sine, 1e-8), 1.0) for part in half]
    t2 = angle * angle
    beta = 1.0 / 12.0 + t2 * (1.0 / 720.0 + t2 * (1.0 / 30240.0 + t2 * (1.0 / 1209600.0 + t2 / 47900160.0)))
    gamma = 1.0 / 360.0 + t2 * (1.0 / 7560.0 + t2 * (1.0 / 201600.0 + t2 / 5987520.0))
    alpha, dot, turned = 1.0 - t2 * beta, _dot(w, p), _cross(w, p)
    log = [alpha * p[i] - 0.5 * turned[i] + beta * dot * w[i] for i in range(3)] + w
    skew, moved = _skew(w), _skew(p)
    A: list[Vector] = [
        [beta * w[i] * w[j] + 0.5 * skew[i][j] + (alpha if i == j else 0.0) for j in range(3)]
        for i in range(3)
    ]
    C = [
        [
            (gamma * dot * w[i] - (gamma * t2 + 2.0 * beta) * p[i]) * w[j]
            + beta * w[i] * p[j] + 0.5 * moved[i][j] + (beta * dot if i == j else 0.0)
            for j in range(3)
        ]
        for i in range(3)
    ]  # fmt: skip
    return log, A, [[_dot(C[i], [A[k][j] for k in range(3)]) for j in range(3)] for i in range(3)]


def _skew(a: Vector) -> list[list[Array | float]]:
    return [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]
