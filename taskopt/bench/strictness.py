"""What "strict" is worth: level 1 under a projected cost, under weights, and under strict levels.

The Panda's hand is to move at 0.6 m/s in a random direction, the posture goes home below it, and velocity
limits bind. Kept are the cases in which level 1 can be met in full, which SciPy's bounded least squares
(BVLS) decides and no resolver of ours, and in which a limit is active when it is. One QP weighs the posture
by w: plain, ½ w ‖v − u‖², or projected, ½ w ‖N (v − u)‖² with N = I − J†J, which is strict as long as no
limit is active.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text
from scipy.optimize import lsq_linear

from taskopt.arrays import Array
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.kinematics.collision.pairs import random_posture
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.resolver.active_set.resolver import ActiveSet
from taskopt.resolver.regret import level_residuals, regret

SPEED = 0.6  # [m/s]
WEIGHTS = (1e-2, 1e-4)
HOME_GAIN = 1.0  # [1/s]
MET = 1e-9  # [m/s] a row of level 1 counts as met
WAYS = ("strict", *(f"{kind}, w = {w:g}" for kind in ("projected", "soft") for w in WEIGHTS))


@dataclass
class Way:
    """One way to give the hand priority: residual of level 1 [m/s] and leak of both levels, case by case."""

    name: str
    residual: list[float] = field(default_factory=list)
    leak: list[Array] = field(default_factory=list)


def measure(cases: int, seed: int = 0) -> Iterator[tuple[Way, ...]]:
    """Yield the ways after each case that counts."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    rng, ways = np.random.default_rng(seed), tuple(Way(name) for name in WAYS)
    solve = ActiveSet()
    while len(ways[0].residual) < cases:
        hierarchy = case(robot, rng)
        strict, _ = solve(hierarchy)
        if not can_be_met(hierarchy) or not strict.state[: robot.nv].any():
            continue
        answers = [strict.x, *(solve(problem)[0].x for problem in in_one_qp(hierarchy))]
        for way, x in zip(ways, answers, strict=True):
            way.residual.append(float(level_residuals(hierarchy, x)[0]))
            way.leak.append(regret(hierarchy, x))
        yield ways


def case(robot: Robot, rng: np.random.Generator) -> Hierarchy:
    """Hand above posture at a random place, within the robot's velocity limits scaled by 0.2 to 1."""
    q = random_posture(robot, rng)
    J = Configuration(robot, q).jacobian("panda_hand")[:3]
    direction = rng.normal(size=3)
    hand = Level(J, SPEED * direction / np.linalg.norm(direction), name="hand")
    home = Level(np.eye(robot.nv), HOME_GAIN * robot.difference(q, robot.posture("middle")), name="posture")
    limit = rng.uniform(0.2, 1.0) * robot.velocity_limit
    return Hierarchy([hand, home], box=(-limit, limit), unknowns=robot.velocity_names)


def can_be_met(hierarchy: Hierarchy) -> bool:
    """Whether some velocity within the limits meets level 1."""
    first, bounds = hierarchy.level(1), (hierarchy.box_lower, hierarchy.box_upper)
    nearest = lsq_linear(first.A, first.lower, bounds, method="bvls", tol=1e-15)
    return bool(np.abs(nearest.fun).max() <= MET)


def in_one_qp(hierarchy: Hierarchy) -> Iterator[Hierarchy]:
    """The same as one level, in the order of `WAYS` after the first."""
    (first, second), bounds = hierarchy.levels, (hierarchy.box_lower, hierarchy.box_upper)
    project = np.eye(hierarchy.n) - np.linalg.pinv(first.A) @ first.A
    for P in (project, np.eye(hierarchy.n)):
        for w in WEIGHTS:
            A = np.vstack([first.A, P @ second.A])
            b = np.concatenate([first.lower, P @ second.lower])
            weight = np.concatenate([first.weight, w * second.weight])
            yield Hierarchy([Level(A, b, weight=weight)], box=bounds)


def table(ways: tuple[Way, ...]) -> Table:
    """Residual of level 1 in mm/s and leaks, by way."""
    title = f"{len(ways[0].residual)} cases with active limits in which the hand's {SPEED:g} m/s can be met"
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("", "level 1 [mm/s], median", "p95", "max", "leak of level 1, max", "of level 2, median"):
        out.add_column(Text(heading), justify="right" if heading else "left")
    for way in ways:
        millimetres, leaks = 1e3 * np.array(way.residual), np.array(way.leak)
        figures = *np.percentile(millimetres, [50, 95, 100]), leaks[:, 0].max(), np.median(leaks[:, 1])
        out.add_row(way.name, *(f"{value:.3g}" for value in figures))
    return out
