"""Reading xacro files: the package xacrodoc expands them to a URDF, which is then checked as usual."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.parsers.expat import ExpatError

from taskopt.errors import InvalidValue, NotInstalled, UnknownName
from taskopt.kinematics.robot.meshes import package_folders
from taskopt.kinematics.robot.urdf_check import UrdfFile, checked_urdf
from taskopt.kinematics.robot.xml_file import existing

Argument = str | float | bool
_DECLARED = re.compile(r"""<\w+:arg\s[^>]*?name\s*=\s*["']([^"']*)""")
_OF_EXPRESSIONS = (
    ArithmeticError,
    AttributeError,
    LookupError,
    NameError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
)


def expanded_xacro(
    path: str | Path,
    args: Mapping[str, Argument] | None,
    package_dirs: Iterable[str | Path] | None,
) -> UrdfFile:
    """Expand a xacro file to a URDF.

    Args:
        path: The xacro file.
        args: Mapping from each argument to its value, as given after `xacro FILE` on the command line; True
            is written "true". None: no arguments.
        package_dirs: Folders in which $(find …) looks for packages, besides those above the file and those of
            ROS; None: no others.

    Returns:
        The URDF, checked, with the path of the xacro file.

    Raises:
        MissingFile: The file is not there.
        NotInstalled: The package xacrodoc is not installed.
        InvalidValue: The file cannot be expanded, or the result is not a valid URDF.
        UnknownName: The file has no argument of that name.
    """
    file = existing(path, "xacro")
    if args is not None and not isinstance(args, Mapping):
        raise InvalidValue(f"args of {file} must be a mapping from argument to value, got {args!r}")
    text = _expanded(file, {name: _word(value) for name, value in (args or {}).items()}, package_dirs)
    try:
        return checked_urdf(file, ET.fromstring(text))
    except ET.ParseError as error:
        raise InvalidValue(f"{file} expands to something that is not XML: {error}") from error


def _expanded(file: Path, args: dict[str, str], package_dirs: Iterable[str | Path] | None) -> str:
    """Return the expanded text of a file."""
    try:
        import xacro
        import xacrodoc  # its import makes xacro find packages without an installation of ROS
    except ImportError as error:
        raise NotInstalled("the package xacrodoc, which expands xacro files,", "'taskopt[xacro]'") from error
    xacrodoc.packages.reset()  # it remembers packages by name, also those of another file
    xacrodoc.packages.walk_up_from(str(file))
    if package_dirs is not None:
        xacrodoc.packages.look_in([str(folder) for folder in package_folders(package_dirs)])
    before = len(xacro.all_includes)  # it lists the included files of all calls
    try:
        text = xacro.process_file(str(file), mappings=dict(args)).toxml()  # type: ignore[union-attr]
    except xacrodoc.packages.PackageNotFoundError as error:
        raise InvalidValue(
            f"{file} asks for a package that is not found: {error}; give package_dirs= the folder that "
            "holds it"
        ) from error
    except (xacro.XacroException, ExpatError, *_OF_EXPRESSIONS) as error:
        raise InvalidValue(f"{file} cannot be expanded: {' '.join(str(error).split())}") from error
    _require_arguments(file, args, [file, *map(Path, xacro.all_includes[before:])])
    return text


def _require_arguments(file: Path, args: Iterable[str], parts: Iterable[Path]) -> None:
    """Raise `UnknownName` for an argument that neither the file nor one that it includes mentions."""
    text = "".join(part.read_text("utf-8", errors="replace") for part in parts if part.is_file())
    for name in args:
        if name not in text:
            raise UnknownName(f"argument of {file.name}", name, dict.fromkeys(_DECLARED.findall(text)))


def _word(value: Argument) -> str:
    """Return a value as xacro writes it on the command line."""
    return str(value).lower() if isinstance(value, bool) else str(value)
