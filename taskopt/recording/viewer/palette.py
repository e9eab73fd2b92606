"""All colours of a recording, which are defined only here.

A colour is an integer 0xRRGGBBAA, the last two digits being the opacity.
"""

import numpy as np
from numpy.typing import NDArray

Colours = NDArray[np.uint32]

RESOLVERS = (0x5AA9FFFF, 0xFF9F40FF, 0x53D18CFF, 0xE66BD2FF, 0xF2D64BFF, 0x6FE0E6FF, 0xFF6B6BFF, 0xB08CFFFF)
"""One for each resolver: its lines in plots that compare resolvers, its robot and its path in the scene."""

LINES = (
    0xE6484DFF, 0x4C9BE8FF, 0x5FC15FFF, 0xB07CD8FF, 0xFF9F40FF, 0xE8E357FF, 0xC98A5EFF, 0xF49AC8FF,
    0x7FE0D0FF, 0xBFC7D5FF, 0x8FA3FFFF, 0xA8D65CFF,
)  # fmt: skip
"""One for each line of a plot of one resolver: joints, multipliers, pairs of bodies."""

LIMIT_LINE = 0x9A9A9AFF
"""Lines at which a limit, a margin or the bound of a proof stands in a plot."""

UPPER, LOWER, VIOLATED, FREE = 0xD24B4BFF, 0x3D8BD9FF, 0xE0A020FF, 0x2C313AFF
"""State of a limit, in the active-set timeline and on the lines between nearest points."""

TARGET, ERROR, TRAIL = 0xF4F4F4FF, 0xFF3030FF, 0xB39DDBFF
"""In the scene: desired paths and regions, the error between desired and actual position, trails."""

ELLIPSOID, FORCE_ELLIPSOID, OBSTACLE = 0xF0C43C50, 0x6FC2B0B0, 0x8C7BA6B0
"""Ellipsoids of velocity and of force, and obstacles, in the scene."""

NEAR, ACTIVE_LABEL = 0xE8E3D0FF, 0xFFC0C0FF
"""Lines between nearest points whose limit is not active; the number beside a line whose limit is."""

RAMP = (0x46307EFF, 0x365C8DFF, 0x1FA187FF, 0x9FDA3AFF, 0xFDE725FF)
"""From small to large values, growing brighter, for points in the scene."""

BACKGROUND, GRID = 0x101217FF, 0x3C424E6E
"""The background of the scene, and the grid on its floor."""

_SHAPE_TINT, _MESH_TINT = (
    0.75,
    0.45,
)  # how far a robot's shapes, and its meshes, are moved from white to its colour


def resolver_colour(index: int) -> int:
    """Choose the colour of a resolver.

    Args:
        index: The position of the resolver in the list of the run.

    Returns:
        The colour 0xRRGGBBAA; colours repeat after eight resolvers.
    """
    return RESOLVERS[index % len(RESOLVERS)]


def line_colours(count: int) -> Colours:
    """Choose the colours of the lines of a plot.

    Args:
        count: The number of lines.

    Returns:
        One colour for each line, (count,); colours repeat after twelve lines.
    """
    return colours(*(LINES[i % len(LINES)] for i in range(count)))


def colours(*values: int) -> Colours:
    """Convert colours to the form that Rerun reads.

    Args:
        *values: Colours 0xRRGGBBAA.

    Returns:
        The colours as unsigned integers, (k,), because Rerun takes three plain integers for one RGB colour.
    """
    return np.array(values, dtype=np.uint32)


def shape_tint(colour: int) -> int:
    """Lighten the colour of a resolver for the plain shapes of its robot.

    Args:
        colour: The colour 0xRRGGBBAA.

    Returns:
        An opaque colour between white and `colour`.
    """
    return _mixed_with_white(colour, _SHAPE_TINT)


def mesh_tint(colour: int) -> int:
    """Lighten the colour of a resolver for the meshes of its robot, which are shaded.

    Args:
        colour: The colour 0xRRGGBBAA.

    Returns:
        An opaque colour between white and `colour`, lighter than that of plain shapes.
    """
    return _mixed_with_white(colour, _MESH_TINT)


def packed_colour(channels: NDArray[np.float64]) -> int:
    """Convert a colour from its channels to an integer.

    Args:
        channels: Red, green, blue and opacity, (4,), from 0 to 1.

    Returns:
        The colour 0xRRGGBBAA.
    """
    r, g, b, a = (round(255 * float(channel)) for channel in np.clip(channels, 0.0, 1.0))
    return (r << 24) | (g << 16) | (b << 8) | a


def ramp(share: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Choose colours for numbers, between the colours of `RAMP`.

    Args:
        share: The numbers, (k,), from 0 to 1.

    Returns:
        Red, green and blue of each, (k, 3).
    """
    corners = np.linspace(0.0, 1.0, len(RAMP))
    channels = [
        np.interp(share, corners, [(colour >> shift) & 0xFF for colour in RAMP]) for shift in (24, 16, 8)
    ]
    return np.stack(channels, axis=1).round().astype(np.uint8)


def _mixed_with_white(colour: int, share: float) -> int:
    """Move white towards a colour by a share from 0 to 1."""
    channels = [(colour >> shift) & 0xFF for shift in (24, 16, 8)]
    mixed = [round(255 + share * (channel - 255)) for channel in channels]
    return (mixed[0] << 24) | (mixed[1] << 16) | (mixed[2] << 8) | 0xFF
