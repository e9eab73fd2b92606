"""Figures as words, in the same form in every table and sentence of a comparison."""

import numpy as np

from taskopt.bench.comparison.results import Figures


def named(one: Figures) -> str:
    """Return resolver and setting.

    Args:
        one: The figures.

    Returns:
        Both names.
    """
    return f"{one.resolver} {one.setting}"


def share(value: float) -> str:
    """Return a share in per cent, so that 100 % means all and 0 % none.

    Args:
        value: The share, 0 to 1.

    Returns:
        The text; a dash for NaN.
    """
    if np.isnan(value):
        return "–"
    percent = 100.0 * value
    return f"{percent:.2f} %" if 0.0 < percent < 1.0 or 99.0 < percent < 100.0 else f"{percent:.0f} %"


def digits(value: float) -> str:
    """Return two digits of a distance.

    Args:
        value: The distance.

    Returns:
        The text; a dash for NaN, "none" for inf, which is an answer that is not there.
    """
    return "–" if np.isnan(value) else "none" if np.isinf(value) else "0" if value == 0.0 else f"{value:.1e}"


def micro(seconds: float) -> str:
    """Return a time in µs.

    Args:
        seconds: The time [s].

    Returns:
        The text; a dash for NaN.
    """
    return "–" if np.isnan(seconds) else f"{1e6 * seconds:.3g}" if seconds < 1e-3 else f"{1e6 * seconds:.0f}"
