"""Makes an environment for each peer, since what they need cannot be installed together.

    python benchmarks/peers/environments.py FOLDER            # all of them; what is there is kept
    python benchmarks/peers/environments.py FOLDER --only embodik

`tick.py --peers FOLDER` and `peers/sequences.py --peers FOLDER` run each peer in its own. One that cannot be
installed is named with the reason that pip gives.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent


class Peer(NamedTuple):
    """A library that is compared with.

    Attributes:
        script: Its script in this folder.
        solvers: Names that the script knows, each of which takes part.
        packages: What pip installs; the first one is the peer.
    """

    script: str
    solvers: tuple[str, ...]
    packages: tuple[str, ...]


PEERS = {
    "placo": Peer("placo_peer.py", ("eiquadprog",), ("placo==0.10.2",)),
    "mink": Peer("mink_peer.py", ("daqp",), ("mink==1.3.0", "mujoco", "qpsolvers", "daqp")),
    "pink": Peer("pink_peer.py", ("daqp", "quadprog"), ("pin-pink==4.4.0", "daqp", "quadprog")),
    "embodik": Peer("embodik_peer.py", ("default", "refined"), ("embodik==0.23.2",)),
}


def interpreter(folder: Path, name: str) -> Path:
    """Return where the interpreter of a peer is, or would be."""
    return folder / name / "bin" / "python"


def installed(folder: Path) -> dict[str, Peer]:
    """Return the peers that have an environment in a folder."""
    return {name: peer for name, peer in PEERS.items() if (folder / name / "installed").exists()}


def install(folder: Path, name: str) -> str:
    """Make the environment of a peer, unless it is there.

    Returns:
        The reason why that failed, in a line; "" if it is there.
    """
    done = folder / name / "installed"
    if done.exists():
        return ""
    commands = (
        [sys.executable, "-m", "venv", "--clear", str(folder / name)],
        [str(interpreter(folder, name)), "-m", "pip", "install", "--quiet", *PEERS[name].packages],
    )
    for command in commands:
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            errors = [line for line in run.stderr.splitlines() if line.startswith("ERROR")]
            return (errors or run.stderr.splitlines() or ["no reason was given"])[-1]
    done.write_text("\n".join(PEERS[name].packages), encoding="utf-8")
    return ""


def main() -> int:
    """Read the command line; the exit status tells whether a peer is missing."""
    parser = argparse.ArgumentParser(description="Make an environment for each peer.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=PEERS, default=list(PEERS))
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    missing = 0
    for name in arguments.only:
        reason = install(arguments.folder, name)
        missing += bool(reason)
        print(f"{name}: {f'missing: {reason}' if reason else PEERS[name].packages[0]}", flush=True)
    return missing


if __name__ == "__main__":
    raise SystemExit(main())
