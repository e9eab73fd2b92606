"""Logs in, one recording out: everything is derived from the raw ticks, after the fact."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from taskopt.errors import InvalidValue, UnknownName
from taskopt.log import story
from taskopt.log.reading import Log
from taskopt.recording.derived.difference import differences
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.palette import colours, resolver_colour
from taskopt.recording.viewer.paths import SUMMARY, data_path
from taskopt.recording.viewer.plots import draw_lines
from taskopt.recording.viewer.review.arms import Arm, arms_of
from taskopt.recording.viewer.review.lanes import send_events, send_lanes
from taskopt.recording.viewer.review.layouts import LAYOUTS, ArmPlots, Stage
from taskopt.recording.viewer.review.scene import ReviewScene
from taskopt.recording.viewer.review.series import Plotted, Series, send_range
from taskopt.recording.viewer.writer import RecordingWriter

_LOOKING = ("hierarchy", "solver")  # layouts that need closer looks, which take seconds


def record_logs(logs: Sequence[Log], layout: str, path: str | Path) -> Path:
    """Derive a recording from raw logs.

    Equal ticks give equal data, however the logs were cut into batches.

    Args:
        logs: The logs; several are shown side by side.
        layout: Name of a layout, see `LAYOUTS`.
        path: The file to write, which ends with `.rrd`, in an existing folder.

    Returns:
        The path.

    Raises:
        UnknownName: There is no such layout.
        InvalidValue: There is no tick, a log cannot be drawn, or the file cannot be written.
    """
    place = Path(path)
    if layout not in LAYOUTS:
        raise UnknownName("layout", layout, list(LAYOUTS))
    if place.suffix != ".rrd":
        raise InvalidValue(f"a recording is a file *.rrd, got {place}")
    arms = arms_of(logs)
    if not arms:
        raise InvalidValue(f"there is nothing to show: no tick in {', '.join(str(log.path) for log in logs)}")
    scene = ReviewScene(arms)
    name = " and ".join(dict.fromkeys(_name(log) for log in logs))
    writer = RecordingWriter(place, name, None, layout=layout)
    scene.send(writer)
    sent = [_send_arm(writer, arm, number, layout) for number, arm in enumerate(arms)]
    for number, plotted in _send_differences(writer, arms):
        sent[number].plots.setdefault("apart", []).append(plotted)
    send_events(writer, arms)
    longest = max(arms, key=lambda arm: arm.answers.end)
    send_range(writer, longest)
    text = rr.TextDocument(drawable(_summary(logs)), media_type="text/markdown")
    writer.log_static(SUMMARY, text)
    camera = scene.arrangement.camera(len(arms))
    writer.send_layout(LAYOUTS[layout](Stage(sent, camera, scene.trails, longest.answers.end)))
    writer.close()
    return place


def _name(log: Log) -> str:
    """Name a log by its scenario, else by its file."""
    return log.facts.get("scenario", {}).get("name") or log.path.stem


def _send_arm(writer: RecordingWriter, arm: Arm, number: int, layout: str) -> ArmPlots:
    """Send plots and lanes of one arm."""
    series = Series(writer, arm, resolver_colour(number))
    plots = {
        "errors": series.errors(),
        "shares": series.shares(),
        "velocities": [series.velocities()],
        "prices": series.prices(),
        "solver": series.solver(),
        "singular": series.singular_values(),
    }
    if layout in _LOOKING:
        plots["looks"], plots["proofs"] = series.looked_at()
    return ArmPlots(arm.name, send_lanes(writer, arm), arm.answers.usual_microseconds, plots)


def _send_differences(writer: RecordingWriter, arms: Sequence[Arm]) -> list[tuple[int, Plotted]]:
    """Send how far postures and velocities of each arm are from those of the first one of the same robot."""
    sent = []
    for number, arm in enumerate(arms[1:], start=1):
        if arm.robot is not arms[0].robot:
            continue
        found = differences(arms[0].answers, arm.answers, arm.robot)
        for title, key, values in (
            ("Largest difference of a joint from the first arm [rad, m]", "q", found.posture),
            ("Largest difference of a velocity from the first arm [rad/s, m/s]", "v", found.velocity),
        ):
            path = data_path(arm.name, "apart", key)
            draw_lines(writer, path, [f"{arm.name} − {arms[0].name}"], colours(resolver_colour(number)))
            index, time = arm.index[found.places], arm.time[found.places]
            writer.send_columns(path, index, time, rr.Scalars.columns(scalars=np.asarray(values)))
            sent.append((number, Plotted(title, path, 1)))
    return sent


def _summary(logs: Sequence[Log]) -> str:
    """Write the summaries of logs as Markdown."""
    lines = []
    for log in logs:
        scenario = log.facts.get("scenario", {})
        lines += [f"# {_name(log).replace('_', ' ')}", "", scenario.get("description", ""), ""]
        for line in story.summary(log).splitlines()[1:]:
            lines.append(f"- {line.strip()}" if line.startswith("  ") else f"\n{line}\n")
    return "\n".join([*lines, "", _GUIDE])


_GUIDE = """### How to read it
- White: the desired path. Coloured: the path of the frame. Red: the error between them.
- Balls at joints: yellow within 5 % of a position limit, red where a limit holds the joint.
- Yellow ellipsoid: velocities of the frame with ‖v‖ ≤ 1; green wire frame: forces of torques of norm 1.
- Limits over time: those that hold the first level back come first, the longest ones above. Red: at the \
upper bound, blue: at the lower one, yellow: beyond a bound.
- Price: the rate at which ½ Σ w d² of the level would fall if the bound gave way.
"""
