"""The report of a comparison: Markdown, one self-contained HTML page, LaTeX, and tables of all rows."""

import csv
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from taskopt.bench.comparison.findings import findings, limits_of_comparison
from taskopt.bench.comparison.latex import write_tables
from taskopt.bench.comparison.plots import Plot, plots
from taskopt.bench.comparison.results import Results
from taskopt.bench.comparison.tables import Table, long_tables, markdown, short_tables
from taskopt.bench.comparison.trial import ROW
from taskopt.recording.columns import write_parquet

TITLE = "Comparison of resolvers and solvers"
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums }
th, td { border-bottom: 1px solid #ddd; padding: .2em .6em; text-align: right; white-space: nowrap }
th:first-child, td:first-child, td.text { text-align: left; white-space: normal }
th { cursor: pointer; background: #f4f4f4; position: sticky; top: 0 }
input { margin: .4em 0; padding: .2em .4em }
svg { max-width: 100%; height: auto }
summary { cursor: pointer; font-weight: 600; margin: .6em 0 }
"""
_SCRIPT = """
const number = text => { const v = parseFloat(text.replace('–', 'NaN').replace('none', '1e999'));
  return Number.isNaN(v) ? null : v; };
document.querySelectorAll('table').forEach(table => {
  const body = table.tBodies[0];
  table.querySelectorAll('th').forEach((head, column) => head.addEventListener('click', () => {
    const up = head.dataset.up !== 'yes'; head.dataset.up = up ? 'yes' : 'no';
    const key = row => row.cells[column].textContent;
    const sorted = [...body.rows].sort((a, b) => {
      const x = number(key(a)), y = number(key(b));
      if (x === null && y === null) return key(a).localeCompare(key(b)) * (up ? 1 : -1);
      if (x === null) return 1; if (y === null) return -1;
      return (x - y) * (up ? 1 : -1); });
    sorted.forEach(row => body.appendChild(row)); }));
  const box = table.previousElementSibling;
  if (box && box.matches('input')) box.addEventListener('input', () => [...body.rows].forEach(row => {
    row.hidden = !row.textContent.toLowerCase().includes(box.value.toLowerCase()); }));
});
"""


def write_report(rows: Results, folder: Path) -> list[Path]:
    """Write the report of a comparison.

    Args:
        rows: All rows.
        folder: Folder for `benchmark.md` with its figures and `benchmark_sets.md` with the long tables,
            `benchmark.html`, which has both, `benchmark_rows.parquet` and `rows.csv`, and the tables as
            `tables.tex` and in the folder `tables`; it is made if it is not there.

    Returns:
        The files that were written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drawn, short, long = [*plots(rows)], [*short_tables(rows)], [*long_tables(rows)]
    made = [*short, *long]
    texts = {
        "benchmark.md": "\n".join(_markdown(rows, short, drawn)) + "\n",
        "benchmark_sets.md": "\n".join(_sets(long)) + "\n",
        "benchmark.html": "\n".join(_page(rows, made, drawn)) + "\n",
        **{f"benchmark_{plot.name}.svg": plot.svg for plot in drawn},
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    write_parquet(folder / "benchmark_rows.parquet", rows.columns)
    _write_csv(folder / "rows.csv", rows)
    tables_text = write_tables(folder, made)[0]
    return [*(folder / name for name in (*texts, "benchmark_rows.parquet", "rows.csv")), tables_text]


def _markdown(rows: Results, made: Sequence[Table], drawn: Sequence[Plot]) -> Iterator[str]:
    """Yield the lines of the report in Markdown: answers first, then what they rest on."""
    yield f"# {TITLE}\n"
    yield from (f"- **{question}:** {answer}" for question, answer in findings(rows))
    yield from (f"\n{paragraph}" for paragraph in _conditions(rows))
    yield (
        "\nTo look further: [all figures of every resolver on every set](benchmark_sets.md), "
        "[all rows](benchmark_rows.parquet), [what is asked and judged](comparison.md)."
    )
    yield "\n## Tables\n"
    yield from map(markdown, made[:2])
    yield "## Figures\n"
    for plot in drawn:
        yield f"![{plot.name}](benchmark_{plot.name}.svg)\n\n{plot.caption}\n"
    yield "## Limits of this comparison\n"
    yield from (f"- {sentence}" for sentence in limits_of_comparison(rows))
    yield "\n## What was compared\n"
    yield from map(markdown, made[2:])
    yield "## Columns of the rows\n"
    yield from (f"- `{name}`: {meaning}" for name, meaning in ROW.items())


def _sets(made: Sequence[Table]) -> Iterator[str]:
    """Yield the lines of the page with all figures in Markdown."""
    yield f"# {TITLE}: all figures\n"
    yield "[The comparison](benchmark.md) says what these tables rest on, and what they do not show.\n"
    yield "## Tables\n"
    yield from map(markdown, made)


def _page(rows: Results, made: Sequence[Table], drawn: Sequence[Plot]) -> Iterator[str]:
    """Yield the lines of the page."""
    yield f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{TITLE}</title>'
    yield f"<style>{_STYLE}</style></head><body><h1>{TITLE}</h1>"
    yield _list(f"{question}: {answer}".replace("`", "") for question, answer in findings(rows))
    yield from (f"<p>{escape(line)}</p>".replace("`", "") for line in _conditions(rows))
    yield "<h2>Figures</h2>"
    for plot in drawn:
        picture = plot.svg[plot.svg.index("<svg") :]
        yield f"<figure>{picture}<figcaption>{escape(plot.caption)}</figcaption></figure>"
    yield "<h2>Tables</h2><p>A click on a heading sorts; the box above a table keeps rows with its text.</p>"
    for index, table in enumerate(made):
        yield from _html(table, opened=index < 2)
    yield f"<h2>Limits of this comparison</h2>{_list(limits_of_comparison(rows))}"
    meanings = (f"{name}: {meaning}" for name, meaning in ROW.items())
    yield f"<h2>Columns of the rows</h2>{_list(meanings)}<script>{_SCRIPT}</script></body></html>"


def _conditions(rows: Results) -> Iterator[str]:
    """Yield paragraphs on what was run, and on names that every table has."""
    of = rows.conditions
    yield (
        f"{len(rows)} answers of {len(rows.names('resolver'))} resolvers to {len(rows.names('set'))} sets of "
        f"problems, on {of['machine']['cpu']}, taskopt {of['versions'].get('taskopt', '?')}, Python "
        f"{of['versions']['python']}; one thread, deadline {of['deadline']:g} s an answer. "
        "`taskopt bench run` and `taskopt bench report` make this page again."
    )
    yield (
        "`active-set` is the method of this library. `hqp/X` hands the levels to the solver X one after the "
        "other, `wqp/X` all of them at once as a weighted sum, which is another problem. `pinv` is the "
        "closed form, without limits. "
        + " ".join(f"`{name}`: {about}" for name, about in of["settings"].items())
    )


def _list(sentences: Iterator[str]) -> str:
    """Return a list of sentences."""
    return f"<ul>{''.join(f'<li>{escape(sentence)}</li>' for sentence in sentences)}</ul>"


def _html(table: Table, *, opened: bool) -> Iterator[str]:
    """Yield a table that sorts and filters, folded unless it is to be open."""
    yield f"<details{' open' if opened else ''}><summary>{escape(table.title)}</summary>"
    yield f"<p>{escape(table.note)}</p><input placeholder='filter'><table><thead><tr>"
    yield "".join(f"<th>{escape(cell)}</th>" for cell in table.heading) + "</tr></thead><tbody>"
    for row in table.rows:
        cells = (f"<td{' class=text' if len(cell) > 40 else ''}>{escape(cell)}</td>" for cell in row)
        yield f"<tr>{''.join(cells)}</tr>"
    yield "</tbody></table></details>"


def _write_csv(path: Path, rows: Results) -> None:
    """Write all rows as comma-separated values."""
    with path.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(rows.columns)
        lines.writerows(zip(*(column.tolist() for column in rows.columns.values()), strict=True))
