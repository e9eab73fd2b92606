"""Which limits bind, as lanes over time; and the moments worth reading about."""

from typing import Any

import numpy as np

from taskopt.record.batch import Batch, Mask
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.drawable_text import drawable
from taskopt.record.viewer.palette import BROKEN, FREE, LOWER, UPPER, colours, plain
from taskopt.record.viewer.plots import limit_rows, of, pair_rows
from taskopt.record.viewer.writer import Stage
from taskopt.record.violation import LimitGauge

EVENTS = "/run/events"
_MOST = 12  # events of one resolver in one batch; the rest are counted
_OVER = 1000  # added to the code of a bound that is not met but left behind
_CAUSES = {  # limits have lanes of their own
    "rank": "a rank that may go either way keeps it apart from its closed form",
    "damping": "damping keeps it apart from its closed form",
    "accuracy": "its accuracy is less than was asked for",
}
_ANY, _ANY_WORDS = "any_limit", ("none binds", "binds")
_PAIR = {"lower": "held off", "over lower": "too fast"}  # what the row of a distance says
_OUTSIDE = 1e-9  # [rad], [m] beyond which a limit counts as broken


class Lanes:
    """A lane for each limit or inequality that ever binds, and the log of what happened."""

    def __init__(self, info: RunInfo, gauge: LimitGauge) -> None:
        self._info, self._gauge = info, gauge
        self._rows = np.flatnonzero(limit_rows(info))
        self._pairs = pair_rows(info)
        self._code: dict[str, Any] = {}
        self._opened: set[tuple[str, int]] = set()
        self._flags: dict[tuple[str, str], bool] = {}

    def draw(self, stage: Stage) -> None:
        """Nothing stands still here: lanes open when their limit first binds."""

    def send(self, stage: Stage, batch: Batch) -> None:
        events = [*self._changes(stage, batch), *self._turns(batch)]
        self._log(stage, batch, sorted(events))

    def _changes(self, stage: Stage, batch: Batch) -> list[tuple[int, str, str]]:
        active, broken = batch.active_code[:, self._rows], batch.broken_code[:, self._rows]
        code = np.where((active == 0) & (broken != 0), broken + np.sign(broken) * _OVER, active)
        before = self._code.get(batch.resolver, np.zeros(code.shape[1], dtype=np.int64))
        first = batch.resolver not in self._code
        self._code[batch.resolver] = code[-1]
        if code.size:
            self._any(stage, batch, bool(before.any()), np.asarray(code.any(axis=1)), first)
        steps = np.vstack([before, code])
        events = []
        for lane in np.flatnonzero((steps[1:] != steps[:-1]).any(axis=0) | (first & (before != code[0]))):
            where = np.flatnonzero(steps[1:, lane] != steps[:-1, lane])
            row = int(self._rows[lane])
            self._lane(stage, batch, row, where, steps[1:, lane])
            for k in where:
                old, new = int(steps[k, lane]), int(steps[k + 1, lane])
                events.append((int(k), *_event(batch, row, old, new)))
        return events

    def _any(self, stage: Stage, batch: Batch, before: bool, binds: Mask, first: bool) -> None:
        """One lane for all of them, so that there is one where nothing ever binds."""
        import rerun as rr

        path = of(batch.resolver, "active", _ANY)
        turns = np.flatnonzero(binds != np.concatenate([[not binds[0] if first else before], binds[:-1]]))
        if first:
            look = rr.StateConfiguration(values=[*_ANY_WORDS], colors=colours(FREE, UPPER))
            stage.static(path, look)
        if len(turns):
            words = [_ANY_WORDS[int(binds[k])] for k in turns]
            states = rr.StateChange.columns(state=words)
            stage.columns(path, batch.index[turns], batch.time[turns], states)

    def _lane(self, stage: Stage, batch: Batch, row: int, where: Any, code: Any) -> None:
        import rerun as rr

        path = self._path(batch, row)
        if (batch.resolver, row) not in self._opened:
            self._opened.add((batch.resolver, row))
            stage.static(path, self._look(batch, row))
            if where[0] > 0 or batch.index[0] > 0:
                start = np.zeros(1, dtype=np.int64)
                stage.columns(
                    path, start, start.astype("timedelta64[ns]"), rr.StateChange.columns(state=["free"])
                )
        words = [_words(batch, row, int(c)) for c in code[where]]
        stage.columns(path, batch.index[where], batch.time[where], rr.StateChange.columns(state=words))

    def _path(self, batch: Batch, row: int) -> str:
        """Its title in the viewer too, so without signs that would have to be escaped."""
        parts = (batch.row_names[row],) if row < batch.layout.n else batch.row_names[row].split("/", 1)
        return of(batch.resolver, "active", *(plain(name) for name in parts))

    def _look(self, batch: Batch, row: int) -> Any:
        import rerun as rr

        sides = {"upper": UPPER, "lower": UPPER if row in self._pairs else LOWER}
        owners = batch.layout.owners if row < batch.layout.n else ("",)
        words = [(f"{owner} {side}".strip(), sides[side]) for owner in owners for side in sides]
        words += [(f"over {word}", BROKEN) for word, _ in words]
        words.append(("free", FREE))
        names = [word for word, _ in words]
        labels = [_PAIR.get(name, name) if row in self._pairs else _label(name) for name in names]
        return rr.StateConfiguration(
            values=names, labels=[*map(drawable, labels)], colors=colours(*(c for _, c in words))
        )

    def _turns(self, batch: Batch) -> list[tuple[int, str, str]]:
        """Ticks at which a run leaves its limits or its proof, and at which it returns."""
        position, velocity = self._gauge.position_violation(batch), self._gauge.velocity_violation(batch)
        watched = {
            **self._nearness(batch),
            "a joint is outside its position limits": ("WARN", position > _OUTSIDE),
            "a joint is over its velocity limit": ("WARN", velocity > _OUTSIDE),
        }
        if batch.claimed.any():
            unproven = batch.claimed & ~batch.certified
            watched["the resolver claims an optimum that is not proven"] = ("ERROR", unproven)
        for kind, what in _CAUSES.items():
            watched[what] = ("INFO", np.array([any(c.kind == kind for c in tick) for tick in batch.causes]))
        events = []
        for what, (level, flag) in watched.items():
            before = self._flags.get((batch.resolver, what), False)
            self._flags[batch.resolver, what] = bool(flag[-1])
            turns = np.flatnonzero(flag != np.concatenate([[before], flag[:-1]]))
            events += [
                (int(k), level if flag[k] else "DEBUG", what if flag[k] else f"over: {what}") for k in turns
            ]
        return events

    def _nearness(self, batch: Batch) -> dict[str, tuple[str, Mask]]:
        return {
            f"nearer than the margin of {name}": (
                "WARN",
                batch.distance(name).min(axis=1) < limit.margin - _OUTSIDE,
            )
            for name, limit in self._info.plan.distance_limits.items()
        }

    def _log(self, stage: Stage, batch: Batch, events: list[tuple[int, str, str]]) -> None:
        import rerun as rr

        if not events:
            return
        kept = events[:_MOST]
        texts = [f"{batch.resolver}: {what}" for _, _, what in kept]
        if len(events) > _MOST:
            texts[-1] += f" (and {len(events) - _MOST} more changes by {batch.t[-1]:.3f} s)"
        at = np.array([k for k, _, _ in kept])
        logged = rr.TextLog.columns(
            text=[drawable(text) for text in texts], level=[level for _, level, _ in kept]
        )
        stage.columns(EVENTS, batch.index[at], batch.time[at], logged)


def _words(batch: Batch, row: int, code: int) -> str:
    if abs(code) > _OVER:
        return "over " + batch.code_words(row, code - int(np.sign(code)) * _OVER)
    return batch.code_words(row, code)


def _event(batch: Batch, row: int, old: int, new: int) -> tuple[str, str]:
    """Level and words of a change."""
    left = abs(new or old) > _OVER
    code = (new or old) - (int(np.sign(new or old)) * _OVER if left else 0)
    name = batch.active_name(row, code)
    if new == 0:
        return "DEBUG", f"{name} is kept again" if left else f"{name} is free again"
    return ("WARN", f"{name} is broken") if left else ("INFO", f"{name} binds")


def _label(word: str) -> str:
    """Short enough for a narrow lane: 'joint_velocity upper' is 'velocity +'."""
    plain = word.replace("joint_", "").replace("_", " ")
    return plain.removesuffix(" upper") + " +" if plain.endswith(" upper") else plain.replace(" lower", " −")
