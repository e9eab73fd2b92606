"""The figures by their numbers in the chapter, and writing of them to files."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from taskopt.errors import UnknownName
from taskopt.figures import algorithms, ellipsoids, rotations, singularities, workspace

FIGURES: dict[str, Callable[[], Figure]] = {
    "3.3": singularities.fig_3_3,
    "3.4": singularities.fig_3_4,
    "3.5": singularities.fig_3_5,
    "3.6": singularities.fig_3_6,
    "3.8": rotations.fig_3_8,
    "3.9": rotations.fig_3_9,
    "3.10": rotations.fig_3_10,
    "3.13": singularities.fig_3_13,
    "3.15": algorithms.fig_3_15,
    "3.16": algorithms.fig_3_16,
    "3.17": algorithms.fig_3_17,
    "3.18": algorithms.fig_3_18,
    "3.19": algorithms.fig_3_19,
    "3.20": algorithms.fig_3_20,
    "3.23": ellipsoids.fig_3_23,
    "3.24": ellipsoids.fig_3_24,
    "3.25": ellipsoids.fig_3_25,
    "3.26": ellipsoids.fig_3_26,
    "3.27": ellipsoids.fig_3_27,
    "workspace": singularities.fig_workspace,
    "panda_workspace": workspace.fig_panda_workspace,
}
"""The function that draws each figure, by the number of the figure."""


def render(names: Sequence[str], folder: Path) -> Iterator[Path]:
    """Draw figures and write them as PNG files.

    The figures of runs need the scenarios in the folder `tasks` of the working directory.

    Args:
        names: Numbers of figures, such as "3.16"; none for all.
        folder: Folder for the files, which is made if it does not exist.

    Yields:
        The path of each file when it has been written, such as fig_3_16.png.

    Raises:
        UnknownName: A number is not that of a figure.
        MissingFile: The scenario of a figure does not exist.
    """
    for name in names:
        if name not in FIGURES:
            raise UnknownName("figure", name, FIGURES)
    folder.mkdir(parents=True, exist_ok=True)
    for name in names or FIGURES:
        path = folder / f"fig_{name.replace('.', '_')}.png"
        FIGURES[name]().savefig(path, metadata={"Software": None})
        yield path
