"""The Rerun recording of a run: a file, and a running viewer if one is given."""

from pathlib import Path

from taskopt.record.batch import Batch
from taskopt.record.manifest import manifest
from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.active_timeline import Lanes
from taskopt.record.viewer.blueprint import blueprint
from taskopt.record.viewer.clearance import Clearance
from taskopt.record.viewer.drawable_text import drawable
from taskopt.record.viewer.plots import Series
from taskopt.record.viewer.scene import Scene
from taskopt.record.viewer.summary_panel import CARD, Card
from taskopt.record.viewer.writer import Stage
from taskopt.record.violation import LimitGauge


class StreamSink:
    """Writes batches to a Rerun recording, with its layout inside, so that opening it is enough.

    `live` is the address of a running viewer, such as rerun+http://127.0.0.1:9876/proxy, which gets the
    same data; if it goes away, the file goes on.
    """

    def __init__(self, path: Path, live: str | None = None) -> None:
        self.path, self._live = path, live

    def open(self, info: RunInfo) -> None:
        gauge = LimitGauge(info)
        self._card, self._scene = Card(info, gauge), Scene(info)
        clearance = Clearance(info, self._scene.place)
        self._parts = (self._scene, clearance, Series(info, gauge), Lanes(info, gauge))
        layout = blueprint(info, self._scene.place, gauge)
        self._stage = Stage(self.path, info.scenario.name or "run", layout, self._live)
        self._stage.properties("run", manifest(info))
        for part in self._parts:
            part.draw(self._stage)
        self._show_card("running")
        self._stage.flush()

    def take(self, batch: Batch) -> None:
        self._card.take(batch)
        for part in self._parts:
            part.send(self._stage, batch)
        self._stage.flush()

    def close(self, status: str) -> None:
        self._show_card(status)
        self._stage.close()

    def _show_card(self, status: str) -> None:
        import rerun as rr

        self._stage.static(
            CARD, rr.TextDocument(drawable(self._card.text(status)), media_type="text/markdown")
        )
