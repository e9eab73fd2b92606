"""The scripts of benchmarks/ import each other by name, since Python looks beside the script that is run."""

import sys
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "benchmarks"
sys.path[:0] = [str(FOLDER), str(FOLDER / "accept")]
