"""The common style of all figures: colours that colour-blind readers can distinguish, and sizes."""

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
"""Four colours of the palette of Okabe and Ito; the joints of an arm have the first three."""
PURPLE = "#CC79A7"
GREY, DARK = "#6B6B6B", "#333333"
JOINTS = (BLUE, ORANGE, GREEN)

_SETTINGS = {
    "font": {"size": 9.0},
    "axes": {
        "titlesize": 9.0,
        "titlelocation": "left",
        "titlecolor": GREY,
        "labelsize": 9.0,
        "labelcolor": GREY,
        "edgecolor": "#9A9A9A",
        "grid": True,
        "spines.top": False,
        "spines.right": False,
    },
    "grid": {"color": "#E6E6E6", "linewidth": 0.7},
    "xtick": {"color": GREY},
    "ytick": {"color": GREY},
    "legend": {"frameon": False, "labelcolor": GREY},
    "lines": {"linewidth": 1.6},
    "text": {"color": GREY},
}
_WIDTH, _DPI = 7.6, 110  # [inch], [1/inch]: 836 pixels, the width of a page on a code host


def new_figure(height: float = 2.8) -> Figure:
    """Make an empty figure in the common style.

    Args:
        height: Height of the figure [inch]; the width is the same for all.

    Returns:
        The figure; axes are added by the caller.
    """
    for group, values in _SETTINGS.items():
        mpl.rc(group, **values)  # type: ignore[arg-type]
    return Figure(figsize=(_WIDTH, height), dpi=_DPI, layout="constrained")


def plane_axes(figure: Figure, rows: int = 1, columns: int = 1, number: int = 1) -> Axes:
    """Add axes in which a planar arm is drawn to scale, in metres.

    Args:
        figure: The figure.
        rows: Number of rows of the grid of axes.
        columns: Number of columns of the grid.
        number: Number of these axes in the grid, counted from 1.

    Returns:
        The axes.
    """
    axes = figure.add_subplot(rows, columns, number)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    return axes


def number(value: float, digits: int = 3) -> str:
    """Write a number with a fixed number of digits, a minus sign in place of a hyphen, and no negative zero.

    Args:
        value: The number.
        digits: Number of digits after the point.

    Returns:
        The text.
    """
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")
