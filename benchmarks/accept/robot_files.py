"""Damage robot files at random, and read them: each is refused by an error of taskopt's, or read rightly.

    python benchmarks/accept/robot_files.py --count 2000 --out benchmarks/accept/robot_files.txt
    python benchmarks/accept/robot_files.py --count 40 --only mesh --seed 3

Each kind of file (URDF, SRDF, xacro, MJCF, mesh) is damaged `count` times, by one to three changes: an
attribute dropped or replaced by a word that is no number, too large, negative, or of another attribute; an
element dropped, repeated, moved, renamed; bytes cut out, changed, or cut off. A file may end in a robot whose
poses are those that the file describes to 1e-9, or in an error of taskopt's, and in nothing else: a bare
exception, a crash, or more than ten seconds count as failures, and are listed with the seed that makes the
file again.

A process of its own reads the files, since a crash would end it; it is started anew after one.
"""

import argparse
import os
import random
import select
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from robot_file_kinds import Kind, kinds, quiet

from taskopt import TaskoptError

_SAME_POSE = 1e-9  # [m], and of the entries of rotations
_PATIENCE = 10.0  # [s] for one file
_WORDS = (
    "", "nan", "inf", "-inf", "1e400", "-1", "0", "0 0 0", "1 2", "1 2 3 4", "a", "0,5", "1_0", "${x}",
    "$(arg y)", "9" * 400, "☃", "turn", "b", "true", "1e-300", "0x10", "../..", "%s", "world",
)  # fmt: skip
_TAGS = (
    "link",
    "joint",
    "robot",
    "limit",
    "mimic",
    "body",
    "geom",
    "include",
    "mesh",
    "foreign",
    "frame",
    "origin",
)
Change = Callable[[ET.Element, random.Random], None]


def main() -> int:
    """Run the command line; return 0 if every file ends as it may."""
    arguments = _arguments()
    lines, failures = [], []
    for kind in kinds():
        if arguments.only and kind.name not in arguments.only:
            continue
        outcomes = all_outcomes(kind, range(arguments.seed, arguments.seed + arguments.count))
        counted = Counter(outcome.split(":")[0] for outcome in outcomes.values())
        parts = ", ".join(f"{number} {outcome}" for outcome, number in counted.most_common())
        lines.append(f"{kind.name:6} {arguments.count} files: {parts}")
        print(lines[-1], flush=True)
        failures += [f"  {kind.name} {seed}: {o}" for seed, o in outcomes.items() if o.startswith("!")]
    report = [*lines, "", f"{len(failures)} failures", *failures]
    print("\n".join(report[len(lines) :]))
    if arguments.out:
        arguments.out.write_text("\n".join([*report, ""]), encoding="utf-8")
    return 1 if failures else 0


def all_outcomes(kind: Kind, seeds: Sequence[int]) -> dict[int, str]:
    """Read a damaged file for each seed, in a process that is started anew when a file ends it.

    Args:
        kind: The kind of file.
        seeds: One for each file.

    Returns:
        For each seed the outcome; one that may not be begins with "!".
    """
    outcomes: dict[int, str] = {}
    while len(outcomes) < len(seeds):
        left = [seed for seed in seeds if seed not in outcomes]
        ended = _in_a_process(kind, left, outcomes)
        if ended:
            outcomes[left[len(left) - len([s for s in left if s not in outcomes])]] = ended
    return outcomes


