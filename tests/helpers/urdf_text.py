"""URDF files in a few words, for tests that need one that is right or flawed in one place."""

from pathlib import Path

LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="1"/>'


def joint(
    name: str, parent: str, child: str, inner: str = LIMIT, kind: str = "revolute", axis: str = "0 0 1"
):
    """One joint, its child 0.3 m above its parent; `inner` is what follows the axis."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.3"/><axis xyz="{axis}"/>{inner}</joint>'
    )


def robot(*elements: str, links: str = "base upper lower", name: str = "arm") -> str:
    """A robot of bare links and the given elements."""
    return (
        f'<robot name="{name}">'
        + "".join(f'<link name="{x}"/>' for x in links.split())
        + "".join(elements)
        + "</robot>"
    )


def written(folder: Path, text: str, name: str = "arm.urdf") -> Path:
    """Write a file and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


PAN, TILT = joint("pan", "base", "upper"), joint("tilt", "upper", "lower", axis="0 1 0")
ARM = robot(PAN, TILT)
