"""Reading of XML files that describe robots, with checked numbers and errors that name file and element."""

import math
import os
import re
from pathlib import Path
from xml.etree import ElementTree as ET

from taskopt.errors import InvalidValue, MissingFile

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def existing(path: str | Path, kind: str) -> Path:
    """Return the absolute path of a file that is there.

    Args:
        path: The file, relative to the current folder, or with "~" for the home of the user.
        kind: Kind of file, such as "URDF", for the message.

    Returns:
        The absolute path.

    Raises:
        MissingFile: There is no such file; the message lists its neighbours of the same kind.
        InvalidValue: The path is neither a text nor a `Path`, or cannot be a path.
    """
    if not isinstance(path, str | os.PathLike):
        raise InvalidValue(f"a {kind} file is given by its path, got {path!r}")
    if isinstance(path, str) and path.lstrip().startswith("<"):
        raise InvalidValue(f"a {kind} file is given by its path, got XML text; write it to a file first")
    try:
        found = Path(path).expanduser().resolve()
        if found.is_file():
            return found
        folder = found.parent
        near = sorted(p.name for p in folder.glob(f"*{found.suffix}"))[:5] if folder.is_dir() else []
    except (OSError, ValueError, RuntimeError) as error:  # too long, a null character, no such home
        raise InvalidValue(f"{path!r} is no path of a {kind} file: {error}") from error
    there = f"; in that folder: {', '.join(near)}" if near else "; check the path"
    raise MissingFile(f"no {kind} file {found}{there}")


def parse(path: Path) -> ET.Element:
    """Read an XML file.

    Args:
        path: The file.

    Returns:
        Its root element.

    Raises:
        InvalidValue: The file is not XML, or cannot be read.
    """
    try:
        return ET.parse(path).getroot()
    except (ET.ParseError, ValueError, LookupError) as error:  # the last two: an unknown encoding
        raise InvalidValue(f"{path} is not XML: {error}") from error
    except OSError as error:
        raise InvalidValue(f"{path} cannot be read: {error.strerror}") from error


def finite_numbers(text: str) -> list[float] | None:
    """Read finite numbers that are separated by blanks.

    Args:
        text: The numbers, in the notation of XML formats: ASCII digits, a point, an exponent.

    Returns:
        The numbers, or None if one of the words is not a finite number.
    """
    words = text.split()
    if not all(map(_NUMBER.fullmatch, words)):  # float() reads 1_0, infinity and digits of other scripts, too
        return None
    out = [float(word) for word in words]
    return out if all(map(math.isfinite, out)) else None


def numbers(
    where: str, element: ET.Element | None, name: str, count: int, default: str | None
) -> list[float]:
    """Read the numbers of an attribute.

    Args:
        where: File and owner of the element, for the message.
        element: The element, or None if the file leaves it out.
        name: Name of the attribute.
        count: Number of numbers that the attribute must have, separated by blanks.
        default: Text that is read where the element or attribute is missing; None if it must be there.

    Returns:
        The numbers.

    Raises:
        InvalidValue: The attribute is missing without a default, has the wrong number of numbers, or
            something that is no finite number.
    """
    text = default if element is None else element.get(name, default)
    what = f"<{element.tag} {name}=…>" if element is not None else name
    if text is None:
        raise InvalidValue(f"{where}: {what} is missing")
    out = finite_numbers(text)
    if out is None or len(out) != count:
        needed = "a finite number" if count == 1 else f"{count} finite numbers"
        raise InvalidValue(f"{where}: {what} must be {needed}, got '{text}'")
    return out


def number(where: str, element: ET.Element | None, name: str, default: str | None = None) -> float:
    """Read an attribute that is one number; see `numbers`.

    Args:
        where: File and owner of the element, for the message.
        element: The element, or None if the file leaves it out.
        name: Name of the attribute.
        default: Text that is read where the element or attribute is missing; None if it must be there.

    Returns:
        The number.

    Raises:
        InvalidValue: It is missing without a default, or no finite number.
    """
    return numbers(where, element, name, 1, default)[0]


def names_of(where: str, elements: list[ET.Element], kind: str) -> list[str]:
    """Read the names of elements, each of which must have a name of its own.

    Args:
        where: File, for the message.
        elements: The elements.
        kind: Kind of the elements, such as "link", for the message.

    Returns:
        Their names.

    Raises:
        InvalidValue: An element has no name, or two have the same.
    """
    names: list[str] = []
    seen: set[str] = set()
    for element in elements:
        name = element.get("name", "")
        if not name:
            raise InvalidValue(f"{where}: the {kind} after '{names[-1] if names else ''}' has no name")
        if name in seen:
            raise InvalidValue(f"{where}: two {kind}s are named '{name}'; names must differ")
        seen.add(name)
        names.append(name)
    return names
