"""Pictures of a recording without a display: Rerun's own viewer, headless."""

import os
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from taskopt.errors import BadLog, InvalidValue, MissingFile, TaskoptError
from taskopt.record.viewer.open import viewer_program
from taskopt.record.viewer.writer import TIME

SIZE = "1920x1080"
_PATIENCE = 60.0  # [s] for everything together
_IDLE = 8.0  # [s] without loading after which nothing will come
_SETTLE = 1.5  # [s] between two looks; once they are alike, everything is loaded and laid out
_FIRST = 3.0  # [s] before the first look
_DRIVERS = "apt-get install mesa-vulkan-drivers libvulkan1"


class NoGraphics(TaskoptError, RuntimeError):
    """There is nothing that could draw; the message says what to install."""


def take_picture(recording: Path, picture: Path, at: float | None = None) -> Path:
    """Write a PNG (1920 × 1080) of the recording's own layout, the cursor at `at` [s], else in the middle.

    Takes about 10 s. Raises `MissingFile` and `BadLog` for the recording, `InvalidValue` if the picture
    cannot be written, and `NoGraphics` where there is neither a GPU nor a software renderer.
    """
    if not recording.is_file():
        raise MissingFile(f"no recording at {recording}")
    if at is not None and at < 0.0:
        raise InvalidValue(f"the time of a picture must be ≥ 0 s, got {at:g}")
    if not picture.parent.is_dir():
        raise InvalidValue(f"cannot write {picture}: there is no folder {picture.parent}")
    try:
        with _headless() as viewer:
            viewer.open(str(recording.resolve()))
            end = _loaded(viewer, recording)
            viewer.set_time(TIME, duration=0.5 * end if at is None else min(at, end), play_state="paused")
            image = _settled(viewer)
    except ConnectionError as error:
        raise NoGraphics(
            f"the viewer ended while it drew {recording}; try again, or look with --at 0"
        ) from error
    try:
        picture.write_bytes(image)
    except OSError as error:
        raise InvalidValue(f"cannot write {picture}: {error.strerror}") from error
    return picture


@contextmanager
def _headless() -> Iterator[Any]:
    """A viewer without a window that only this machine can reach; it ends with the context."""
    from rerun.experimental import ViewerClient

    port = _free_port()
    words = [
        viewer_program(),
        "--headless",
        "--port",
        str(port),
        "--bind",
        "127.0.0.1",
        "--hide-welcome-screen",
    ]
    quiet = {**os.environ, "RUST_LOG": "error"}
    program = subprocess.Popen(
        [*words, "--window-size", SIZE], env=quiet, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_until_up(program, port)
        yield ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
    finally:
        program.terminate()
        with suppress(subprocess.TimeoutExpired):
            program.wait(5.0)
        if program.poll() is None:
            program.kill()


def _wait_until_up(program: "subprocess.Popen[bytes]", port: int) -> None:
    """Wait for the viewer to listen and to have found something to draw with."""
    from rerun.experimental import ViewerClient

    start = time.monotonic()
    while time.monotonic() - start < _PATIENCE and program.poll() is None:
        try:
            ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy").get_state()
        except (ConnectionError, RuntimeError, TimeoutError):
            time.sleep(0.2)
        else:
            return
    raise NoGraphics(
        "the viewer does not start without a display: it found no graphics driver; a software renderer "
        f"will do: {_DRIVERS}"
    )


def _loaded(viewer: Any, recording: Path) -> float:
    """Wait until the recording is there; its last time [s]."""
    start = quiet = time.monotonic()
    while time.monotonic() - start < _PATIENCE and time.monotonic() - quiet < _IDLE:
        state = viewer.get_state()
        ends = [t.end for r in state.recordings for t in r.timelines if t.name == TIME and t.end is not None]
        if ends and not state.loading:
            return max(ends) * 1e-9
        if state.loading:
            quiet = time.monotonic()
        time.sleep(0.3)
    raise BadLog(f"the viewer finds no step in {recording}; is it a recording of a run?")


def _settled(viewer: Any) -> bytes:
    """The screen, once it no longer changes."""
    time.sleep(_FIRST)
    start, image = time.monotonic(), b""
    while time.monotonic() - start < _PATIENCE:
        before, image = image, viewer.take_screenshot()
        if image == before:
            break
        time.sleep(_SETTLE)
    return image


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
