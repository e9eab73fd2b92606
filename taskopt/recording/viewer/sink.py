"""The sink that writes a run to a Rerun recording."""

from pathlib import Path
from typing import Protocol

import rerun as rr

from taskopt.recording.batch import Batch
from taskopt.recording.manifest import manifest
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.active_timeline import ActiveTimeline
from taskopt.recording.viewer.blueprint import blueprint
from taskopt.recording.viewer.clearance import Clearance
from taskopt.recording.viewer.drawable_text import drawable
from taskopt.recording.viewer.paths import SUMMARY
from taskopt.recording.viewer.plots import Plots
from taskopt.recording.viewer.scene import Scene
from taskopt.recording.viewer.summary_panel import SummaryPanel
from taskopt.recording.viewer.writer import RecordingWriter
from taskopt.recording.violation import LimitGauge


class Drawing(Protocol):
    """A part of a recording: `draw` sends constant data once, `send` the changing data batch by batch."""

    def draw(self, writer: RecordingWriter) -> None:
        """Send everything that holds for the whole run.

        Args:
            writer: The recording.
        """
        ...

    def send(self, writer: RecordingWriter, batch: Batch) -> None:
        """Send the data of one batch; `draw` has sent what does not change.

        Args:
            writer: The recording.
            batch: Consecutive steps of one resolver.
        """
        ...


class RecordingSink:
    """Write batches to a Rerun recording, whose file contains the layout of the viewer as well."""

    def __init__(self, path: Path, live: str | None = None) -> None:
        """Prepare a recording; `open` makes the file.

        Args:
            path: The file to write.
            live: The address of a running viewer, such as rerun+http://127.0.0.1:9876/proxy, that gets the
                same data, if any. If it is closed, the file is still written.
        """
        self.path, self._live = path, live

    def open(self, info: RunInfo) -> None:
        """Make the file and draw everything that stands still.

        Args:
            info: The facts about the run.

        Raises:
            InvalidValue: If the file cannot be written.
        """
        gauge, scene = LimitGauge(info), Scene(info)
        self._panel = SummaryPanel(info, gauge)
        self._drawings: tuple[Drawing, ...] = (
            scene,
            Clearance(info),
            Plots(info, gauge),
            ActiveTimeline(info, gauge),
        )
        layout = blueprint(info, scene.arrangement, gauge)
        self._writer = RecordingWriter(self.path, info.scenario.name or "run", layout, self._live)
        self._writer.set_properties("run", manifest(info))
        for drawing in self._drawings:
            drawing.draw(self._writer)
        self._show_panel("running")
        self._writer.flush()

    def take(self, batch: Batch) -> None:
        """Send a batch, and flush it to the file.

        Args:
            batch: Consecutive steps of one resolver.
        """
        self._panel.take(batch)
        for drawing in self._drawings:
            drawing.send(self._writer, batch)
        self._writer.flush()

    def close(self, status: str) -> None:
        """Write the final summary panel and complete the file.

        Args:
            status: "finished", or "interrupted" if the run ended early.
        """
        self._show_panel(status)
        self._writer.close()

    def _show_panel(self, status: str) -> None:
        """Replace the text of the summary panel."""
        text = rr.TextDocument(drawable(self._panel.text(status)), media_type="text/markdown")
        self._writer.log_static(SUMMARY, text)
