"""The warning about statements of a robot's file that the robot cannot represent."""

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from taskopt.errors import DroppedWarning

_PACKAGE = str(Path(__file__).parents[2] / "_").removesuffix("_")  # with the separator at its end


def warn_of_dropped(path: str | Path, dropped: Sequence[str]) -> None:
    """Warn of everything in a file that the robot lacks; the warning points to the line of the caller.

    Args:
        path: The file.
        dropped: One sentence for each thing that is missing. If there are none, nothing is warned of.

    Warns:
        DroppedWarning: There is at least one sentence.
    """
    if dropped:
        message = f"{path} is read, but for this, which robot.dropped lists: {'; '.join(dropped)}"
        warnings.warn(message, DroppedWarning, stacklevel=_depth_of_caller())


def _depth_of_caller() -> int:
    """Return the number of stack frames from `warn_of_dropped` up to the first one outside this package."""
    depth, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        depth, frame = depth + 1, frame.f_back
    return depth
