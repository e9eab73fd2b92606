"""A map of the workspace of the Panda: where its hand can point down, and how well it moves there."""

import numpy as np
from matplotlib.figure import Figure

from taskopt.figures.style import DARK, new_figure, plane_axes
from taskopt.kinematics.robot import Robot
from taskopt.loop.batch.reach import reach_map

_X, _Z = np.arange(-0.9, 0.91, 0.04), np.arange(-0.4, 1.01, 0.04)  # [m]


def fig_panda_workspace() -> Figure:
    """Draw the largest manipulability with which the Panda reaches each point of a plane, palm down."""
    robot = Robot.load("panda", lock=("panda_finger_joint1", "panda_finger_joint2"))
    poses = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (_X.size * _Z.size, 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = np.repeat(_X, _Z.size), np.tile(_Z, _X.size)
    value = reach_map(robot, "panda_hand_tcp", poses).manipulability.reshape(_X.size, _Z.size)
    figure = new_figure(4.0)
    figure.set_layout_engine("compressed")  # else the bar stands far from axes of equal scales
    axes = plane_axes(figure)
    axes.set_axisbelow(True)
    drawn = axes.pcolormesh(_X, _Z, value.T, shading="nearest", cmap="viridis", zorder=2)
    figure.colorbar(drawn, ax=axes, label="largest manipulability √det(J Jᵀ) that was found")
    axes.plot(0.0, 0.0, "o", color=DARK, markersize=5, zorder=3)
    axes.annotate("base", (0.0, 0.0), (0.0, -0.09), ha="center", color=DARK)
    axes.set_ylabel("z [m]")
    return figure
