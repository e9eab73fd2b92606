"""Figures 3.15–3.20: the runs of Sect. 3.7.5 by their formulas, and as a QP that keeps velocity limits."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from taskopt.arrays import Array
from taskopt.figures.paths import Path, follow
from taskopt.figures.style import BLUE, GREY, JOINTS, ORANGE, RED, new_figure

_FLOOR = 1e-10  # [m, rad] errors below are rounding
_FORMULA, _QP = "formula, no limits", "QP with limits"
_SPEED = 2.0  # [rad/s] limit of the QP beside Fig. 3.19, whose scenario declares none; the formula needs 2.5


def fig_3_15() -> Figure:
    """Draw the errors of the open loop, which remain after the motion has ended."""
    return _errors_of_pose("fig_3_15_open_loop")


def fig_3_16() -> Figure:
    """Draw joints, joint velocities and both errors of the closed loop with the inverse."""
    figure = new_figure(4.8)
    formula, qp = _pair("fig_3_16_inverse", "pinv")
    top, speeds = figure.add_subplot(2, 2, 1), figure.add_subplot(2, 2, 2)
    _joints(top, formula, qp)
    for joint, colour in enumerate(JOINTS):
        speeds.plot(formula.t, formula.v[:, joint], color=colour)
        speeds.plot(qp.t, qp.v[:, joint], color=colour, linestyle="--", linewidth=1.0)
    limit = float(qp.velocity_limit[0])
    for side in (-limit, limit):
        speeds.axhline(side, color=GREY, linestyle=":", linewidth=1.0)
    speeds.set_title(f"joint velocities; dotted: limits ±{limit:g} rad/s")
    _label(speeds, "q̇ [rad/s]")
    _position_error(figure.add_subplot(2, 2, 3), formula, qp)
    _orientation_error(figure.add_subplot(2, 2, 4), formula, qp)
    return figure


def fig_3_17() -> Figure:
    """Draw position error and orientation with the pseudo-inverse, where no row controls the orientation."""
    return _errors_and_orientation("fig_3_17_pseudo_inverse", "pinv")


def fig_3_18() -> Figure:
    """Draw position error and orientation with the transpose, whose error vanishes after the target stops."""
    return _errors_and_orientation("fig_3_18_transpose", "transpose")


def fig_3_19() -> Figure:
    """Draw joints, error and manipulability measure with and without q̇₀."""
    figure = new_figure(4.8)
    free = follow("fig_3_17_pseudo_inverse", "pinv")
    kept, qp = follow("planar_circle", "pinv"), follow("planar_circle", "active-set", _SPEED)
    for number, path, title in ((1, free, "without q̇₀"), (2, kept, "with k₀ = 50")):
        axes = figure.add_subplot(2, 2, number)
        _joints(axes, path, qp if path is kept else None)
        axes.set_title(f"joint positions {title}" + ("; dashed: QP" if path is kept else ""))
    error, measure = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for path, colour, style, name in (
        (kept, BLUE, "-", "k₀ = 50"), (free, ORANGE, "--", "without q̇₀"),
        (qp, RED, ":", f"k₀ = 50, QP, ±{_SPEED:g} rad/s"),
    ):  # fmt: skip
        _curve(error, path.t, path.position_error, colour, style, name)
        w = 0.5 * (np.sin(path.q[:, 1:]) ** 2).sum(axis=1)
        measure.plot(path.t, w, color=colour, linestyle=style, label=name)
    error.set_title("position error")
    _label(error, "‖e_P‖ [m]")
    measure.set_title("manipulability measure ½ (s₂² + s₃²)")
    _label(measure, "w")
    measure.legend(fontsize=8)
    return figure


def fig_3_20() -> Figure:
    """Draw each joint between its limits with and without q̇₀, and the error of the position."""
    figure = new_figure(4.8)
    free = follow("fig_3_17_pseudo_inverse", "pinv")
    formula, qp = _pair("fig_3_20_joint_limits", "pinv")
    lower, upper = np.array([-2.0, -0.5, -1.5]) * np.pi, np.array([2.0, 0.5, -0.5]) * np.pi
    for joint, colour in enumerate(JOINTS):
        axes = figure.add_subplot(2, 2, joint + 1)
        axes.plot(formula.t, formula.q[:, joint], color=colour, label="k₀ = 250")
        axes.plot(free.t, free.q[:, joint], color=GREY, linewidth=1.0, label="without q̇₀")
        axes.plot(qp.t, qp.q[:, joint], color=RED, linestyle="--", linewidth=1.0, label=f"k₀ = 250, {_QP}")
        for limit in (lower[joint], upper[joint]):
            axes.axhline(limit, color=GREY, linestyle="--", linewidth=1.0)
        axes.set_title(f"joint {joint + 1}; dashed: its limits")
        _label(axes, "q [rad]")
        axes.legend(fontsize=8, loc="best" if joint else (0.02, 0.12))
    _position_error(figure.add_subplot(2, 2, 4), formula, qp)
    return figure


def _pair(name: str, formula: str) -> tuple[Path, Path]:
    """Run a scenario by its formula and by the active-set method."""
    return follow(name, formula), follow(name, "active-set")


def _errors_of_pose(name: str) -> Figure:
    """Draw the errors of position and orientation side by side."""
    figure = new_figure(2.7)
    formula, qp = _pair(name, "pinv")
    _position_error(figure.add_subplot(1, 2, 1), formula, qp)
    _orientation_error(figure.add_subplot(1, 2, 2), formula, qp)
    return figure


def _errors_and_orientation(name: str, resolver: str) -> Figure:
    """Draw the error of the position, and the orientation of the tip."""
    figure = new_figure(2.7)
    formula, qp = _pair(name, resolver)
    _position_error(figure.add_subplot(1, 2, 1), formula, qp)
    axes = figure.add_subplot(1, 2, 2)
    for path, colour, style, told in ((formula, BLUE, "-", _FORMULA), (qp, RED, "--", _QP)):
        axes.plot(path.t, path.q.sum(axis=1), color=colour, linestyle=style, label=told)
    axes.set_title("orientation of the tip, which is free")
    _label(axes, "φ [rad]")
    axes.legend(fontsize=8)
    return figure


def _joints(axes: Axes, path: Path, qp: Path | None) -> None:
    """Draw the joint positions of a run, and those of a second one dashed."""
    for joint, colour in enumerate(JOINTS):
        axes.plot(path.t, path.q[:, joint], color=colour, label=f"joint {joint + 1}")
        if qp is not None:
            axes.plot(qp.t, qp.q[:, joint], color=colour, linestyle="--", linewidth=1.0)
    axes.set_title("joint positions" + ("" if qp is None else "; dashed: QP with limits"))
    _label(axes, "q [rad]")
    lowest, highest = axes.get_ylim()
    axes.set_ylim(top=highest + 0.2 * (highest - lowest))
    axes.legend(fontsize=8, loc="upper center", ncols=3)


def _position_error(axes: Axes, formula: Path, qp: Path) -> None:
    """Draw the norm of the position error of both runs."""
    _both(axes, formula.t, (formula.position_error, qp.position_error))
    axes.set_title(f"position error; QP with limits ±{qp.velocity_limit[0]:g} rad/s")
    _label(axes, "‖e_P‖ [m]")


def _orientation_error(axes: Axes, formula: Path, qp: Path) -> None:
    """Draw the size of the orientation error of both runs."""
    _both(axes, formula.t, (np.abs(formula.error[:, 2]), np.abs(qp.error[:, 2])))
    axes.set_title("orientation error")
    _label(axes, "|e_O| [rad]")


def _both(axes: Axes, t: Array, sizes: Sequence[Array]) -> None:
    """Draw two curves of errors over a logarithmic axis."""
    for size, colour, style, name in zip(sizes, (BLUE, RED), ("-", "--"), (_FORMULA, _QP), strict=True):
        _curve(axes, t, size, colour, style, name)
    axes.legend(fontsize=8)


def _curve(axes: Axes, t: Array, size: Array, colour: str, style: str, name: str) -> None:
    """Draw one curve of an error; rounding errors are drawn at the lower edge."""
    axes.semilogy(t, np.maximum(size, _FLOOR), color=colour, linestyle=style, label=name)


def _label(axes: Axes, quantity: str) -> None:
    """Name the axes of a curve over time, and mark where the motion ends."""
    axes.set_xlabel("t [s]")
    axes.set_ylabel(quantity)
    axes.axvline(4.0, color="#C8C8C8", linewidth=0.8, zorder=0)
