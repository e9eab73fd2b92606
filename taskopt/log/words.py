"""The words of a tick, as JSON that fits its slot: errors, notes, and changes of parameters."""

import json
from collections.abc import Sequence

from taskopt.kinematics.changes import Applied
from taskopt.log.provenance import plain
from taskopt.log.slots import TEXT_BYTES


def words(
    error: str = "", notes: Sequence[str] = (), fallback: str | None = None, changes: Sequence[Applied] = ()
) -> bytes:
    """Return the words of a tick.

    Args:
        error: The error that the tick raised; "" for none.
        notes: Sentences on its answer.
        fallback: Method that answered because the resolver failed; None for the resolver.
        changes: Changes of parameters that the tick has applied.

    Returns:
        JSON of at most `TEXT_BYTES`; long texts are cut, and the last changes left out, which it says.
        b"" if there is nothing to say.
    """
    if not (error or notes or fallback or changes):
        return b""
    told: dict[str, object] = {"error": error or None, "notes": list(notes) or None, "fallback": fallback}
    lines = [_line(change) for change in changes]
    told["changes"] = lines or None
    text, room, kept = json.dumps(told).encode(), TEXT_BYTES, len(lines)
    while len(text) > TEXT_BYTES:
        room, kept = room // 2, kept // 2
        told["error"] = _cut(error, room) or None
        told["notes"] = [_cut(note, room // max(1, len(notes))) for note in notes]
        left = len(lines) - kept
        told["changes"] = [*lines[:kept], json.dumps({"left_out": left})] if left else None
        text = json.dumps(told).encode()
    return text


def _line(change: Applied) -> str:
    """Return a change as JSON."""
    told = {"name": change.name, "before": plain(change.before), "after": plain(change.after)}
    return json.dumps(told | {"over_s": change.over})


def _cut(text: str, length: int) -> str:
    """Return a text, or its beginning with a word that it was cut."""
    return text if len(text) <= length else f"{text[:length]} … (cut)"