def _in_a_process(kind: Kind, seeds: Sequence[int], outcomes: dict[int, str]) -> str:
    """Read files until one ends the process; return how it ended, or "" if it reached the last file."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            for seed in seeds:
                os.write(
                    writer, (outcome_of(kind, seed, Path(folder)).replace("\n", " ")[:300] + "\n").encode()
                )
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb", buffering=0) as stream:  # what is buffered is nothing to select
        for seed in seeds:
            if not select.select([stream], [], [], _PATIENCE)[0]:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return f"!more than {_PATIENCE:g} s"
            line = stream.readline()
            if not line:
                break
            outcomes[seed] = line.decode().rstrip("\n")
    _, status = os.waitpid(child, 0)
    return f"!the process ended with status {status}" if status else ""


def outcome_of(kind: Kind, seed: int, folder: Path) -> str:
    """Read one damaged file.

    Args:
        kind: The kind of file.
        seed: Of the damage.
        folder: Where the file is written.

    Returns:
        "read", the class of an error of taskopt's with its message, or a failure, which begins with "!".
    """
    ending, content = damaged(kind, seed)
    path = folder / f"file{ending}"
    path.write_bytes(content)
    try:
        robot = quiet(kind.read, path)
        far = kind.farthest(path, robot)
    except TaskoptError as error:
        return f"{type(error).__name__}: {error}"
    except Exception as error:  # noqa: BLE001 (the very thing that must not happen is counted)
        return f"!{type(error).__name__}: {error}"
    return "read" if far <= _SAME_POSE else f"!read wrongly, {far:.3g} off"


def damaged(kind: Kind, seed: int) -> tuple[str, bytes]:
    """Return a file of a kind with one to three changes.

    Args:
        kind: The kind of file.
        seed: Of the choice of the changes.

    Returns:
        Ending and content of the file.
    """
    rng = random.Random(f"{kind.name} {seed}")
    ending, content = rng.choice(kind.files)
    if kind.name != "mesh" and rng.random() < 0.8:
        root = ET.fromstring(content)
        for _ in range(rng.randint(1, 3)):
            rng.choice(_CHANGES)(root, rng)
        content = ET.tostring(root)
    else:
        for _ in range(rng.randint(1, 3)):
            content = _with_other_bytes(content, rng)
    return ending, content


def _with_other_bytes(content: bytes, rng: random.Random) -> bytes:
    """Cut off, cut out, change or repeat some bytes."""
    if not content:
        return content
    i, n = rng.randrange(len(content)), rng.choice((1, 1, 2, 8, 40))
    what = rng.randrange(4)
    if what == 0:
        return content[:i]
    if what == 1:
        return content[:i] + content[i + n :]
    if what == 2:
        return content[:i] + bytes(rng.randrange(256) for _ in range(n)) + content[i + n :]
    return content[:i] + content[i : i + n] * rng.choice((2, 3, 50)) + content[i + n :]


def _drop_attribute(root: ET.Element, rng: random.Random) -> None:
    element = rng.choice([e for e in root.iter() if e.attrib] or [root])
    if element.attrib:
        del element.attrib[rng.choice(sorted(element.attrib))]


def _other_value(root: ET.Element, rng: random.Random) -> None:
    owners = [e for e in root.iter() if e.attrib]
    if owners:
        element = rng.choice(owners)
        others = [value for owner in owners for value in owner.attrib.values()]
        element.set(rng.choice(sorted(element.attrib)), rng.choice([*_WORDS, *others]))


def _drop_element(root: ET.Element, rng: random.Random) -> None:
    parent = rng.choice([e for e in root.iter() if len(e)] or [root])
    if len(parent):
        parent.remove(rng.choice(list(parent)))


def _repeat_element(root: ET.Element, rng: random.Random) -> None:
    parent = rng.choice([e for e in root.iter() if len(e)] or [root])
    if len(parent):
        parent.append(ET.fromstring(ET.tostring(rng.choice(list(parent)))))


def _move_element(root: ET.Element, rng: random.Random) -> None:
    parent = rng.choice([e for e in root.iter() if len(e)] or [root])
    if len(parent):
        child = rng.choice(list(parent))
        inside = set(child.iter())
        parent.remove(child)
        rng.choice([e for e in root.iter() if e not in inside]).append(child)


def _rename_element(root: ET.Element, rng: random.Random) -> None:
    rng.choice(list(root.iter())).tag = rng.choice(_TAGS)


_CHANGES: tuple[Change, ...] = (
    _drop_attribute, _other_value, _other_value, _other_value, _drop_element, _repeat_element, _move_element,
    _rename_element,
)  # fmt: skip


def _arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=2000, help="files of each kind")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first file")
    parser.add_argument("--only", nargs="*", default=(), help="these kinds alone")
    parser.add_argument("--out", type=Path, help="where the table is written")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
