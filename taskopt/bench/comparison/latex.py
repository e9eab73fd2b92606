"""Tables in LaTeX and as comma-separated values, to be taken into a paper."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from taskopt.bench.comparison.tables import Table

_SIGNS = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{",
    "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "µ": r"$\mu$", "‖": r"$\|$",
    "∞": r"$\infty$", "−": "$-$", "–": "--", "×": r"$\times$", "±": r"$\pm$", "→": r"$\to$",
    "½": r"$\frac12$",
}  # fmt: skip
_HEAD = "% Needs \\usepackage{booktabs}. Written by `taskopt bench report`.\n"


def latex(table: Table) -> str:
    r"""Write a table in LaTeX, as a `tabular` inside a `table`.

    Args:
        table: The table.

    Returns:
        Its text, with the title and the note as its caption; it needs the package booktabs.
    """
    caption = " ".join(_escaped(part) for part in (f"{table.title}.", table.note) if part)
    columns = "l" + "r" * (len(table.heading) - 1)
    lines = [
        r"\begin{table}",
        rf"\caption{{{caption}}}",
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        _row(table.heading),
        r"\midrule",
        *map(_row, table.rows),
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]
    return "\n".join([*lines, ""])


def write_tables(folder: Path, tables: Iterable[Table]) -> list[Path]:
    """Write tables as `tables.tex`, and each of them as a file of comma-separated values in `tables`.

    Args:
        folder: An existing folder.
        tables: The tables.

    Returns:
        The files; those of comma-separated values have the number and the title of their table as a name.
    """
    made = [*tables]
    text = folder / "tables.tex"
    text.write_text(_HEAD + "\n".join(map(latex, made)), encoding="utf-8")
    (folder / "tables").mkdir(exist_ok=True)
    files = [text]
    for number, table in enumerate(made, 1):
        files.append(folder / "tables" / f"{number:02d} {_file_name(table.title)}.csv")
        with files[-1].open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([table.heading, *table.rows])
    return files


def _row(cells: Sequence[str]) -> str:
    """Return a row of a table."""
    return " & ".join(map(_escaped, cells)) + r" \\"


def _escaped(text: str) -> str:
    """Return a text in which no sign has a meaning in LaTeX."""
    return "".join(_SIGNS.get(sign, sign) for sign in text)


def _file_name(title: str) -> str:
    """Return a title without signs that a file system does not take."""
    kept = "".join(sign for sign in title if sign.isalnum() or sign in " -")
    return " ".join(kept.split())
