"""Figures 3.23–3.27: ellipses of velocity and force of planar arms."""

import numpy as np
from matplotlib.figure import Figure

from taskopt.figures.drawing import chain, draw_ellipse, draw_planar_arm
from taskopt.figures.style import BLUE, DARK, GREEN, ORANGE, PURPLE, RED, new_figure, plane_axes
from taskopt.kinematics.analysis.ellipsoid import (
    force_ellipsoid,
    force_ratio,
    velocity_ellipsoid,
    velocity_ratio,
)
from taskopt.kinematics.configuration import Configuration
from taskopt.kinematics.robot.textbook import planar_arm
from taskopt.loop.run import run
from taskopt.loop.scenario import FOLDER, load_scenario

_TIPS = (0.3, 0.8, 1.2, 1.6, 1.9)  # [m] along x
_POSTURES = (BLUE, ORANGE, GREEN, PURPLE, DARK)
_VELOCITY_SCALE, _FORCE_SCALE = 0.2, 0.08  # metres on the picture for 1 m/s and for 1 N


def fig_3_23() -> Figure:
    """Draw velocity ellipses of the two-link arm with its tip along x."""
    return _row_of_ellipses("velocity")


def fig_3_24() -> Figure:
    """Draw the singular values of J of the two-link arm over the position of its tip."""
    figure = new_figure(2.8)
    axes = figure.add_subplot()
    x = np.linspace(0.0, 2.0, 401)
    sigma = np.array([np.linalg.svd(_two_links(r).jacobian("tip")[:2], compute_uv=False) for r in x])
    axes.plot(x, sigma[:, 0], color=BLUE, label="σ₁, largest")
    axes.plot(x, sigma[:, 1], color=ORANGE, label="σ₂, smallest")
    best = int(np.argmax(sigma.prod(axis=1)))
    axes.plot(x, sigma.prod(axis=1), color=DARK, linestyle=":", label="w = σ₁ σ₂, in m²")
    told = f"w is largest at x = {x[best]:.2f} m, where ϑ₂ = 90°"
    axes.plot(x[best], sigma[best].prod(), "o", color=DARK, label=told)
    axes.set_xlabel("x of the tip [m]")
    axes.set_ylabel("singular value [m]")
    axes.legend()
    return figure


def fig_3_25() -> Figure:
    """Draw force ellipses of the two-link arm in the postures of Fig. 3.23."""
    return _row_of_ellipses("force")


def fig_3_26() -> Figure:
    """Draw both ellipses in a posture for writing: fine control of vertical force and horizontal velocity."""
    return _posture("writing")


def fig_3_27() -> Figure:
    """Draw both ellipses in a posture for throwing: large vertical force and large horizontal velocity."""
    return _posture("throwing")


def _two_links(r: float) -> Configuration:
    """Return the arm with links of 1 m and its tip at (r, 0), elbow up."""
    half = np.arccos(np.clip(0.5 * r, 0.0, 1.0))
    return Configuration(planar_arm([1.0, 1.0]), [half, -2.0 * half])


def _row_of_ellipses(kind: str) -> Figure:
    """Draw the ellipses of one kind in several postures, all in one plane."""
    figure = new_figure(3.6)
    axes = plane_axes(figure)
    for r, colour in zip(_TIPS, _POSTURES, strict=True):
        at = _two_links(r)
        J = at.jacobian("tip")[:2]
        draw_planar_arm(axes, chain(at), colour, 0.35)
        if kind == "velocity":
            draw_ellipse(axes, velocity_ellipsoid(J), (r, 0.0), _VELOCITY_SCALE, colour)
        else:
            draw_ellipse(axes, force_ellipsoid(J), (r, 0.0), _FORCE_SCALE, colour)
    unit = f"{_VELOCITY_SCALE:g} m for 1 m/s" if kind == "velocity" else f"{_FORCE_SCALE:g} m for 1 N"
    axes.set_title(f"{kind} ellipses at the tip, drawn with {unit}; links of 1 m")
    axes.set_xlim(-0.35, 2.45)
    return figure


def _posture(name: str) -> Figure:
    """Draw the first and the last posture of a scenario with both ellipses, and the ratios along x and y."""
    figure = new_figure(3.4)
    scenario = load_scenario(FOLDER / f"{name}.py")
    *_, last = run(scenario)
    for number, (q, title) in enumerate([(scenario.start, "start"), (last.q_next, "end")], start=1):
        at, axes = Configuration(scenario.robot, q), plane_axes(figure, 1, 2, number)
        J, tip = at.jacobian("tip")[:2], at.pose("tip")[:2, 3]
        draw_planar_arm(axes, chain(at))
        draw_ellipse(axes, velocity_ellipsoid(J), tip, _VELOCITY_SCALE, BLUE)
        draw_ellipse(axes, force_ellipsoid(J), tip, _FORCE_SCALE, RED)
        alpha, beta = force_ratio(J, [0.0, 1.0]), velocity_ratio(J, [1.0, 0.0])
        axes.set_title(f"{title}: α along y {alpha:.2f} N, β along x {beta:.2f} m/s", loc="center")
        axes.plot([], [], color=BLUE, label="velocity")
        axes.plot([], [], color=RED, label="force")
        axes.legend(fontsize=8)
    return figure
