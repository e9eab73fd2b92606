"""The report of a log, and its checks against what the loops sent."""

import numpy as np
import pytest
from typer.testing import CliRunner

from taskopt.cli import app
from taskopt.errors import InvalidValue, UnknownName
from taskopt.log import claims as checks
from taskopt.log.report import html, markdown
from taskopt.log.spans import spans
from tests.log.conftest import DT, run, stack


def found(log, name, **asked):
    """The finding of one check."""
    return next(claim for claim in checks.claims(log, **asked) if claim.name == name)


def exit_code(*words) -> int:
    """Run `taskopt report`, and return its exit code."""
    return CliRunner().invoke(app, ["report", *map(str, words)], catch_exceptions=False).exit_code


def test_violations_are_those_of_the_answers(logged):
    """The closed form breaks limits at the ticks at which its answers are outside; others break none."""
    ran = logged("pinv")
    outside = [
        k
        for k, answer in enumerate(ran.answers)
        if max(
            (answer.problem.box_lower - answer.x).max(), (answer.x - answer.problem.box_upper).max()
        ) > 1e-6
    ]  # fmt: skip
    claim = found(ran.log, "violation")
    assert claim.rows.tolist() == outside
    assert 0 < len(outside) < claim.ticks
    assert f"{len(outside)} of 80 ticks broke a hard limit" in claim.text
    assert not len(found(logged("active-set").log, "violation").rows)


@pytest.mark.slow
def test_the_exit_code_is_that_of_the_checks(logged, tmp_path):
    """A check that was asked for and found something ends with 1, and all others with 0."""
    broken, kept = logged("pinv").log.path, logged("active-set").log.path
    assert exit_code(broken) == 0
    assert exit_code(broken, "--fail-on", "violation") == 1
    assert exit_code(kept, "--fail-on", "violation,unproven,error") == 0
    assert exit_code(broken, "--fail-on", "unproven") == 1
    with pytest.raises(UnknownName, match="violation"):
        exit_code(kept, "--fail-on", "violatoin")
    with pytest.raises(InvalidValue, match=r"\.md or \.html"):
        exit_code(kept, "-o", tmp_path / "a.pdf")


def test_late_ticks_are_found(logged, monkeypatch):
    """A tick is late if the clock shows two periods since the one before."""
    log = logged("active-set").log
    clock = 1e9 * DT * np.arange(80)
    clock[40:] += 3e9 * DT
    array = log.array
    monkeypatch.setattr(log, "array", lambda name: clock if name == "clock" else array(name))
    claim = found(log, "deadline")
    assert claim.rows.tolist() == [40]
    assert "up to 20 ms, first at 0.2 s" in claim.text


def test_an_error_is_found(tmp_path):
    """The tick whose limits exclude each other is the one that raised an error, and violates nothing."""

    def pushed(control, k):
        if k == 20:  # faster than the limit on velocity, and no room to slow down to it
            control.plan.moved(np.array([2.5, 0.0, 0.0]))

    ran = run(tmp_path / "a.arrow", stack(), on_tick=pushed)
    assert found(ran.log, "error").rows.tolist() == [20]
    assert not len(found(ran.log, "violation").rows)
    assert exit_code(ran.log.path, "--fail-on", "error") == 1


def test_the_report_has_what_the_log_has(logged, tmp_path):
    """Markdown and the page name each bound that was active, its price with unit, and each task."""
    log = logged("active-set").log
    text = markdown(log, checks.claims(log))
    page = html(log, checks.claims(log))
    for span in spans(log, "active-set"):
        assert f"{span.name} {span.side}" in text
        assert f"{span.name} {span.side}" in page
    assert "(m/s)² per rad/s" in text
    assert "hand" in text
    assert page.count("<rect") == len(spans(log, "active-set"))
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len(lines) > 15
    assert exit_code(log.path, "-o", tmp_path / "a.html") == 0
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == page
