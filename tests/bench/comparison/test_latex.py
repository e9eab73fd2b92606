"""Tables for papers: LaTeX that has a meaning for no sign by accident, and values that are read again."""

import csv
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from taskopt.bench.comparison.latex import latex, write_tables
from taskopt.bench.comparison.tables import Table

TABLE = Table(
    "Set a_b: 50 % & more",
    "‖x − x*‖∞ in µs",
    ("resolver", "right"),
    (("hqp/x_y", "99.50 %"), ("wqp@0.1/{z}", "–")),
)


def test_signs_of_latex_are_escaped() -> None:
    """No bare %, &, _ or brace of the texts is left, and there is one & less than columns in each row."""
    text = latex(TABLE)
    assert r"hqp/x\_y & 99.50 \% \\" in text
    assert r"wqp@0.1/\{z\} & -- \\" in text
    assert r"\caption{Set a\_b: 50 \% \& more. $\|$x $-$ x*$\|$$\infty$ in $\mu$s}" in text
    assert not re.search(r"(?<!\\)[%_#]", text)
    assert text.isascii()


def test_each_table_is_a_file_of_values(tmp_path: Path) -> None:
    """Under its number and title, with the same texts."""
    text, first, second = write_tables(tmp_path, [TABLE, TABLE])
    assert text.read_text(encoding="utf-8").count(r"\begin{tabular}{lr}") == 2
    assert (first.name, second.name) == ("01 Set ab 50 more.csv", "02 Set ab 50 more.csv")
    with first.open(encoding="utf-8", newline="") as file:
        assert [*map(tuple, csv.reader(file))] == [TABLE.heading, *TABLE.rows]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_takes_the_tables(tmp_path: Path) -> None:
    """pdflatex ends without an error."""
    write_tables(tmp_path, [TABLE])
    document = r"\documentclass{article}\usepackage{booktabs}\begin{document}\input{tables}\end{document}"
    (tmp_path / "paper.tex").write_text(document, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == 0
