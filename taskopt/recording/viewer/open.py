"""Opening of recordings in the Rerun viewer, and search for a viewer that is already running."""

import os
import platform
import socket
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path

from taskopt.errors import InvalidValue, NotInstalled

PORT = 9876  # on which a Rerun viewer listens by default
_PATIENCE = 10.0  # [s] for a viewer to start listening
_REQUIREMENT = "'rerun-sdk>=0.41,<0.42'"


def show(file: Path) -> None:
    """Open a recording in a window, and return at once.

    Args:
        file: The recording.

    Raises:
        InvalidValue: If there is no display to open the window on.
        NotInstalled: If the viewer is not installed.
    """
    require_display(file)
    launch(str(file), start_new_session=True)


def require_display(file: Path) -> None:
    """Raise an error unless a window can be opened.

    Args:
        file: What is to be shown in it.

    Raises:
        InvalidValue: If there is no display.
    """
    if not has_display():
        command = "taskopt view" if file.suffix == ".arrow" else "rerun"
        raise InvalidValue(
            f"there is no display to open {file} on; write a picture instead (--picture out.png), or "
            f"copy the file to a machine with a display and run: {command} {file.name}"
        )


def live_viewer(port: int = PORT) -> str:
    """Find the viewer that is running on this machine, or start one.

    Args:
        port: The port that the viewer listens on.

    Returns:
        The address of the viewer.

    Raises:
        InvalidValue: If none runs and there is no display, or if it does not start within 10 s.
        NotInstalled: If none runs and the viewer is not installed.
    """
    address = f"rerun+http://127.0.0.1:{port}/proxy"
    if listens(port):
        return address
    if not has_display():
        raise InvalidValue(
            f"no viewer listens on port {port} and there is no display to open one on; start one elsewhere "
            f"and forward the port (ssh -R {port}:localhost:{port} HOST), or leave out --live"
        )
    launch(port=port, start_new_session=True)
    start = time.monotonic()
    while time.monotonic() - start < _PATIENCE:
        if listens(port):
            return address
        time.sleep(0.1)
    raise InvalidValue(
        f"the viewer did not start within {_PATIENCE:g} s; leave out --live and open the recording later"
    )


def launch(*words: str, port: int = PORT, start_new_session: bool = False) -> "subprocess.Popen[bytes]":
    """Start a viewer that only this machine can reach, and that says nothing on the terminal.

    If a viewer listens on the port already, it opens the files of the words, and the new one ends.

    Args:
        *words: Files to open, and options of the program.
        port: The port that it listens on.
        start_new_session: True if the viewer outlives this process.

    Returns:
        The process.

    Raises:
        NotInstalled: If the viewer is not installed.
    """
    command = [viewer_program(), *words, "--port", str(port), "--bind", "127.0.0.1"]
    quiet, nowhere = {**os.environ, "RUST_LOG": "error"}, subprocess.DEVNULL
    return subprocess.Popen(
        command, env=quiet, stdout=nowhere, stderr=nowhere, start_new_session=start_new_session
    )


def listens(port: int) -> bool:
    """Try to connect to a port of this machine.

    Args:
        port: The port.

    Returns:
        True if something accepts connections on it.
    """
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
    except OSError:
        return False
    return True


def has_display() -> bool:
    """Return True if a window can be opened.

    Returns:
        True on systems other than Linux, and on Linux if DISPLAY or WAYLAND_DISPLAY is set.
    """
    if platform.system() != "Linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def viewer_program() -> str:
    """Find the viewer that rerun-sdk installs, even if its environment is not activated.

    Returns:
        The path of the program.

    Raises:
        NotInstalled: If there is no such program.
    """
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise NotInstalled("Rerun's viewer", _REQUIREMENT)
    program = Path(package.origin).parent / ("rerun.exe" if platform.system() == "Windows" else "rerun")
    if not program.is_file():
        raise NotInstalled("Rerun's viewer", _REQUIREMENT)
    return str(program)
