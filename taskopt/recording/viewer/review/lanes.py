"""Lanes and notes: limits over time as coloured stretches, and events as lines of text."""

import numpy as np
import rerun as rr

from taskopt.recording.derived.lanes import Lane
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.palette import FREE, LOWER, UPPER, VIOLATED, colours
from taskopt.recording.viewer.paths import EVENTS, plain_part, resolver_part
from taskopt.recording.viewer.review.arms import Arm
from taskopt.recording.viewer.writer import RecordingWriter

_STATES = {  # labels are short, since a stretch often is
    "upper": ("+", UPPER),
    "lower": ("−", LOWER),
    "beyond upper": ("over +", VIOLATED),
    "beyond lower": ("over −", VIOLATED),
    "free": ("free", FREE),
}
_QUIET = "00_no_limit_was_met"


def lane_path(arm: Arm, place: int, lane: Lane) -> str:
    """Return the path of a lane, which is its title in the viewer, too.

    Args:
        arm: The arm.
        place: Its place among the lanes of the arm, from 0; the viewer sorts by path.
        lane: The lane.

    Returns:
        A path that ends in words, such as "01_panda_joint4_velocity".
    """
    words = plain_part(lane.words).strip("_")
    return f"/{resolver_part(plain_part(arm.name))}/{place + 1:02d}_{words}_level_{lane.level}"


def send_lanes(writer: RecordingWriter, arm: Arm) -> list[str]:
    """Send the lanes of an arm.

    Args:
        writer: The recording.
        arm: The arm.

    Returns:
        Their paths, in order; without a lane that of one that says so.
    """
    paths = []
    labels, paint = zip(*_STATES.values(), strict=True)
    values = rr.StateConfiguration(values=[*_STATES], labels=[*labels], colors=colours(*paint))
    for place, lane in enumerate(arm.lanes):
        path = lane_path(arm, place, lane)
        writer.log_static(path, values)
        changes: dict[int, str] = {0: "free"}
        for stretch in lane.stretches:
            changes[stretch.first] = stretch.state
            changes.setdefault(stretch.last + 1, "free")
        _send(writer, arm, path, changes)
        paths.append(path)
    if not paths:
        path = f"/{resolver_part(plain_part(arm.name))}/{_QUIET}"
        writer.log_static(path, values)
        _send(writer, arm, path, {0: "free"})
        paths.append(path)
    return paths


def _send(writer: RecordingWriter, arm: Arm, path: str, changes: dict[int, str]) -> None:
    """Send states by the places of the ticks at which they begin."""
    ticks = np.array(sorted(place for place in changes if place < len(arm.index)))
    states = rr.StateChange.columns(state=[changes[int(place)] for place in ticks])
    writer.send_columns(path, arm.index[ticks], arm.time[ticks], states)


def send_events(writer: RecordingWriter, arms: list[Arm]) -> None:
    """Send the events of all arms as one log of text.

    Args:
        writer: The recording.
        arms: The arms.
    """
    for arm in arms:
        ticks = np.array([event.place for event in arm.events], dtype=np.int64)
        prefix = f"{arm.name}: " if len(arms) > 1 else ""
        texts = [drawable(prefix + event.text) for event in arm.events]
        if len(ticks):
            lines = rr.TextLog.columns(text=texts, level=[event.severity for event in arm.events])
            writer.send_columns(f"{EVENTS}/{plain_part(arm.name)}", arm.index[ticks], arm.time[ticks], lines)
