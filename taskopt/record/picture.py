"""Pictures of a recording without a display: Rerun's own viewer, headless."""

import socket
import time
from pathlib import Path
from typing import Any

from taskopt.errors import InvalidValue, MissingFile, NotInstalled, TaskoptError
from taskopt.record.stage import TIME
from taskopt.record.viewing import viewer_program

_SETTLE = 4.0  # [s] that the viewer needs to load meshes and lay out plots
_ATTEMPTS = 40
_DRIVERS = "apt-get install mesa-vulkan-drivers libvulkan1"


class NoGraphics(TaskoptError, RuntimeError):
    """There is nothing that could draw; the message says what to install."""


def take_picture(recording: Path, picture: Path, at: float | None = None, width: int = 1600) -> Path:
    """Write a PNG of the recording's own layout, with the cursor at `at` [s] (default: the middle).

    Takes 10 to 15 s. Raises `MissingFile` for the recording, `InvalidValue` if the picture cannot be
    written, and `NoGraphics` where there is neither a GPU nor a software renderer.
    """
    if not recording.is_file():
        raise MissingFile(f"no recording at {recording}")
    if at is not None and at < 0.0:
        raise InvalidValue(f"the time of a picture must be ≥ 0 s, got {at:g}")
    if not picture.parent.is_dir():
        raise InvalidValue(f"cannot write {picture}: there is no folder {picture.parent}")
    viewer = _viewer()
    try:
        _wait_until_ready(viewer)
        viewer.open(str(recording.resolve()))
        time.sleep(_SETTLE)
        viewer.set_time(TIME, duration=_middle(recording) if at is None else at, play_state="paused")
        time.sleep(_SETTLE)
        picture.write_bytes(viewer.take_screenshot(max_size=width))
    except OSError as error:
        raise InvalidValue(f"cannot write {picture}: {error.strerror}") from error
    finally:
        viewer.quit()
    return picture


def _viewer() -> Any:
    try:
        from rerun.experimental import ViewerClient
    except ImportError as error:
        raise NotInstalled("Rerun 0.41 with its viewer", "'rerun-sdk>=0.41,<0.42'") from error
    program = viewer_program()
    return ViewerClient.spawn(
        headless=True, port=_free_port(), hide_welcome_screen=True, executable_path=program
    )


def _wait_until_ready(viewer: Any) -> None:
    """A viewer without graphics ends at once; one with them answers within seconds."""
    for _ in range(_ATTEMPTS):
        try:
            viewer.get_state()
        except (RuntimeError, OSError, ValueError):
            time.sleep(0.25)
        else:
            return
    raise NoGraphics(
        f"the viewer does not start without a display: no graphics driver was found; install one with: {_DRIVERS}"
    )


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
