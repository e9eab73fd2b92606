"""Files of JSON objects, one a line, to which finished results are appended, and which survive a kill."""

import json
import os
from pathlib import Path
from typing import Any


def append(file: Path, entry: dict[str, Any]) -> None:
    """Append a line, and see to it that it is on the disk.

    Args:
        file: The file; it is made if it is not there.
        entry: Plain data.
    """
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(entry) + "\n")
        lines.flush()
        os.fsync(lines.fileno())


def differences(then: dict[str, Any], here: dict[str, Any]) -> list[str]:
    """Say which conditions changed.

    Args:
        then: Conditions under which the lines of a file were written, by name.
        here: The present ones.

    Returns:
        "name: old value → new value" for each that differs.
    """
    changed = [name for name in then | here if then.get(name) != here.get(name)]
    return [f"{name}: {then.get(name)} → {here.get(name)}" for name in changed]


def whole_entries(file: Path, *, repair: bool = False) -> list[dict[str, Any]]:
    """Read all whole lines.

    Args:
        file: The file; it need not be there.
        repair: True to cut off a line that a kill left half-written, so that others can be appended.

    Returns:
        The objects, in order.

    Raises:
        ValueError: A whole line is no JSON; the message begins with its number.
    """
    if not file.is_file():
        return []
    text = file.read_bytes()
    whole = text[: text.rfind(b"\n") + 1]
    if repair and len(whole) < len(text):
        os.truncate(file, len(whole))
    entries = []
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            entries.append(json.loads(line))
        except ValueError as error:
            raise ValueError(f"line {number}: {error}") from error
    return entries
