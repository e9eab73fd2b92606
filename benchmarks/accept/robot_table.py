"""Load every robot of the extra and MJCF files, run a stack on each, and print the rows of docs/robots.md.

    python benchmarks/accept/robot_table.py            # robots by name, then the MJCF files of gymnasium
    python benchmarks/accept/robot_table.py FILE …     # these MJCF files alone

Each robot runs ten ticks of 10 ms from the middle of its ranges: its last frame is to move by 1 cm, then its
joints are to return, within limits of position and speed. A row says how many of the ticks are claimed, and
what the file states and the robot does not have, but for what is true of every MJCF file.
"""

import re
import sys
import warnings
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from taskopt import (
    Configuration,
    Controller,
    FrameTask,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Robot,
    Stack,
    Task,
    robot_names,
)

HEAD = "| robot | velocities | couplings | ticks claimed | not in the robot |\n|---|---|---|---|---|"
_DT, _TICKS = 0.01, 10
_OF_EVERY_MJCF = ("shapes of the world", "an MJCF file states no velocity limits")
_LISTED = 2  # names of joints that a row shows, before it only counts them


def main() -> int:
    """Print the table; return 0 if all ticks are claimed."""
    rows = list(rows_of_files(map(Path, sys.argv[1:])) if sys.argv[1:] else all_rows())
    print("\n".join([HEAD, *rows]))
    return 0 if all(f"| {_TICKS} of {_TICKS} |" in row for row in rows) else 1


def all_rows() -> Iterator[str]:
    """Yield the rows of all robots by name and of gymnasium's MJCF files."""
    for name in robot_names():
        yield row(name, Robot.load(name))
    yield from rows_of_files(gymnasium_files())


def gymnasium_files() -> list[Path]:
    """Return the MJCF files of the package gymnasium, or none if it is not installed."""
    spec = find_spec("gymnasium")
    if spec is None or spec.origin is None:
        return []
    return sorted((Path(spec.origin).parent / "envs" / "mujoco" / "assets").glob("*.xml"))


def rows_of_files(paths: Iterable[Path]) -> Iterator[str]:
    """Yield the row of each MJCF file.

    Args:
        paths: The files.
    """
    for path in paths:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            robot = Robot.from_mjcf(path)
        robot.dropped = tuple(said for said in robot.dropped if not said.startswith(_OF_EVERY_MJCF))
        yield row(path.name, robot)


def row(name: str, robot: Robot) -> str:
    """Run a stack on a robot, and return its row.

    Args:
        name: What the row calls it.
        robot: The robot.

    Returns:
        A row of a table in Markdown.
    """
    dropped = "; ".join(short(sentence) for sentence in robot.dropped) or "–"
    proven = proven_ticks(robot)
    return f"| `{name}` | {robot.nv} | {len(robot.couplings) or '–'} | {proven} of {_TICKS} | {dropped} |"


def proven_ticks(robot: Robot) -> int:
    """Return how many ticks of a small stack are claimed with small KKT residuals.

    Args:
        robot: The robot.
    """
    q, frame = robot.posture("middle"), robot.frames[-1]
    goal = Configuration(robot, q).pose(frame)[:3, 3] + np.array([0.01, 0.0, 0.0])
    levels: list[list[Task]] = [[FrameTask(frame, target=goal, axes="xyz", gain=1.0)]]
    if len(robot.joints) > 1:  # what flies has its floating base alone
        levels.append([JointTask(gain=1.0)])
    controller = Controller(robot, Stack(levels, [JointPositionLimit(), JointVelocityLimit()]), dt=_DT)
    proven = 0
    for k in range(_TICKS):
        resolution = controller.step(q, k * _DT)
        proven += resolution.kkt_met()
        q = robot.integrate(q, resolution.v, _DT)
    return proven


def short(sentence: str) -> str:
    """Shorten a long list of joints in a sentence to its first names and their number.

    Args:
        sentence: The sentence.

    Returns:
        The sentence, with "a, b and 7 more" for a list of nine.
    """

    def counted(match: re.Match[str]) -> str:
        names = match.group(0).split(", ")
        if len(names) <= _LISTED + 1:
            return match.group(0)
        return f"{', '.join(names[:_LISTED])} and {len(names) - _LISTED} more"

    return re.sub(r"[\w-]+(?:, [\w-]+){2,}", counted, sentence)


if __name__ == "__main__":
    sys.exit(main())
