"""The figures and the report of a comparison, from rows that are made by hand."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskopt.bench.comparison.campaign import FILE
from taskopt.bench.comparison.difference import difference
from taskopt.bench.comparison.findings import findings
from taskopt.bench.comparison.report import write_report
from taskopt.bench.comparison.results import (
    SHIFT,
    Results,
    all_figures,
    figures,
    profile,
    read_results,
    shifted_mean,
)
from taskopt.bench.comparison.tables import long_tables, markdown, short_tables
from taskopt.bench.comparison.trial import BLANK
from taskopt.errors import InvalidValue, MissingFile
from taskopt.recording.columns import read_parquet

CONDITIONS = {
    "versions": {"python": "3.11.7", "taskopt": "0"}, "machine": {"cpu": "C", "cores": 2, "system": "S"},
    "repeats": 3, "deadline": 1.0, "settings": {"cold": "Cold."}, "missing": {"gurobi": "gurobipy"},
}  # fmt: skip


def about(name: str, *, hard: bool = False, checksum: str = "a") -> dict[str, Any]:
    return {
        "name": name, "version": 1, "checksum": checksum, "hard": hard, "description": "Some.", "problems": 2,
        "sequences": 1, "unknowns": {"s": 3},
    }  # fmt: skip


def write(folder: Path, cells: dict[tuple[str, str], list[dict[str, Any]]], checksum: str = "a") -> Results:
    """Write rows of (set, resolver) as a comparison would, and read them."""
    sets = {
        "easy": about("easy", checksum=checksum),
        "hard": about("hard", hard=True, checksum=checksum),
    }
    lines = [json.dumps({"conditions": CONDITIONS | {"sets": sets}})]
    for (name, resolver), rows in cells.items():
        filled = [BLANK | {"index": index, "reference": "rational"} | row for index, row in enumerate(rows)]
        columns = {key: [row[key] for row in filled] for key in BLANK}
        cell = {"set": name, "sequence": "s", "resolver": resolver, "setting": "cold"}
        lines.append(json.dumps({"cell": cell, "rows": columns}))
    folder.mkdir(exist_ok=True)
    (folder / FILE).write_text("\n".join(lines) + "\n")
    return read_results(folder)


def table_of(rows: Results, title: str) -> tuple[tuple[str, ...], ...]:
    """Return the lines of a table of the first page."""
    return next(table.rows for table in short_tables(rows) if table.title == title)


def row(verdict: str, distance: float, seconds: float) -> dict[str, Any]:
    claim = {"claimed": verdict != "no claim", "verdict": verdict, "status": "SOLVED"}
    return claim | {"distance": distance, "cpu": seconds, "wall": 2 * seconds}


CELLS = {
    ("easy", "active-set"): [row("proven", 0.0, 1e-5), row("proven", 1e-12, 4e-5)],
    ("easy", "hqp/x"): [row("proven", 1e-10, 2e-5), row("refuted", 1e-2, 2e-5)],
    ("easy", "pinv"): [row("no claim", 1e-16, 1e-6), row("no claim", np.inf, 1e-6)],
    ("hard", "active-set"): [row("undecided", np.nan, 1e-3), {"status": "CRASHED", "note": "gone"}],
}


def test_shares_are_counted(tmp_path: Path) -> None:
    """By hand: half of the claims of hqp/x are refuted, and it is right in half of the problems."""
    found = {one.resolver: one for one in all_figures(write(tmp_path, CELLS).well_scaled)}
    one = found["hqp/x"]
    assert (one.answers, one.claimed, one.proven, one.refuted, one.right) == (2, 1.0, 0.5, 0.5, 0.5)
    assert one.distance == (1e-2, 1e-2, 1e-2)
    assert one.mean == pytest.approx(2e-5)
    assert found["pinv"].claimed == 0.0
    assert found["pinv"].distance[2] == np.inf
    hard = figures(read_results(tmp_path).where(set="hard"))
    assert hard.proven_if == hard.refuted_if == 0.0
    assert (hard.undecided, hard.failed, hard.right) == (0.5, 1, 0.0)
    assert hard.missed == 1.0


def test_the_mean_is_shifted_and_geometric() -> None:
    """Of equal times it is that time; of two, the root of the shifted product less the shift."""
    assert shifted_mean(np.full(3, 7e-6)) == pytest.approx(7e-6)
    both = shifted_mean(np.array([0.0, 30e-6]))
    assert both == pytest.approx(np.sqrt(SHIFT * (SHIFT + 30e-6)) - SHIFT)


def test_profiles_count_proven_answers_only(tmp_path: Path) -> None:
    """active-set is quickest on the first problem by 2, and alone on the second, which hqp/x has wrong."""
    rows = write(tmp_path, CELLS).well_scaled
    ratios = profile(rows, [("active-set", "cold"), ("hqp/x", "cold"), ("pinv", "cold")])
    np.testing.assert_allclose(ratios["active-set", "cold"], [1.0, 1.0])
    np.testing.assert_allclose(ratios["hqp/x", "cold"], [2.0, np.inf])
    np.testing.assert_allclose(ratios["pinv", "cold"], [np.inf, np.inf])


def test_what_answers_give_up_is_counted(tmp_path: Path) -> None:
    """By hand: half of the answers are worse at level 1, by 0.5 at most; 3 rows change in the mean."""
    kept = {"outside": 0.0, "regret": 0.0, "level": 0, "changes": -1}
    broken = {"outside": 1e-3, "regret": 0.5, "level": 1, "changes": 3}
    rows = [row("proven", 0.0, 1e-6) | kept, row("refuted", 1.0, 1e-6) | broken]
    table = table_of(write(tmp_path, {("easy", "hqp/x"): rows}), "Limits, priorities and active sets")
    assert table == (("hqp/x", "cold", "1.0e-03", "50 %", "0 %", "5.0e-01", "3"),)


def test_the_exponent_of_growth_is_that_of_the_times(tmp_path: Path) -> None:
    """Times that grow with the square of the number of joints, from 7 to 28 joints."""
    of = about("snakes") | {"unknowns": {"a": 7, "b": 14, "c": 28}}
    lines = [json.dumps({"conditions": CONDITIONS | {"sets": {"snakes": of}}})]
    for name, seconds in (("a", 0.01), ("b", 0.04), ("c", 0.16)):
        filled = [BLANK | {"index": 0, "reference": "rational"} | row("proven", 0.0, seconds)]
        cell = {"set": "snakes", "sequence": name, "resolver": "hqp/x", "setting": "cold"}
        rows = {key: [one[key] for one in filled] for key in BLANK}
        lines.append(json.dumps({"cell": cell, "rows": rows}))
    (tmp_path / FILE).write_text("\n".join(lines) + "\n")
    ((_, _, exponent, first, last),) = table_of(read_results(tmp_path), "Growth with the number of joints")
    assert float(exponent) == pytest.approx(2.0, abs=0.01)  # the mean has a shift of 10 µs
    assert first.startswith("7:")
    assert last.startswith("28:")


def test_an_answer_without_a_known_optimum_proves_no_accuracy(tmp_path: Path) -> None:
    """It is not counted, and a resolver without any other is not called accurate."""
    unknown = row("proven", np.nan, 1e-6) | {"reference": "none"}
    some = {("easy", "active-set"): [row("proven", 1e-12, 1e-6), unknown], ("easy", "b"): [unknown] * 2}
    said = dict(findings(write(tmp_path, some)))["Most accurate"]
    assert said == (
        "`active-set cold`: none of its 1 answers where the optimum is known is further than 1.0e-12 from it."
    )


def test_rows_without_times_have_no_figures(tmp_path: Path) -> None:
    """A report of answers that were all refused is written without them."""
    refused = row("no claim", np.nan, np.nan) | {"status": "REFUSED"}
    paths = write_report(write(tmp_path, {("easy", "pinv"): [refused] * 2}), tmp_path / "report")
    assert not [path for path in paths if path.suffix == ".svg"]
    assert (tmp_path / "report" / "benchmark.md").is_file()


def test_findings_name_what_the_rows_show(tmp_path: Path) -> None:
    """Most accurate, quickest, who claims what is refuted, where the closed form suffices."""
    weights = [row("proven", 1e-2, 1e-7)] * 2  # of its own problem, and far from the strict optimum
    found = dict(findings(write(tmp_path, CELLS | {("easy", "wqp/x"): weights})))
    assert (
        "`active-set cold`: none of its 2 answers where the optimum is known is further than 1.0e-12"
        in found["Most accurate"]
    )
    assert found["Quickest cold"].startswith("`active-set`: 21.6 µs")
    assert found["Quickest warm"].startswith("None that is right")
    assert "Otherwise: hqp/x (50 %)." in found["Claim what they do not reach"]
    assert "in a part of: easy (50 %)" in found["The closed form suffices"]
    assert "at most 50 % of the answers to a set (hard)" in found["Undecided"]
    assert "wqp/x" not in "".join(found.values())


@pytest.mark.parametrize(
    ("setting", "words"), [("warm", "hqp/x"), ("defaults", "by default: liar (100 %). Otherwise: none.")]
)
def test_other_settings_are_told_apart(tmp_path: Path, setting: str, words: str) -> None:
    """The quickest warm one, and claims at default tolerances, have sentences of their own."""
    name, verdict = ("hqp/x", "proven") if setting == "warm" else ("liar", "refuted")
    rows = write(tmp_path, {("easy", "active-set"): CELLS["easy", "active-set"]})
    other = write(tmp_path, {("easy", name): [row(verdict, 0.0, 2e-5)] * 2})
    columns = {key: np.concatenate([rows.columns[key], other.columns[key]]) for key in rows.columns}
    columns["setting"] = np.array(["cold"] * 2 + [setting] * 2, dtype=object)
    found = "\n".join(answer for _, answer in findings(Results(rows.conditions, columns)))
    assert words in found


def test_a_reader_finds_the_answers_on_the_first_screen(tmp_path: Path) -> None:
    """Every question and its answer stand in the first ten lines; then resolvers and sets, a line each."""
    rows = write(tmp_path / "rows", CELLS)
    write_report(rows, tmp_path / "report")
    screen = (tmp_path / "report" / "benchmark.md").read_text().splitlines()[:10]
    for question, answer in findings(rows):
        assert f"- **{question}:** {answer}" in screen
    summary, by_set, *_ = short_tables(rows)
    assert [line[:3] for line in summary.rows] == [
        ("active-set", "cold", "100 %"),
        ("pinv", "cold", "50 %"),
        ("hqp/x", "cold", "50 %"),
    ]
    assert by_set.rows[0][:5] == ("easy", "2", "50 %", "1 of 3", "active-set, 21.6 µs")


@pytest.mark.slow
def test_a_report_has_every_row(tmp_path: Path) -> None:
    """Markdown, page, Parquet and CSV agree with the rows, and no page loads anything from elsewhere."""
    rows = write(tmp_path / "rows", CELLS)
    files = {path.name: path for path in write_report(rows, tmp_path / "report")}
    assert {"benchmark.md", "benchmark_sets.md", "benchmark.html", "rows.csv"} <= files.keys()
    kept = read_parquet(files["benchmark_rows.parquet"])
    np.testing.assert_array_equal(kept["distance"], rows.columns["distance"])
    assert kept["resolver"].tolist() == rows.columns["resolver"].tolist()
    with files["rows.csv"].open(newline="") as file:
        assert len([*csv.DictReader(file)]) == len(rows) == 8
    page = files["benchmark.html"].read_text()
    assert "src=" not in page
    assert "<link" not in page
    assert page.count("<svg") >= 3
    text = files["benchmark.md"].read_text()
    assert all(name in text for name in ("hqp/x", "gurobi", "pip install gurobipy", "easy"))
    for table in short_tables(rows):
        assert all(len(line) == len(table.heading) for line in table.rows)
        assert markdown(table) in text
    text = files["benchmark_sets.md"].read_text()
    for table in long_tables(rows):
        assert all(len(line) == len(table.heading) for line in table.rows)
        assert markdown(table) in text


def test_a_difference_shows_what_changed(tmp_path: Path) -> None:
    """A time that doubles has the ratio 2; sets with another checksum are left out."""
    first = write(tmp_path / "first", CELLS)
    slower = CELLS | {("easy", "hqp/x"): [row("proven", 1e-10, 4e-5), row("proven", 1e-10, 4e-5)]}
    conditions, resolvers = difference(first, write(tmp_path / "second", slower))
    assert conditions.rows == ()
    line = next(line for line in resolvers.rows if line[0] == "hqp/x")
    assert line[2] == "50 % → 100 %"
    assert line[-1] == "2.000"
    conditions, resolvers = difference(first, write(tmp_path / "third", CELLS, checksum="b"))
    assert [line[0] for line in conditions.rows] == ["set easy", "set hard"]
    assert resolvers.rows == ()


def test_files_that_are_no_comparison_are_refused(tmp_path: Path) -> None:
    """No file, no rows, and another kind of file."""
    with pytest.raises(MissingFile, match="taskopt bench run"):
        read_results(tmp_path)
    with pytest.raises(InvalidValue, match="has no rows yet"):
        write(tmp_path, {})
    (tmp_path / FILE).write_text('{"a": 1}\n')
    with pytest.raises(InvalidValue, match="not the file of a comparison: KeyError"):
        read_results(tmp_path)


def test_a_report_of_the_same_rows_is_the_same(tmp_path: Path) -> None:
    """Every text and drawing to the last letter, so that a difference between two reports means something."""
    rows = write(tmp_path / "rows", CELLS)
    one, other = (write_report(rows, tmp_path / name) for name in ("one", "other"))
    texts = [path for path in one if path.suffix in (".md", ".svg", ".html", ".csv", ".tex")]
    assert len(texts) >= 7
    for path in texts:
        assert path.read_bytes() == other[one.index(path)].read_bytes()
