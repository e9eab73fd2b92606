"""Compare strict levels with one weighted QP and with a projected secondary cost.

The Panda's hand is to move at 0.6 m/s in a random direction, with the home posture as the level below it,
inside velocity limits. A random case is kept if the first level can be met in full inside the limits, and if
a limit is active at the strict optimum. SciPy's bounded least squares (BVLS) decides if the first level can
be met, so that no resolver of ours judges itself.

The alternatives to strict levels are one QP in which the posture u has the weight w, in two forms:

    soft        ½ ‖J v − b‖² + ½ w ‖v − u‖²
    projected   ½ ‖J v − b‖² + ½ w ‖N (v − u)‖²,    N = I − J†J

The projected cost is strict as long as no limit is active.
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
from taskopt.hierarchy.tolerances import RATE_MET
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.robot.random_posture import random_posture
from taskopt.resolver.fallback import ActiveSetWithFallback
from taskopt.resolver.regret import level_residuals, regret

SPEED = 0.6  # [m/s]
WEIGHTS = (1e-2, 1e-4)
HOME_GAIN = 1.0  # [1/s]
METHODS = ("strict", *(f"{kind}, w = {w:g}" for kind in ("projected", "soft") for w in WEIGHTS))


@dataclass
class Method:
    """Results of one method of giving the hand priority, for each case.

    Attributes:
        name: One of `METHODS`.
        residual: Weighted residual of the first level [m/s], one number for each case.
        regret: Regret of both levels, (2,) for each case [m/s, rad/s], see `taskopt.regret`.
        fallbacks: Number of problems that a fallback answered, because the active-set search found none.
    """

    name: str
    residual: list[float] = field(default_factory=list)
    regret: list[Array] = field(default_factory=list)
    fallbacks: int = 0


def measure(cases: int, seed: int = 0) -> Iterator[tuple[Method, ...]]:
    """Draw cases until enough of them are kept, and resolve each by every method.

    Args:
        cases: Number of cases to keep.
        seed: Another seed draws other cases.

    Yields:
        The methods, in the order of `METHODS`, after each case that is kept.
    """
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    rng, methods = np.random.default_rng(seed), tuple(map(Method, METHODS))
    resolve = ActiveSetWithFallback()
    while len(methods[0].residual) < cases:
        hierarchy = case(robot, rng)
        strict, _ = resolve(hierarchy)
        if not can_be_met(hierarchy) or not strict.state[: robot.nv].any():
            continue
        answers = [strict, *(resolve(problem)[0] for problem in in_one_qp(hierarchy))]
        for method, answer in zip(methods, answers, strict=True):
            method.residual.append(float(level_residuals(hierarchy, answer.x)[0]))
            method.regret.append(regret(hierarchy, answer.x))
            method.fallbacks += answer.fallback is not None
        yield methods


def case(robot: Robot, rng: np.random.Generator) -> Hierarchy:
    """Draw a case: a level for the hand above a level for the posture, at a random posture.

    Args:
        robot: The Panda.
        rng: Source of random numbers.

    Returns:
        Two levels inside the velocity limits of the robot, scaled by a random factor from 0.2 to 1.
    """
    q = random_posture(robot, rng)
    J = Configuration(robot, q).jacobian("panda_hand")[:3]
    direction = rng.normal(size=3)
    hand = Level(J, SPEED * direction / np.linalg.norm(direction), name="hand")
    home = Level(np.eye(robot.nv), HOME_GAIN * robot.difference(q, robot.posture("middle")), name="posture")
    limit = rng.uniform(0.2, 1.0) * robot.velocity_limit
    return Hierarchy([hand, home], box=(-limit, limit), unknowns=robot.velocity_names)


def can_be_met(hierarchy: Hierarchy) -> bool:
    """Return True if some velocity inside the limits meets the first level.

    Args:
        hierarchy: A case.

    Returns:
        True if the largest residual of SciPy's bounded least squares is at most `RATE_MET` [m/s].
    """
    first, bounds = hierarchy.level(1), (hierarchy.box_lower, hierarchy.box_upper)
    nearest = lsq_linear(first.A, first.lower, bounds, method="bvls", tol=1e-15)
    return bool(np.abs(nearest.fun).max() <= RATE_MET)


def in_one_qp(hierarchy: Hierarchy) -> Iterator[Hierarchy]:
    """Make the weighted QPs of a case.

    Args:
        hierarchy: A case with two levels.

    Yields:
        Hierarchies with one level, in the order of `METHODS` without the first.
    """
    (first, second), bounds = hierarchy.levels, (hierarchy.box_lower, hierarchy.box_upper)
    project = np.eye(hierarchy.n) - np.linalg.pinv(first.A) @ first.A
    for P in (project, np.eye(hierarchy.n)):
        for w in WEIGHTS:
            A = np.vstack([first.A, P @ second.A])
            b = np.concatenate([first.lower, P @ second.lower])
            weight = np.concatenate([first.weight, w * second.weight])
            yield Hierarchy([Level(A, b, weight=weight)], box=bounds)


def table(methods: tuple[Method, ...]) -> Table:
    """Make the table of the comparison.

    Args:
        methods: Methods that `measure` yielded last.

    Returns:
        One row for each method.
    """
    count = len(methods[0].residual)
    title = f"{count} cases with an active limit in which {SPEED:g} m/s of the hand is possible"
    out = Table(title=title, box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in (
        "method",
        "error of level 1\nmedian [mm/s]",
        "95 %\n[mm/s]",
        "largest\n[mm/s]",
        "regret of level 1\nlargest [mm/s]",
        "of level 2\nmedian [rad/s]",
        "fallbacks",
    ):
        out.add_column(Text(heading), justify="left" if heading == "method" else "right")
    for method in methods:
        millimetres, regrets = 1e3 * np.array(method.residual), np.array(method.regret)
        figures = (
            *np.percentile(millimetres, [50, 95, 100]),
            1e3 * regrets[:, 0].max(),
            np.median(regrets[:, 1]),
        )
        out.add_row(method.name, *(f"{value:.3g}" for value in figures), str(method.fallbacks))
    return out
