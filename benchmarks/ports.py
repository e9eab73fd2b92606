"""Count the lines of code of the ports in tasks/ports, and correct them in the tables of docs/ports.md.

Usage: python benchmarks/ports.py [--write]

A line of code is one that is neither blank nor only a comment nor part of a docstring.
"""

import argparse
import ast
import io
import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "tasks" / "ports"
PAGE = ROOT / "docs" / "ports.md"
ROW = re.compile(r"^(\|[^|]*\|[^|]*\| `(?P<port>\w+)` \|) (?P<lines>\d+) \|", re.MULTILINE)
SILENT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def code_lines(source: str) -> int:
    """Count the lines of a Python source that hold code: no blank lines, comments and docstrings."""
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            text = node.body[0]
            lines -= set(range(text.lineno, (text.end_lineno or text.lineno) + 1))
    return len(lines)


def counted() -> dict[str, int]:
    """Count the lines of code of each port, by the name of its file without ending."""
    return {file.stem: code_lines(file.read_text(encoding="utf-8")) for file in sorted(FOLDER.glob("*.py"))}


def listed(page: str) -> dict[str, int]:
    """Read the lines of each port from the tables of a page."""
    return {row["port"]: int(row["lines"]) for row in ROW.finditer(page)}


def corrected(page: str) -> str:
    """Return a page whose tables state the lines that are counted."""
    lines = counted()
    return ROW.sub(lambda row: f"{row[1]} {lines.get(row['port'], int(row['lines']))} |", page)


def main() -> None:
    """Print the lines of each port, or write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--write", action="store_true", help="correct the numbers in docs/ports.md")
    if parser.parse_args().write:
        PAGE.write_text(corrected(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    for port, lines in counted().items():
        print(f"{lines:4d}  {port}")


if __name__ == "__main__":
    main()
