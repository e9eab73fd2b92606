"""The one warning about what a robot's file states and the robot does not have."""

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from taskopt.errors import DroppedWarning

_PACKAGE = str(Path(__file__).parents[2])


def warn_of_dropped(path: str | Path, dropped: Sequence[str]) -> None:
    """Warn of everything in a file that does not reach the robot, at the user's own line.

    Args:
        path: The file.
        dropped: One sentence for each thing; no sentence, no warning.

    Warns:
        DroppedWarning: There is a sentence.
    """
    if dropped:
        message = f"{path} is read, but for this, which robot.dropped lists: {'; '.join(dropped)}"
        warnings.warn(message, DroppedWarning, stacklevel=_depth_of_caller())


def _depth_of_caller() -> int:
    """Return how many frames above `warn_of_dropped` the first one outside this package is."""
    depth, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        depth, frame = depth + 1, frame.f_back
    return depth
