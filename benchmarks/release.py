"""Build the wheel and the source archive, and try each of them in a clean environment.

    python benchmarks/release.py                      # both archives to dist/
    python benchmarks/release.py --to FOLDER

It stops at the first thing that does not hold: the version is the same in pyproject.toml, CITATION.cff and
the newest section of CHANGELOG.md; both archives are built; each installs with its dependencies alone; and
there the commands that a new user tries first end well, far from the source. Nothing is uploaded. Needs the
extra [dev]; dependencies come from the index that pip is set to.
"""

import argparse
import re
import subprocess
import sys
import tomllib
import venv
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
TRY = """
import numpy as np
from importlib.metadata import version
import taskopt
from taskopt import Hierarchy, Level, resolve
assert version("taskopt") == "{version}", version("taskopt")
assert "site-packages" in taskopt.__file__, taskopt.__file__
levels = [Level([[1.0, 1.0]], [4.0]), Level(np.eye(2), [2.0, 0.0])]
answer = resolve(Hierarchy(levels, box=([-1, -1], [1, 1])))
np.testing.assert_allclose(answer.x, [1.0, 1.0], atol=1e-12)
"""
COMMANDS = (
    ("--version",),
    ("list",),
    ("bench", "sets"),
    ("bench", "run", "--set", "contradicting", "-r", "active-set", "--setting", "cold", "--out", "rows"),
)


def stated_versions(root: Path) -> dict[str, str]:
    """Read the version where it is stated.

    Args:
        root: Folder of the project.

    Returns:
        Version by name of the file; "none" where a file has none.
    """
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    patterns = {"CITATION.cff": r"^version: (\S+)", "CHANGELOG.md": r"^## \[(\d[^\]]*)\]"}
    found = {"pyproject.toml": str(project["version"])}
    for name, pattern in patterns.items():
        match = re.search(pattern, (root / name).read_text(encoding="utf-8"), re.MULTILINE)
        found[name] = match[1] if match else "none"
    return found


def one_version(root: Path) -> str:
    """Return the version of the project, which all files must state alike."""
    found = stated_versions(root)
    if len(set(found.values())) != 1:
        raise SystemExit(f"the files state different versions: {found}; make them agree")
    return found["pyproject.toml"]


def build(folder: Path) -> list[Path]:
    """Build both archives, the wheel from the source archive, and return them."""
    before = set(folder.glob("taskopt-*"))
    subprocess.run([sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)], check=True)
    made = sorted(set(folder.glob("taskopt-*")) - before)
    if [path.suffix for path in made] != [".whl", ".gz"]:
        raise SystemExit(f"{folder} must have no archive of this version before; built: {made}")
    return made


def try_archive(archive: Path, version: str) -> None:
    """Install an archive in an environment of its own, and use it there."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        venv.create(folder / "env", with_pip=True)
        programs = folder / "env" / "bin"
        subprocess.run([programs / "pip", "install", "--quiet", str(archive)], check=True)
        subprocess.run([programs / "pip", "check"], check=True)
        subprocess.run([programs / "python", "-c", TRY.format(version=version)], check=True, cwd=folder)
        for command in COMMANDS:
            subprocess.run(
                [programs / "taskopt", *command], check=True, cwd=folder, stdout=subprocess.DEVNULL
            )
    print(f"{archive.name} installs and works")


def main() -> None:
    """Read the command line, build and try."""
    options = argparse.ArgumentParser(description="Build and try the archives of a release.")
    options.add_argument("--to", type=Path, default=ROOT / "dist", help="folder of the archives")
    folder = options.parse_args().to
    folder.mkdir(parents=True, exist_ok=True)
    version = one_version(ROOT)
    for archive in build(folder):
        try_archive(archive, version)


if __name__ == "__main__":
    main()
