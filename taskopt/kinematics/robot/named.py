"""Robots by name: the arms of the textbook, and all URDF files of the extra `taskopt[robots]`."""

import sys
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from taskopt.errors import InvalidValue, NotInstalled, UnknownName
from taskopt.kinematics.robot.arms import ARMS
from taskopt.kinematics.robot.parts import Parts
from taskopt.kinematics.robot.srdf import named_states
from taskopt.kinematics.robot.urdf import lazy_parts, read_tree
from taskopt.kinematics.robot.urdf_check import checked_urdf

# Walkers and flyers whose SRDF does not say so. All others float if a named posture of their SRDF
# places the root joint, and most of its joints are theirs: TALOS floats, its left arm alone does not.
_FLOATING = {
    "alexander_v1.lowerBodyOnly", "borinot_flying_arm_2", "centauro", "g1_29dof_rev_1_0",
    "g1_29dof_with_hand_rev_1_0", "hextilt_flying_arm_5", "human", "iris", "iris_simple", "laikago",
    "quadrotor_base", "quadruped", "romeo", "romeo_laas_small", "romeo_small", "simple_humanoid",
    "simple_humanoid_classical",
}  # fmt: skip

_BY_FILE = "a file is read by Robot.from_urdf, Robot.from_xacro or Robot.from_mjcf"


def load_named(name: str, floating: bool | None = None) -> Parts:
    """Read the parts of a robot by name.

    Args:
        name: One of `robot_names`.
        floating: True gives the robot a floating base. None: only a robot that walks or flies has one. Arms
            of the textbook have a fixed base.

    Returns:
        The parts of the robot.

    Raises:
        UnknownName: There is no robot of that name.
        NotInstalled: The robot is not an arm of the textbook, and the extra `taskopt[robots]` is not
            installed.
        InvalidValue: `floating` is True for an arm of the textbook.
    """
    if not isinstance(name, str):
        raise InvalidValue(f"a robot is loaded by its name, got {name!r}; {_BY_FILE}")
    if name in ARMS:
        if floating:
            raise InvalidValue(
                f"the robot '{name}' is an arm of the textbook, which stands; leave floating out"
            )
        return ARMS[name]()
    share = _share()
    if share is None:
        raise NotInstalled(f"the robot '{name}'", "'taskopt[robots]'")
    path = _path(name)
    srdf = _srdf_of(path)
    float_it = floats(path, srdf) if floating is None else floating
    parts = lazy_parts(checked_urdf(path), [share], float_it, srdf)
    return replace(parts, name=name)


def robot_names() -> tuple[str, ...]:
    """Return the names that `Robot.load` knows: arms of the textbook, then robots of the extra, sorted."""
    return (*ARMS, *sorted(_files()))


def floats(path: Path, srdf: Path | None) -> bool:
    """Return True if a robot has a floating base by default.

    Args:
        path: Its URDF file.
        srdf: Its SRDF file, or None.

    Returns:
        True if its base is free in space, as that of a humanoid.
    """
    if path.stem in _FLOATING:
        return True
    rooted = [s for s in (named_states(srdf).values() if srdf else ()) if len(s.get("root_joint", ())) == 7]
    if not rooted:
        return False
    joints = set(read_tree(path, floating=False).names)
    return any(2 * len(joints & set(state)) > len(state) for state in rooted)


def _path(name: str) -> Path:
    """Return the URDF file of a robot; raise `UnknownName`."""
    files = _files()
    if name not in files:
        longer = [known for known in files if known.endswith(f"/{name}")]
        hint = f"({' and '.join(longer)} have that file name)" if longer else ""
        if name.endswith((".urdf", ".xacro", ".xml")):
            hint = f"({_BY_FILE})"
        raise UnknownName("robot", name, (*ARMS, *files), hint)
    return files[name]


@cache
def _share() -> Path | None:
    """Find the folder to which package:// of the robots refers, in the wheel or in the environment."""
    folders = [Path(sys.prefix) / "share"]
    with suppress(PackageNotFoundError):
        folders.insert(0, Path(str(distribution("example-robot-data").locate_file("cmeel.prefix/share"))))
    return next((f for f in folders if (f / "example-robot-data" / "robots").is_dir()), None)


@cache
def _files() -> dict[str, Path]:
    """Map names to URDF files.

    A name is the file's stem, with the folder of the description before it where two files share a stem.
    """
    share = _share()
    if share is None:
        return {}
    files = [f for f in share.glob("example-robot-data/robots/*/*/*.urdf") if "<link" in f.read_text("utf-8")]
    count = Counter(f.stem for f in files)
    return {f.stem if count[f.stem] == 1 else f"{_folder(f)}/{f.stem}": f for f in files}


def _folder(path: Path) -> str:
    """Return the name of the description that a file belongs to."""
    return path.parents[1].name.removesuffix("_description")


def _srdf_of(path: Path) -> Path | None:
    """Find the SRDF file of the same stem, else the description's only one, else None."""
    files = {f.stem: f for f in path.parents[1].glob("srdf/*.srdf")}
    return files.get(path.stem) or (next(iter(files.values())) if len(files) == 1 else None)
