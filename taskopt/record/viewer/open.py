"""Opening recordings in the Rerun viewer, and finding it."""

import os
import platform
import socket
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

from taskopt.errors import InvalidValue, MissingFile, NotInstalled
from taskopt.record.reading import LOGS, RECORDING, newest_log

PORT = 9876  # where a Rerun viewer listens if nobody says otherwise
_PATIENCE = 10.0  # [s] for a viewer to start listening


def recording(path: str | Path = LOGS) -> Path:
    """The recording that a path means: the file itself, a log's, or the newest below a folder."""
    place = Path(path)
    if place.is_file():
        return place
    if not place.exists():
        raise MissingFile(f"no recording or log folder at {place}; make one with: taskopt run SCENARIO")
    file = newest_log(place) / RECORDING
    if not file.is_file():
        raise MissingFile(f"the log {file.parent} has no {RECORDING}: its run ended before the first step")
    return file


def show(file: Path) -> None:
    """Open a recording in a window; raise `InvalidValue` where there is no display to open it on."""
    if not has_display():
        raise InvalidValue(
            f"there is no display to open {file} on; write a picture instead (--picture out.png), or "
            f"copy the file to a machine with a display and run: rerun {file.name}"
        )
    subprocess.Popen([viewer_program(), str(file)], start_new_session=True)


def live_viewer(port: int = PORT) -> str:
    """Address of the viewer that runs here; one is opened if none does.

    Raises `InvalidValue` where none runs and there is no display, or if it does not start.
    """
    address = f"rerun+http://127.0.0.1:{port}/proxy"
    if listens(port):
        return address
    if not has_display():
        raise InvalidValue(
            f"no viewer listens on port {port} and there is no display to open one on; start one elsewhere "
            f"and forward the port (ssh -R {port}:localhost:{port} …), or leave out --live"
        )
    subprocess.Popen([viewer_program(), "--port", str(port), "--bind", "127.0.0.1"], start_new_session=True)
    start = time.monotonic()
    while time.monotonic() - start < _PATIENCE:
        if listens(port):
            return address
        time.sleep(0.1)
    raise InvalidValue(
        f"the viewer did not start within {_PATIENCE:g} s; leave out --live and open the recording later"
    )


def listens(port: int) -> bool:
    """Whether something on this machine accepts connections on a port."""
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
    except OSError:
        return False
    return True


def has_display() -> bool:
    """Whether a window can be opened."""
    if platform.system() != "Linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def viewer_program() -> str:
    """The viewer that rerun-sdk brings, whether or not its environment is activated."""
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise NotInstalled("Rerun's viewer", "'rerun-sdk>=0.41,<0.42'")
    program = Path(package.origin).parent / ("rerun.exe" if platform.system() == "Windows" else "rerun")
    if not program.is_file():
        raise NotInstalled("Rerun's viewer", "'rerun-sdk>=0.41,<0.42'")
    return str(program)
