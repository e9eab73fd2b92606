"""Figures 3.8–3.10: rates of Euler angles, and angular velocities, whose integral is no orientation."""

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from taskopt.arrays import Array
from taskopt.figures.drawing import draw_arc, draw_arrow, space_axes, write_note
from taskopt.figures.style import BLUE, GREEN, GREY, JOINTS, ORANGE, new_figure
from taskopt.figures.style import number as written
from taskopt.kinematics.orientation.euler import ZYZ
from taskopt.kinematics.pose import exp3

_PHI = np.array([0.6, 0.8, 0.7])  # φ, ϑ, ψ [rad]
_RATES = ("φ̇", "ϑ̇", "ψ̇")
_OWN_AXIS = ("z", "y", "z")  # of the current frame, about which each rate turns
_VIEW = (24.0, 68.0)  # elevation and azimuth of the viewer [deg]


def fig_3_8() -> Figure:
    """Draw the axes of the three rates of the angles ZYZ, each in the frame that it turns."""
    figure = new_figure(2.9)
    axes_of_rates = ZYZ.rate_map(_PHI).T
    frames = [np.eye(3), ZYZ.rotation([_PHI[0], 0.0, 0.0]), ZYZ.rotation([_PHI[0], _PHI[1], 0.0])]
    for number in range(3):
        axes = space_axes(figure, (1, 3, number + 1), 0.85, _VIEW)
        _draw_frame(axes, frames[number], GREY, "'" * number, _OWN_AXIS[number])
        along, colour = axes_of_rates[number], JOINTS[number]
        draw_arrow(axes, [0.0, 0.0, 0.0], 0.8 * along, colour, _RATES[number], 1.2)
        draw_arc(axes, 0.5 * along, along, 0.2, colour)
        shown = ", ".join(written(x, 2) for x in along)
        axes.set_title(f"column {number + 1} of T: ({shown})")
    return figure


def fig_3_9() -> Figure:
    """Draw the components of the rate ψ̇ along the axes of the reference frame."""
    figure = new_figure(3.4)
    axes = space_axes(figure, (1, 1, 1), 0.62, _VIEW, (0.0, 0.3, 0.42))
    _draw_frame(axes, np.eye(3), GREY, "", "z")
    T = ZYZ.rate_map(_PHI)
    for along, colour, name in zip(T.T, JOINTS, _RATES, strict=True):
        draw_arrow(axes, [0.0, 0.0, 0.0], along, colour, name, 1.1)
    x, y, z = T[:, 2]
    way = np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [x, y, z]])
    axes.plot(*way.T, color=GREEN, linestyle="--", linewidth=1.2)
    axes.plot(*np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]).T, color=GREEN, linestyle=":", linewidth=1.2)
    parts = f"ψ̇ has c$_φ$s$_ϑ$ = {x:.2f} along x, s$_φ$s$_ϑ$ = {y:.2f} along y, c$_ϑ$ = {z:.2f} along z"
    write_note(axes, parts, GREEN)
    axes.set_title(
        f"ω = T(φ) φ̇ for ZYZ, det T = −sin ϑ = {written(ZYZ.determinant(_PHI))}: no orthogonal axes"
    )
    return figure


def fig_3_10() -> Figure:
    """Draw Example 3.3: two orders of the same two turns, with one integral of ω and two orientations."""
    figure = new_figure(4.6)
    about_x, about_y = np.array([np.pi / 2, 0.0, 0.0]), np.array([0.0, np.pi / 2, 0.0])
    for row, (first, second) in enumerate([(about_x, about_y), (about_y, about_x)]):
        after = exp3(first)
        names = ("x", "y") if row == 0 else ("y", "x")
        titles = ("t = 0", f"t = 1 s: 90° about {names[0]}", f"t = 2 s: 90° about {names[1]}")
        for column, R in enumerate((np.eye(3), after, exp3(second) @ after)):
            axes = space_axes(figure, (2, 3, 3 * row + column + 1), 0.8, _VIEW)
            _draw_frame(axes, np.eye(3), "#B5B5B5", "")
            _draw_block(axes, R)
            axes.set_title(titles[column])
    figure.suptitle("∫ω dt = (π/2, π/2, 0) rad in both rows, and two orientations at the end", fontsize=9)
    return figure


def _draw_frame(axes: Axes3D, R: Array, colour: str, marks: str, without: str = "") -> None:
    """Draw the three axes of a frame, without the one that is drawn as the axis of a rate."""
    for along, name in zip(R.T, "xyz", strict=True):
        if name != without:
            draw_arrow(axes, [0.0, 0.0, 0.0], 0.75 * along, colour, f"{name}{marks}", 1.15)


def _draw_block(axes: Axes3D, R: Array) -> None:
    """Draw a flat block, turned by R (3, 3), whose faces have different colours."""
    half = np.array([0.5, 0.3, 0.12])
    for axis, colour in enumerate((BLUE, ORANGE, GREEN)):
        for side in (-1.0, 1.0):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = side * half[axis]
            corners[:, b] = half[b] * np.array([-1.0, 1.0, 1.0, -1.0])
            corners[:, c] = half[c] * np.array([-1.0, -1.0, 1.0, 1.0])
            face = Poly3DCollection([corners @ R.T], facecolor=colour, alpha=0.9 if side > 0 else 0.35)
            face.set_edgecolor("white")
            axes.add_collection3d(face)
