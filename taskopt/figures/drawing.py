"""Arms, axes and ellipses in Matplotlib, from poses and Jacobians of a configuration."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from taskopt.arrays import Array, ArrayLike
from taskopt.figures.style import DARK, GREY
from taskopt.kinematics.analysis.ellipsoid import Ellipsoid
from taskopt.kinematics.configuration import Configuration


def chain(configuration: Configuration) -> Array:
    """Return the origins of the base and of all Denavit–Hartenberg frames of an arm.

    Args:
        configuration: The arm at q.

    Returns:
        Points (n + 1, 3) [m] in the world.
    """
    names = [f"link{i}" for i in range(1, configuration.robot.nv + 1)]
    return np.array([np.zeros(3), *(configuration.pose(name)[:3, 3] for name in names)])


def draw_planar_arm(axes: Axes, points: Array, colour: str = DARK, strength: float = 1.0) -> None:
    """Draw an arm in the x-y plane: links, joints and the base.

    Args:
        axes: Axes to scale.
        points: Origins of its frames (n + 1, 2 or more) [m].
        colour: Colour of the links.
        strength: Opacity from 0 to 1.
    """
    x, y = points[:, 0], points[:, 1]
    axes.plot(x, y, color=colour, linewidth=4.0, solid_capstyle="round", alpha=strength, zorder=3)
    axes.plot(
        x[:-1], y[:-1], "o", color="white", markeredgecolor=colour, markersize=6.0, alpha=strength, zorder=4
    )
    axes.plot(x[:1], y[:1] - 0.02, "^", color=GREY, markersize=9.0, alpha=strength, zorder=2)


def draw_ellipse(axes: Axes, ellipsoid: Ellipsoid, centre: ArrayLike, scale: float, colour: str) -> None:
    """Draw an ellipse of velocity or force around the tip of an arm.

    Args:
        axes: Axes to scale.
        ellipsoid: An ellipsoid with two axes. A flat one is drawn as a line, and an open one as a line of
            finite length, which the text of the figure must mention.
        centre: Position of its centre, (2,) [m].
        scale: Metres on the picture for each unit of a semi-axis.
        colour: Colour of the line.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    finite = Ellipsoid(ellipsoid.axes, np.where(np.isfinite(ellipsoid.semi_axes), ellipsoid.semi_axes, 10.0))
    points = np.asarray(centre)[:2] + scale * finite.points(np.column_stack([np.cos(turn), np.sin(turn)]))
    axes.fill(points[:, 0], points[:, 1], color=colour, alpha=0.15, zorder=1)
    axes.plot(points[:, 0], points[:, 1], color=colour, zorder=2)


def space_axes(
    figure: Figure,
    place: tuple[int, int, int],
    reach: float,
    view: tuple[float, float],
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Axes3D:
    """Add axes in which an arm in space is drawn to scale.

    Args:
        figure: The figure.
        place: Rows, columns and number in the grid of axes.
        reach: Half the width of the cube that is shown [m].
        view: Elevation and azimuth of the viewer [deg].
        centre: Centre of the cube (3,) [m].

    Returns:
        The axes.
    """
    axes: Axes3D = figure.add_subplot(*place, projection="3d")  # type: ignore[assignment]
    x, y, z = centre
    axes.set_xlim(x - reach, x + reach)
    axes.set_ylim(y - reach, y + reach)
    axes.set_zlim(z - reach, z + reach)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.3)  # type: ignore[arg-type]
    axes.view_init(*view)
    axes.set_axis_off()
    return axes


def draw_spatial_arm(axes: Axes3D, points: Array, joints: Sequence[int] | None = None) -> None:
    """Draw an arm in space: links as thick lines, joints as circles.

    Args:
        axes: The axes.
        points: Origins of its frames (k, 3) [m].
        joints: Indices of the points that are joints; default: all but the last.
    """
    marked = range(len(points) - 1) if joints is None else joints
    axes.plot(*points.T, color=DARK, linewidth=4.5, solid_capstyle="round")
    axes.plot(*points[list(marked)].T, "o", color="white", markeredgecolor=DARK, markersize=7.0)


def draw_arrow(
    axes: Axes3D,
    start: ArrayLike,
    along: ArrayLike,
    colour: str,
    text: str = "",
    beyond: float = 1.12,
    side: str = "center",
) -> None:
    """Draw an arrow in space with a label at its tip.

    Args:
        axes: The axes.
        start: Point where the arrow starts, (3,) [m].
        along: Vector from its start to its tip, (3,) [m].
        colour: Colour of arrow and label.
        text: The label.
        beyond: Position of the label along the arrow, as a multiple of its length.
        side: Part of the label at that position: "left", "center" or "right".
    """
    p, d = np.asarray(start, dtype=float), np.asarray(along, dtype=float)
    axes.quiver(*p, *d, color=colour, linewidth=1.8, arrow_length_ratio=0.18)
    if text:
        x, y, z = (p + beyond * d).tolist()
        axes.text(x, y, z, text, color=colour, ha=side, va="center")


def draw_arc(axes: Axes3D, centre: ArrayLike, axis: ArrayLike, radius: float, colour: str) -> None:
    """Draw the arc of a rotation about an axis, most of a circle, with a mark where it ends.

    Args:
        axes: The axes.
        centre: Centre of the arc on the axis of rotation, (3,) [m].
        axis: The axis, (3,), of any length but zero.
        radius: Radius of the arc [m].
        colour: Colour of the arc.
    """
    z = np.asarray(axis, dtype=float) / np.linalg.norm(np.asarray(axis, dtype=float))
    x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    turn = np.linspace(0.0, 1.6 * np.pi, 60)
    circle = np.outer(np.cos(turn), x) + np.outer(np.sin(turn), np.cross(z, x))
    points = np.asarray(centre) + radius * circle
    axes.plot(*points.T, color=colour, linewidth=1.4)
    axes.quiver(*points[-4], *(points[-1] - points[-4]), color=colour, linewidth=1.4, arrow_length_ratio=1.2)


def write_note(axes: Axes3D, text: str, colour: str, line: int = 0) -> None:
    """Write a line of text below a drawing in space.

    Args:
        axes: The axes.
        text: The text.
        colour: Colour of the text.
        line: Number of the line, counted upwards from 0.
    """
    axes.text2D(
        0.5, 0.03 + 0.07 * line, text, transform=axes.transAxes, color=colour, ha="center", fontsize=8
    )
