"""The pairs of shapes of a robot that are kept apart, and the reasons why others are left out."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from taskopt.kinematics.collision.always_near import always_near
from taskopt.kinematics.collision.pairs import SolidPair, named_pairs
from taskopt.kinematics.geometry.coal import exact, solid
from taskopt.kinematics.robot.random_posture import random_posture
from taskopt.kinematics.robot.robot import Robot


@dataclass(frozen=True)
class PairChoice:
    """Pairs of shapes that are kept apart, and those left out with the reason; `str` gives the numbers.

    Attributes:
        pairs: Indices in `robot.geometry` of the two shapes of each pair.
        total: Number of all pairs of shapes of the robot.
        left_out: For each reason, the pairs that it left out, in the order in which the reasons were applied.
    """

    pairs: tuple[SolidPair, ...]
    total: int
    left_out: tuple[tuple[str, tuple[SolidPair, ...]], ...]

    def __str__(self) -> str:
        """Return a sentence such as "44 of 136 pairs of shapes; left out: 13 on one body, …"."""
        reasons = ", ".join(f"{len(pairs)} {reason}" for reason, pairs in self.left_out if pairs)
        return f"{len(self.pairs)} of {self.total} pairs of shapes" + (
            f"; left out: {reasons}" if reasons else ""
        )


def choose_pairs(robot: Robot, clearance: float = 0.0, sampled: int = 0, seed: int = 0) -> PairChoice:
    """Choose the pairs of shapes of a robot that can and must be kept apart.

    These pairs are left out, in this order: pairs on one body, which are on links that fixed joints connect;
    pairs of neighbours, which are on a body and on the next body towards the root that has shapes; pairs that
    the robot disables, for example by its SRDF; and pairs that are proven to be within the clearance in every
    posture (`always_near`). If `sampled` is not 0, pairs are left out, too, that are within the clearance in
    all named postures and in that number of random postures within the position limits. A sample proves
    nothing, so that the reason states the number of postures and the largest distance of these pairs.

    Args:
        robot: The robot.
        clearance: Distance [m] that a pair must be able to reach.
        sampled: Number of random postures; 0 tries none.
        seed: Seed of the random postures.

    Returns:
        The pairs, in the order of the robot's own pairs if it has any.
    """
    joints = [int(shape.parentJoint) for shape in robot.geometry.geometryObjects]
    every = [(i, j) for j in range(len(joints)) for i in range(j)]
    own = [(int(pair.first), int(pair.second)) for pair in robot.geometry.collisionPairs]
    known, above = {frozenset(pair) for pair in own}, _next_towards_root(robot, joints)

    def reason(pair: SolidPair) -> str:
        """Return why a pair is left out, "" if it is not."""
        a, b = (joints[i] for i in pair)
        if a == b:
            return "on one body"
        if above[a] == b or above[b] == a:
            return "of neighbours"
        return "disabled by the robot" if known and frozenset(pair) not in known else ""

    why = {pair: reason(pair) for pair in every}
    left = {text: tuple(p for p in every if why[p] == text) for text in sorted(set(why.values()) - {""})}
    rest = [pair for pair in own or every if not why[min(pair), max(pair)]]
    near = always_near(robot, solid(robot.geometry), rest, clearance) if rest else ()
    left[f"within {clearance:g} m in every posture"] = near
    rest = [pair for pair in rest if pair not in set(near)]
    if sampled:
        text, near = _sampled(robot, rest, clearance, sampled, seed)
        left[text] = near
        rest = [pair for pair in rest if pair not in set(near)]
    return PairChoice(tuple(rest), len(every), tuple(left.items()))


def named_choice(robot: Robot, names: Iterable[tuple[str, str]]) -> PairChoice:
    """Choose all pairs of shapes of given pairs of links.

    Args:
        robot: The robot.
        names: Pairs of names of links.

    Returns:
        These pairs; all others are left out.

    Raises:
        UnknownName: No link with a shape has that name.
        InvalidValue: An entry is not a pair of names, or its two links move as one body.
    """
    pairs, count = named_pairs(robot, names), len(robot.geometry.geometryObjects)
    chosen = {frozenset(pair) for pair in pairs}
    others = [(i, j) for j in range(count) for i in range(j) if frozenset((i, j)) not in chosen]
    return PairChoice(pairs, len(others) + len(chosen), (("not named", tuple(others)),))


def _next_towards_root(robot: Robot, joints: Iterable[int]) -> dict[int, int]:
    """Map each joint that carries shapes to the next such joint towards the root, or to the world."""
    parents, carrying = list(robot.model.parents), set(joints)
    above = {}
    for joint in carrying - {0}:
        found = parents[joint]
        while found and found not in carrying:
            found = parents[found]
        above[joint] = found
    return above | {0: -1}


def _sampled(
    robot: Robot, pairs: Sequence[SolidPair], clearance: float, count: int, seed: int
) -> tuple[str, tuple[SolidPair, ...]]:
    """Return the pairs that are within `clearance` [m] in all postures tried, and a reason in words."""
    rng = np.random.default_rng(seed)
    apart = np.full(len(pairs), -np.inf)
    shapes, data = solid(robot.geometry), robot.model.createData()
    for pair in pairs:
        shapes.addCollisionPair(pin.CollisionPair(*pair))
    memory = exact(shapes.createData())
    near = np.arange(len(pairs))  # pairs that were farther apart once are not measured again
    for q in (*robot.postures.values(), *(random_posture(robot, rng) for _ in range(count))):
        pin.computeDistances(robot.model, data, shapes, memory, q)
        results = memory.distanceResults
        apart[near] = np.maximum(apart[near], [results[int(pair)].min_distance for pair in near])
        for pair in near[apart[near] > clearance]:
            memory.deactivateCollisionPair(int(pair))
        near = near[apart[near] <= clearance]
    words = f"within {clearance:g} m in {count} sampled postures (seed {seed})"
    if near.size:
        words += f", at most {apart[near].max():.2g} m apart"
    return words, tuple(pairs[int(pair)] for pair in near)
