"""A log as a report: text for a terminal, Markdown, or one HTML page that needs nothing else."""

from collections.abc import Iterator, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from taskopt.log.breaches import Breach, breaches
from taskopt.log.claims import Claim
from taskopt.log.reading import Log
from taskopt.log.spans import Span, dearest, spans
from taskopt.log.story import errors, noted

_STYLE = (
    "body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:70em;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:14px}th,td{border-bottom:1px solid #ddd;padding:.2em .7em;"
    "text-align:left;vertical-align:top}th{background:#f4f4f4}svg{max-width:100%;height:auto}"
)
_OF_BREACHES = ("limit", "first at", "in all", "by up to", "at")
_WIDTH, _LANE, _LEFT = 900, 18, 230  # of the drawing of spans [px]: all, one bound, the names


class Section(NamedTuple):
    """A part of a report.

    Attributes:
        title: Its heading.
        heads: Headings of its table.
        rows: Rows of its table, of texts.
        resolver: Resolver whose limits are drawn beside the table; "" for none.
    """

    title: str
    heads: tuple[str, ...]
    rows: list[tuple[str, ...]]
    resolver: str = ""


def sections(log: Log, found: Sequence[Claim]) -> list[Section]:
    """Collect what a report says.

    Args:
        log: The log.
        found: What `claims` found in it.

    Returns:
        The parts of the report.
    """
    parts = [Section("The log", ("", ""), [*_facts(log)])]
    for name in log.resolvers:
        own = [(claim.name, claim.text) for claim in found if claim.resolver == name]
        parts.append(Section(f"{name}: checks", ("check", "found"), own))
        tasks = [tuple(text.split(": error ", 1)) for text in errors(log, log.rows(name))]
        parts.append(Section(f"{name}: tasks", ("task", "error"), tasks))
        heads = ("bound", "first at", "times", "in all", "highest price of each level")
        rows = [_bound(own) for own in _by_bound(spans(log, name)).values()]
        parts.append(Section(f"{name}: active limits", heads, rows, name))
        broken = [_broken(breach) for breach in breaches(log, name)]
        if broken:
            parts.append(Section(f"{name}: broken limits", _OF_BREACHES, broken))
    told = [tuple(text.split(": ", 1)) for text in noted(log)]
    return [*parts, Section("Notes", ("when", "note"), told)] if told else parts


def markdown(log: Log, found: Sequence[Claim]) -> str:
    """Return the report as Markdown, which is readable in a terminal, too.

    Args:
        log: The log.
        found: What `claims` found in it.

    Returns:
        The text.
    """
    lines = [f"# {log.path.name}"]
    for part in sections(log, found):
        lines += ["", f"## {part.title}", ""]
        cells = [part.heads, *part.rows] if part.rows else []
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        table = [[_in_cell(cell).ljust(w) for cell, w in zip(row, widths, strict=True)] for row in cells]
        table[1:1] = [["-" * width for width in widths]] if table else []
        lines += [f"| {' | '.join(row)} |" for row in table] or ["none"]
    return "\n".join(lines) + "\n"


def html(log: Log, found: Sequence[Claim]) -> str:
    """Return the report as a page that needs no other file, with the times of active limits as a drawing.

    Args:
        log: The log.
        found: What `claims` found in it.

    Returns:
        The page.
    """
    name = escape(log.path.name)
    body = [f"<h1>{name}</h1>"]
    for part in sections(log, found):
        body.append(f"<h2>{escape(part.title)}</h2>")
        if part.resolver and part.rows:
            body.append(_drawing(log, part.resolver))
        cells = "".join(f"<th>{escape(head)}</th>" for head in part.heads)
        rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in part.rows)
        body.append(f"<table><tr>{cells}</tr>{rows}</table>" if part.rows else "<p>none</p>")
    head = f'<meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style>'
    return f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(body)}</body></html>\n'


def _facts(log: Log) -> Iterator[tuple[str, str]]:
    """Yield what the log is about."""
    facts = log.facts
    yield "robot", str(facts.get("robot", {}).get("name", "unknown"))
    if "name" in facts.get("scenario", {}):
        yield "scenario", str(facts["scenario"]["name"])
    yield "started", str(facts["started"])
    yield "commit", str(facts["git_commit"] or "unknown")
    yield "versions", ", ".join(f"{name} {facts['versions'][name]}" for name in ("taskopt", "numpy", "numba"))
    yield "ends", log.missing or f"{log.end.end}{': ' if log.end.why else ''}{log.end.why}"
    if log.end.waits:
        yield "waits", f"{log.end.waits} for the writer, {log.end.waited:.3g} s in all"
    for name in log.resolvers:
        rows = log.rows(name)
        counts = dict(zip(*np.unique(log.array("status")[rows], return_counts=True), strict=True))
        when = f" from {log.t[rows[0]]:.6g} to {log.t[rows[-1]]:.6g} s" if len(rows) else ""
        told = ", ".join(f"{count} {status}" for status, count in counts.items())
        yield name, f"{len(rows)} ticks{when}; {told}".rstrip("; ")


def _by_bound(found: Sequence[Span]) -> dict[str, list[Span]]:
    """Return the spans of each bound."""
    groups: dict[str, list[Span]] = {}
    for span in found:
        groups.setdefault(f"{span.name} {span.side}", []).append(span)
    return groups


def _bound(own: Sequence[Span]) -> tuple[str, ...]:
    """Return the row of one bound."""
    price = "; ".join(span.cost for span in dearest(own)) or "none"
    total = f"{sum(span.duration for span in own):.4g} s"
    return f"{own[0].name} {own[0].side}", f"{own[0].begin:.6g} s", str(len(own)), total, price


def _broken(breach: Breach) -> tuple[str, ...]:
    """Return the row of one limit that was broken."""
    size = f"{breach.size:.4g} {breach.unit}".rstrip()
    first, total = f"{breach.begin:.6g} s", f"{breach.duration:.4g} s"
    return f"{breach.name} {breach.side}", first, total, size, f"{breach.at:.6g} s"


def _drawing(log: Log, resolver: str) -> str:
    """Return when each bound was active, as SVG."""
    groups = _by_bound(spans(log, resolver))
    times = log.t[log.rows(resolver)]
    begin, length = times[0], max(float(times[-1] - times[0]), float(log.array("dt")[0]))
    height, parts = _LANE * (len(groups) + 1), []
    for k, (name, own) in enumerate(groups.items()):
        parts.append(f'<text x="0" y="{_LANE * k + 13}">{escape(name)}</text>')
        for span in own:
            x = _LEFT + (_WIDTH - _LEFT) * (span.begin - begin) / length
            width = max(1.0, (_WIDTH - _LEFT) * span.duration / length)
            title = f"<title>{escape(str(span))}</title>"
            place = f'x="{x:.1f}" y="{_LANE * k + 3}" width="{width:.1f}" height="{_LANE - 6}"'
            parts.append(f'<rect {place} fill="#c0392b">{title}</rect>')
    foot = height - 5
    parts.append(f'<text x="{_LEFT}" y="{foot}">{begin:.4g} s</text>')
    parts.append(f'<text x="{_WIDTH}" y="{foot}" text-anchor="end">{begin + length:.4g} s</text>')
    box = f'viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}" font-size="12"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box}>{"".join(parts)}</svg>'


def _in_cell(text: str) -> str:
    """Return a text that does not end its cell of a Markdown table."""
    return text.replace("|", "\\|").replace("\n", " ")
