"""Recording of runs: data first, then what the viewer shows of it.

`recorder` passes the steps of a run to listeners, `batch` turns them into columns, `table` and `manifest`
write them, `reading` reads them back, `summary` and `violation` draw figures from them. None of these knows
the viewer. `viewer` holds everything that imports Rerun, and `log` is the door to it: `open_log` records a
run into a folder with table, manifest and Rerun recording.
"""

from taskopt.record.recorder import Recorder as Recorder
from taskopt.record.recorder import record as record
from taskopt.record.run_info import RunInfo as RunInfo
