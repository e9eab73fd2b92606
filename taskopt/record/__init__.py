"""Recorders: a Rerun recording, a table and a manifest of every run; and reading them back."""

from taskopt.record.log import open_log as open_log
from taskopt.record.recorder import Recorder as Recorder
from taskopt.record.recorder import RunInfo as RunInfo
from taskopt.record.recorder import record as record
