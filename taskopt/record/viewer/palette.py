"""Names of entities, colours, and the place of each resolver in the scene."""

import re
from typing import Any

import numpy as np

_RESOLVER = (0x5AA9FFFF, 0xFF9F40FF, 0x53D18CFF, 0xE66BD2FF, 0xF2D64BFF, 0x6FE0E6FF, 0xFF6B6BFF, 0xB08CFFFF)
_JOINT = (
    0xE6484DFF, 0x4C9BE8FF, 0x5FC15FFF, 0xB07CD8FF, 0xFF9F40FF, 0xE8E357FF, 0xC98A5EFF, 0xF49AC8FF,
    0x7FE0D0FF, 0xBFC7D5FF, 0x8FA3FFFF, 0xA8D65CFF,
)  # fmt: skip
LIMIT_LINE = 0x9A9A9AFF
TARGET, ERROR, ELLIPSOID = 0xF4F4F4FF, 0xFF3030FF, 0xF0C43C50
OBSTACLE, NEAR, HELD_LABEL = 0x8C7BA6B0, 0xE8E3D0FF, 0xFFC0C0FF  # the label's red is light enough to read
LOWER, UPPER, BROKEN, FREE = 0x3D8BD9FF, 0xD24B4BFF, 0xE0A020FF, 0x2C313AFF


def slug(name: str) -> str:
    """A resolver's name as one part of an entity path."""
    return name.replace("/", "-")


def part(name: str) -> str:
    """Any name as one part of an entity path."""
    import rerun as rr

    return rr.escape_entity_path_part(name)


def plain(name: str) -> str:
    """A name without signs that an entity path would have to escape: "panda_link5-left_ball"."""
    return re.sub(r"[^\w.-]+", "_", name.replace(" – ", "-"))


def resolver_colour(index: int) -> int:
    """0xRRGGBBAA of the resolver at a place in the list."""
    return _RESOLVER[index % len(_RESOLVER)]


def short(names: tuple[str, ...]) -> list[str]:
    """Names without the prefix that all of them share, up to its last underscore."""
    alike = [len(set(letters)) == 1 for letters in zip(*names, strict=False)] if len(names) > 1 else []
    common = names[0][: [*alike, False].index(False)] if names else ""
    cut = common.rfind("_") + 1
    return [name[cut:] for name in names]


def joint_colours(count: int) -> Any:
    """Colours of `count` joints; uint32, since three plain numbers would be read as one RGB."""
    return np.array([_JOINT[i % len(_JOINT)] for i in range(count)], dtype=np.uint32)


def colours(*values: int) -> Any:
    """0xRRGGBBAA values as Rerun wants them: three plain integers would be read as one colour."""
    return np.array(values, dtype=np.uint32)


def tint(colour: int, share: float) -> int:
    """White moved towards a colour, 0 … 1: what a robot's meshes are multiplied with."""
    channels = [(colour >> shift) & 0xFF for shift in (24, 16, 8)]
    mixed = [round(255 + share * (channel - 255)) for channel in channels]
    return (mixed[0] << 24) | (mixed[1] << 16) | (mixed[2] << 8) | 0xFF
