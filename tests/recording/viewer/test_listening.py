"""Viewers that the package starts can be reached from this machine only."""

import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address
from pathlib import Path

import pytest

from taskopt.recording.viewer.open import launch, listens, viewer_program

HEADLESS = ("--headless", "--hide-welcome-screen")
LISTENING = "0A"  # the state in Linux's tables of sockets
LINUX = pytest.mark.skipif(not Path("/proc/net/tcp").is_file(), reason="only Linux lists sockets as files")


def free_port() -> int:
    """A port on which nobody listens."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def listening(process: int) -> dict[int, str]:
    """Addresses on which a process listens, by port, from the kernel's tables of sockets."""
    links = (descriptor.readlink().name for descriptor in Path(f"/proc/{process}/fd").iterdir())
    own = {link.removeprefix("socket:[").removesuffix("]") for link in links if link.startswith("socket:")}
    found = {}
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == LISTENING and words[9] in own:
                address, port = words[1].split(":")
                groups = [bytes.fromhex(address[i : i + 8])[::-1] for i in range(0, len(address), 8)]
                found[int(port, 16)] = str(ip_address(b"".join(groups)))
    return found


@contextmanager
def viewer(process: "subprocess.Popen[bytes]", port: int) -> Iterator[dict[int, str]]:
    """Wait until a viewer listens, and say where; it ends with the context."""
    try:
        for _ in range(300):
            if listens(port):
                break
            time.sleep(0.1)
        yield listening(process.pid)
    finally:
        process.kill()
        process.wait()


@pytest.mark.slow
@LINUX
def test_a_viewer_listens_on_this_machine_only():
    """All of its sockets are bound to 127.0.0.1."""
    port = free_port()
    with viewer(launch(*HEADLESS, port=port), port) as found:
        assert found == {port: "127.0.0.1"}


@pytest.mark.slow
@LINUX
def test_a_viewer_that_others_can_reach_is_noticed():
    """As Rerun starts by itself, it listens on all addresses, which the table of sockets shows."""
    port = free_port()
    words, nowhere = [viewer_program(), *HEADLESS, "--port", str(port)], subprocess.DEVNULL
    with viewer(subprocess.Popen(words, stdout=nowhere, stderr=nowhere), port) as found:
        assert found == {port: "0.0.0.0"}
