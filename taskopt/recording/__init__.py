"""Recording of runs as data, and drawing of these data in a viewer.

`recorder` passes the steps of a run to listeners, `batch` turns them into columns, `table` and `manifest`
write them, `reading` reads them back, and `summary` and `violation` compute figures from them. None of these
depends on the viewer. Only `viewer` imports Rerun, and only `log` imports `viewer`: `open_log` records a run
into a folder with table, manifest and Rerun recording.
"""

from taskopt.recording.recorder import Recorder as Recorder
from taskopt.recording.recorder import record as record
from taskopt.recording.run_info import RunInfo as RunInfo
