"""Figures 3.3–3.6 and 3.13: arms at their singularities, and the directions that are lost there."""

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from taskopt.arrays import Array
from taskopt.figures.drawing import (
    chain,
    draw_arc,
    draw_arrow,
    draw_planar_arm,
    draw_spatial_arm,
    space_axes,
    write_note,
)
from taskopt.figures.style import BLUE, GREEN, GREY, ORANGE, RED, new_figure, plane_axes
from taskopt.figures.style import number as written
from taskopt.kinematics.analysis.singularity import decouple, find_singularity, workspace_map
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot.textbook import (
    anthropomorphic_arm,
    anthropomorphic_with_wrist,
    planar_arm,
    spherical_wrist,
)

_SHOULDER = np.array([0.6, 0.7, np.pi - 1.4])  # with a₂ = a₃ the wrist point lies on z₀: c₂ + c₂₃ = 0


def fig_3_3() -> Figure:
    """Draw the outstretched two-link arm, whose tip can move across the arm but not along it."""
    figure = new_figure(3.0)
    arm = planar_arm([0.5, 0.5])
    for number, (bend, title) in enumerate([(1.2, "regular"), (0.0, "boundary singularity")], start=1):
        axes = plane_axes(figure, 1, 2, number)
        at = Configuration(arm, [0.5, bend])
        points, J = chain(at), at.jacobian("tip")[:2]
        found = find_singularity(J)
        draw_planar_arm(axes, points)
        for column, colour, name in zip(J.T, (BLUE, ORANGE), ("joint 1", "joint 2"), strict=True):
            axes.annotate(
                "",
                xytext=tuple(points[-1, :2].tolist()),
                xy=tuple((points[-1, :2] + 0.45 * column).tolist()),
                arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.8},
            )
            axes.plot([], [], color=colour, label=f"tip velocity by {name}")
        if found.is_singular:
            ends = points[-1, :2] + 0.25 * np.outer([-1.0, 1.0], found.lost[:, 0])
            axes.plot(*ends.T, color=RED, linestyle=":", linewidth=2.5, label="lost direction", zorder=5)
        axes.set_title(f"{title}: ϑ₂ = {bend:g}, σ₂ = {found.distance:.2f} m")
        axes.set_xlim(-0.25, 1.3)
        axes.set_ylim(-0.15, 1.1)
        axes.legend(loc="upper left", fontsize=8)
    return figure


def fig_3_4() -> Figure:
    """Draw the spherical wrist with the axes of joints 4 and 6 in line."""
    figure = new_figure(3.2)
    wrist, whole = spherical_wrist(0.3), anthropomorphic_with_wrist()
    for number, bend in enumerate((0.7, 0.0), start=1):
        at = Configuration(wrist, [0.4, bend, 0.3])
        axes = space_axes(figure, (1, 2, number), 0.42, (18.0, -20.0), (0.0, 0.0, 0.12))
        turn = at.jacobian("tip")[3:]
        draw_spatial_arm(axes, np.array([[0.0, 0.0, -0.2], [0.0, 0.0, 0.0], at.pose("tip")[:3, 3]]), [1])
        names = ("ϑ₄", "ϑ₅", "ϑ₆")
        starts = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], at.pose("tip")[:3, 3])
        for axis, start, name, colour in zip(turn.T, starts, names, (BLUE, ORANGE, GREEN), strict=True):
            draw_arrow(
                axes,
                start,
                0.25 * axis,
                colour,
                f"axis of {name}",
                1.3,
                "right" if name == "ϑ₄" else "center",
            )
        lost = find_singularity(turn).lost
        if lost.size:
            ends = np.outer([-0.35, 0.35], lost[:, 0])
            axes.plot(*ends.T, color=RED, linestyle=":", linewidth=2.5)
            write_note(axes, "dotted: no rotation about this axis", RED)
        q = [0.2, 0.5, 0.4, 0.4, bend, 0.3]
        determinant = decouple(Configuration(whole, q), "tip").wrist_measure
        axes.set_title(f"ϑ₅ = {bend:g} rad: det J₂₂ = {written(determinant)}, rank {3 - lost.shape[1]}")
    return figure


def fig_3_5() -> Figure:
    """Draw the anthropomorphic arm with its elbow outstretched."""
    return _arm([0.6, 0.7, 0.0], "elbow singularity, ϑ₃ = 0")


