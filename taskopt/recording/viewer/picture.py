"""Pictures of a recording on machines without a display, drawn by Rerun's own viewer."""

import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rerun.experimental import ViewerClient

from taskopt.errors import BadLog, InvalidValue, MissingFile, TaskoptError
from taskopt.recording.viewer.open import launch
from taskopt.recording.viewer.writer import TIME

SIZE = "1920x1080"
_PATIENCE = 60.0  # [s] for each of: start, load, draw
_IDLE = 8.0  # [s] without loading after which no step will come
_FIRST = 3.0  # [s] before the first look at the screen
_BETWEEN = 1.5  # [s] between two looks; once they are alike, everything is loaded and laid out
_AFTER = 0.1  # [s] after the last tick that still are its time
_GOODBYE = 5.0  # [s] for the viewer to end before it is killed
_DRIVERS = "apt-get install mesa-vulkan-drivers libvulkan1"


class NoGraphics(TaskoptError, RuntimeError):
    """An error that is raised if neither a GPU nor a software renderer can draw; it says what to install."""


def take_picture(recording: Path, picture: Path, at: float | None = None, size: str = SIZE) -> Path:
    """Draw a recording in its own layout to a PNG file, which takes about 10 s.

    Args:
        recording: The recording.
        picture: The PNG file to write.
        at: The time of the cursor [s]; without it the cursor is in the middle of the run.
        size: Width and height [pixels], such as "1920x1080".

    Returns:
        The path of the picture.

    Raises:
        MissingFile: If there is no recording.
        BadLog: If the recording has no steps.
        InvalidValue: If the time is not in the recording, or the picture cannot be written as PNG.
        NoGraphics: If there is neither a GPU nor a software renderer, or the viewer ends or
            does not answer while it draws.
    """
    if not recording.is_file():
        raise MissingFile(f"no recording at {recording}")
    if at is not None and at < 0.0:
        raise InvalidValue(f"the time of a picture must be ≥ 0 s, got {at:g}")
    if picture.suffix.lower() != ".png":
        raise InvalidValue(f"a picture is a file *.png, got {picture.name}")
    if not picture.parent.is_dir():
        raise InvalidValue(f"cannot write {picture}: there is no folder {picture.parent}")
    try:
        with headless(size) as viewer:
            image = drawn(viewer, recording, at)
    except (ConnectionError, TimeoutError) as error:
        raise NoGraphics(
            f"the viewer ended or did not answer while it drew {recording}; try again, or look with --at 0"
        ) from error
    try:
        picture.write_bytes(image)
    except OSError as error:
        raise InvalidValue(f"cannot write {picture}: {error.strerror}") from error
    return picture


def drawn(viewer: ViewerClient, recording: Path, at: float | None = None) -> bytes:
    """Draw a recording in a viewer that may have drawn others before, which it closes.

    Args:
        viewer: A viewer without a window, see `headless`.
        recording: The recording.
        at: The time of the cursor [s]; without it the cursor is in the middle of the run.

    Returns:
        The picture as PNG.

    Raises:
        BadLog: If the recording has no steps.
        InvalidValue: If the time is after the end of the recording.
    """
    if viewer.get_state().recordings:
        viewer.close("all")
    viewer.open(str(recording.resolve()))
    end = _loaded(viewer, recording)
    if at is not None and at > end + _AFTER:
        raise InvalidValue(f"{recording} ends at {end:g} s; there is no picture at {at:g} s")
    viewer.set_time(TIME, duration=0.5 * end if at is None else min(at, end), play_state="paused")
    return _final_screen(viewer)


@contextmanager
def headless(size: str = SIZE) -> Iterator[ViewerClient]:
    """Run a viewer without a window that only this machine can reach; it ends with the context.

    Args:
        size: Width and height of what it draws [pixels], such as "1920x1080".

    Yields:
        The viewer.

    Raises:
        NoGraphics: There is neither a GPU nor a software renderer.
    """
    port = _free_port()
    program = launch("--headless", "--hide-welcome-screen", "--window-size", size, port=port)
    try:
        _wait_until_up(program, port)
        yield ViewerClient.connect(_address(port))
    finally:
        program.terminate()
        with suppress(subprocess.TimeoutExpired):
            program.wait(_GOODBYE)
        if program.poll() is None:
            program.kill()


def _wait_until_up(program: "subprocess.Popen[bytes]", port: int) -> None:
    """Wait until the viewer listens, which it does once it has found a renderer."""
    start = time.monotonic()
    while time.monotonic() - start < _PATIENCE and program.poll() is None:
        try:
            ViewerClient.connect(_address(port)).get_state()
        except (ConnectionError, RuntimeError, TimeoutError):
            time.sleep(0.2)
        else:
            return
    raise NoGraphics(
        "the viewer does not start without a display: it found no graphics driver; a software renderer "
        f"will do: {_DRIVERS}"
    )


def _loaded(viewer: ViewerClient, recording: Path) -> float:
    """Wait until the recording is loaded, and return its last time [s]."""
    start = quiet = time.monotonic()
    while time.monotonic() - start < _PATIENCE and time.monotonic() - quiet < _IDLE:
        state = viewer.get_state()
        timelines = [timeline for loaded in state.recordings for timeline in loaded.timelines]
        ends = [line.end for line in timelines if line.name == TIME and line.end is not None]
        if ends and not state.loading:
            return max(ends) * 1e-9
        if state.loading:
            quiet = time.monotonic()
        time.sleep(0.3)
    raise BadLog(f"the viewer finds no step in {recording}; is it a recording of a run?")


def _final_screen(viewer: ViewerClient) -> bytes:
    """Take screenshots until two in a row are alike, and return the last one as PNG."""
    time.sleep(_FIRST)
    start, image = time.monotonic(), b""
    while time.monotonic() - start < _PATIENCE:
        previous, image = image, viewer.take_screenshot()
        if image == previous:
            break
        time.sleep(_BETWEEN)
    return image


def _address(port: int) -> str:
    """Return the address of a viewer on this machine."""
    return f"rerun+http://127.0.0.1:{port}/proxy"


def _free_port() -> int:
    """Find a port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
