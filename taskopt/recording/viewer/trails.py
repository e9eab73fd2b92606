"""The trails of a scenario in the scene: paths of frames that no task moves, such as an elbow."""

import numpy as np
import rerun as rr

from taskopt.arrays import Array, IntArray
from taskopt.kinematics.configuration import Configuration
from taskopt.recording.batch import Batch
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.palette import TRAIL, colours
from taskopt.recording.viewer.paths import world_path
from taskopt.recording.viewer.writer import RecordingWriter


class Trails:
    """Draw the paths of the frames that a scenario names in `trails`, segment by segment."""

    def __init__(self, info: RunInfo) -> None:
        """Place the robot at its start.

        Args:
            info: The facts about the run.
        """
        self._frames = tuple(info.scenario.trails)
        self._configuration = Configuration(info.scenario.robot, info.scenario.start)
        self._last: dict[str, Array] = {}  # the last point of each path, (1, 3) [m]

    def draw(self, writer: RecordingWriter, resolver: str) -> None:
        """Send colour and width.

        Args:
            writer: The recording.
            resolver: The name of the resolver.
        """
        look = rr.LineStrips3D.from_fields(colors=colours(TRAIL), radii=rr.Radius.ui_points(2.0))
        for frame in self._frames:
            writer.log_static(world_path(resolver, "trail", frame), look)

    def send(self, writer: RecordingWriter, batch: Batch, ticks: IntArray) -> None:
        """Send the next segments.

        Args:
            writer: The recording.
            batch: Consecutive steps of one resolver.
            ticks: The positions of the ticks in the batch.
        """
        points = {frame: np.empty((len(ticks), 3)) for frame in self._frames}
        for row, q in enumerate(batch.q[ticks] if self._frames else ()):
            self._configuration.update(q)
            for frame in self._frames:
                points[frame][row] = self._configuration.pose(frame)[:3, 3]
        for frame, found in points.items():
            path = world_path(batch.resolver, "trail", frame)
            previous = self._last.get(path, found[:1])
            self._last[path] = found[-1:]
            segments = np.stack([np.concatenate([previous, found[:-1]]), found], axis=1)
            strips = rr.LineStrips3D.columns(strips=list(segments))
            writer.send_columns(path, batch.index[ticks], batch.time[ticks], strips)
