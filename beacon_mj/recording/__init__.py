"""Logs that prove their numbers: one MCAP file per episode."""

from beacon_mj.recording.reader import Log, read_log
from beacon_mj.recording.rebuild import read_trace, rebuild_trace
from beacon_mj.recording.recorder import Recorder

__all__ = ["Log", "Recorder", "read_log", "read_trace", "rebuild_trace"]