def fig_3_6() -> Figure:
    """Draw the anthropomorphic arm with its wrist point on the axis of the base."""
    return _arm(_SHOULDER, "shoulder singularity, tip on z₀")


def fig_3_13() -> Figure:
    """Draw the direction in which the transposed Jacobian is stuck at a shoulder singularity."""
    figure = new_figure(3.6)
    at = Configuration(anthropomorphic_arm(), _SHOULDER)
    axes = space_axes(figure, (1, 1, 1), 0.8, (22.0, -75.0), (0.1, 0.0, 0.3))
    points, J = chain(at), at.jacobian("tip")[:3]
    normal = find_singularity(J).lost[:, 0]
    inside = np.linalg.svd(J)[0][:, :2]
    corners = points[-1] + 0.33 * np.array([a * inside[:, 0] + b * inside[:, 1] for a, b in _SQUARE])
    axes.plot(*corners.T, color=GREEN, linewidth=1.2)
    write_note(axes, "frame: forces K e that move the arm, in its plane", GREEN, 1)
    draw_spatial_arm(axes, points)
    _base(axes)
    ends = points[-1] + np.outer([-0.6, 0.6], normal)
    axes.plot(*ends.T, color=RED, linestyle=":", linewidth=2.5)
    write_note(
        axes, "dotted: N(Jᵀ), normal to the plane; a target on this line leaves the arm where it is", RED
    )
    stuck = float(np.linalg.norm(J.T @ (500.0 * 0.3 * normal)))
    moving = float(np.linalg.norm(J.T @ (500.0 * 0.3 * inside[:, 0])))
    axes.set_title(
        f"target 0.3 m away, K = 500: ‖q̇‖ = {stuck:.1e} rad/s along N(Jᵀ), {moving:.0f} rad/s in the plane"
    )
    return figure


_SQUARE = ((-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))


def _arm(q: list[float] | Array, title: str) -> Figure:
    """Draw the anthropomorphic arm at a singularity beside a regular posture."""
    figure = new_figure(3.4)
    robot = anthropomorphic_arm()
    for number, posture in enumerate(([0.6, 0.7, 0.8], q), start=1):
        at = Configuration(robot, posture)
        axes = space_axes(figure, (1, 2, number), 0.68, (22.0, -75.0), (0.0, 0.0, 0.2))
        points, J = chain(at), at.jacobian("tip")[:3]
        draw_spatial_arm(axes, points)
        _base(axes)
        lost = find_singularity(J).lost
        if lost.size:
            ends = points[-1] + np.outer([-0.35, 0.35], lost[:, 0])
            axes.plot(*ends.T, color=RED, linestyle=":", linewidth=2.5)
            write_note(axes, "dotted: lost direction", RED)
        determinant = float(np.linalg.det(J)) if not lost.size else 0.0
        axes.set_title(f"{title if lost.size else 'regular'}: det $J_P$ = {written(determinant)} m³")
    return figure


def _base(axes: Axes3D) -> None:
    """Draw the axis of the base with the sense of its rotation."""
    draw_arrow(axes, [0.0, 0.0, -0.45], [0.0, 0.0, 1.05], GREY, "z₀", 1.08)
    draw_arc(axes, [0.0, 0.0, -0.28], [0.0, 0.0, 1.0], 0.12, GREY)


def fig_workspace() -> Figure:
    """Draw the smallest singular value of a planar and of an anthropomorphic arm over their workspaces."""
    figure = new_figure(3.4)
    pictures = (
        (planar_arm([0.6, 0.4]), (0, 1), "two links of 0.6 m and 0.4 m", (0, 1), "y [m]"),
        (
            anthropomorphic_arm(lower=[0.0, 0.0, -np.pi], upper=[1e-6, np.pi, np.pi]),
            (0, 1, 2),
            "anthropomorphic arm",
            (0, 2),
            "z [m]",
        ),
    )
    for number, (arm, rows, title, plane, label) in enumerate(pictures, start=1):
        axes = plane_axes(figure, 1, 2, number)
        found = workspace_map(arm, "tip", rows, count=8192)
        order = np.argsort(found.distance)
        points = found.points[order]
        drawn = axes.scatter(
            points[:, plane[0]], points[:, plane[1]], c=found.distance[order], s=3.0, cmap="viridis"
        )
        axes.set_axisbelow(True)
        axes.set_title(title)
        axes.set_ylabel(label)
        figure.colorbar(drawn, ax=axes, label="smallest singular value [m]", shrink=0.8)
    return figure
