"""Pairs of shapes that are left out of self-collision, searched for postures in which they behave otherwise.

    python benchmarks/accept/pairs.py                      # all robots of the extra; writes pairs.txt
    python benchmarks/accept/pairs.py --only panda tiago   # some of them, without writing

For every pair that `choose_pairs` leaves out because the robot's SRDF disables it, the distance is minimised
from several random postures; for every pair that is said to be near in every posture, it is maximised. The
steps follow the gradient inside the position limits. A pair that is disabled and can overlap is reported: an
SRDF may disable it on purpose, because it always overlaps or is kept apart by other means, and the user
should know. A pair said to be near that comes apart would be an error, and the script fails. A search that
finds nothing proves nothing.
"""

# Pinocchio ships no stubs.
# pyright: reportAttributeAccessIssue=false

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from taskopt import Robot
from taskopt.arrays import Array
from taskopt.errors import TaskoptError
from taskopt.kinematics.collision.choice import choose_pairs
from taskopt.kinematics.collision.measure import Distances
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.collision.pairs import SolidPair
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.engine import GeometryModel
from taskopt.kinematics.geometry.coal import solid
from taskopt.kinematics.robot.named import robot_names
from taskopt.kinematics.robot.random_posture import random_posture

CLEARANCE = 0.01  # [m] margin of a self-collision limit
SAMPLES = 60  # random postures, in which all pairs are measured at once
STEPS = 25  # of the descent of each pair from its best posture
OUTPUT = Path(__file__).with_suffix(".txt")


class Found(NamedTuple):
    """Extreme distances of some pairs over all postures tried [m]; signs as asked for."""

    names: tuple[str, ...]
    distance: Array


def search(robot: Robot, pairs: Sequence[SolidPair], sign: float, rng: np.random.Generator) -> Found:
    """Return the smallest (sign +1) or largest (sign −1) distance of each pair that a descent finds."""
    solids = solid(robot.geometry)
    distances = Distances(Collision.of_itself(robot, pairs))
    names = distances.collision.names
    best, start = np.full(len(pairs), np.inf), [robot.neutral] * len(pairs)
    at = Configuration(robot, robot.neutral)
    for q in (*robot.postures.values(), *(random_posture(robot, rng) for _ in range(SAMPLES))):
        at.update(q)
        distances.update(at)
        for pair in np.flatnonzero(sign * distances.distance < best):
            best[pair], start[pair] = sign * distances.distance[pair], q
    for pair in range(len(pairs)):
        if sign > 0 and best[pair] < 0.0:
            continue  # it overlaps already
        alone = one_pair(robot, solids, names[pair], pairs[pair])
        best[pair] = min(best[pair], descend(robot, alone, start[pair], sign))
    return Found(names, np.asarray(sign * best))


def one_pair(robot: Robot, solids: GeometryModel, name: str, pair: SolidPair) -> Distances:
    """Return the distance of one pair, among no other shapes, since each update places all shapes."""
    two = pin.GeometryModel()
    for place in pair:
        two.addGeometryObject(solids.geometryObjects[place])
    return Distances(Collision(robot, [name], two, [(0, 1)]))


def descend(robot: Robot, distances: Distances, q: Array, sign: float) -> float:
    """Return the least value of sign · d that steps along the gradient reach from q, inside the limits."""
    has = robot.position_index >= 0
    places, lower, upper = robot.position_index[has], robot.position_lower[has], robot.position_upper[has]
    least, length = np.inf, 0.5  # [rad, m]
    at = Configuration(robot, q)
    for _ in range(STEPS):
        distances.update(at)
        value = sign * float(distances.distance[0])
        if value < least:
            least, q = value, at.q.copy()
            steepest = float(np.linalg.norm(distances.gradient[0]))
            slope = np.asarray(distances.gradient[0] / max(steepest, 1e-9))
        else:
            length *= 0.5
        moved = robot.integrate(q, np.asarray(-sign * length * slope), 1.0)
        moved[places] = np.clip(moved[places], lower, upper)
        at.update(moved)
        if least < 0.0 and sign > 0:
            break
    return least


def report(name: str) -> tuple[str, bool]:
    """Return the lines of one robot, and True if nothing said about it is wrong."""
    try:
        robot = Robot.load(name)
        if not len(robot.geometry.geometryObjects):
            return f"{name}: no shapes", True
    except TaskoptError as error:
        return f"{name}: not loaded: {str(error).splitlines()[0][:90]}", True
    choice, rng = choose_pairs(robot, CLEARANCE), np.random.default_rng(0)
    lines, right = [f"{name}: {choice}"], True
    for reason, pairs in choice.left_out:
        if not pairs:
            continue
        if reason == "disabled by the robot":
            found = search(robot, pairs, 1.0, rng)
            meet = [who for who, d in zip(found.names, found.distance, strict=True) if d < 0.0]
            lines.append(f"  {len(meet)} of {len(pairs)} disabled pairs can overlap" + _listed(meet))
        elif reason.endswith("in every posture"):
            found = search(robot, pairs, -1.0, rng)
            apart = [who for who, d in zip(found.names, found.distance, strict=True) if d > CLEARANCE + 1e-6]
            lines.append(
                f"  {len(apart)} of {len(pairs)} pairs near in every posture come apart" + _listed(apart)
            )
            right &= not apart
    return "\n".join(lines), right


def _listed(names: Sequence[str]) -> str:
    """Return ": a, b, …" of up to twelve names."""
    more = f", and {len(names) - 12} more" if len(names) > 12 else ""
    return f": {', '.join(names[:12])}{more}" if names else ""


def main() -> int:
    """Print the report of every robot; return 1 if a claim is wrong."""
    parser = argparse.ArgumentParser(description="Search pairs that are left out of self-collision.")
    parser.add_argument("--only", nargs="+", default=None, metavar="ROBOT")
    only = parser.parse_args().only
    text, right = [], True
    for name in only or robot_names():
        lines, fine = report(name)
        right &= fine
        text.append(lines)
        print(lines, flush=True)
    if only is None:
        OUTPUT.write_text("\n".join(text) + "\n", encoding="utf-8")
    return int(not right)


if __name__ == "__main__":
    raise SystemExit(main())
