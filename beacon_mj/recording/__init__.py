"""Logs that prove their numbers: one MCAP file per episode."""

from beacon_mj.recording.reader import Log, log_of, read_log
from beacon_mj.recording.rebuild import read_trace, rebuild_trace
from beacon_mj.recording.recorder import Recorder
from beacon_mj.recording.recover import recover
from beacon_mj.recording.verify import Verification, verify

__all__ = [
    "Log",
    "Recorder",
    "Verification",
    "log_of",
    "read_log",
    "read_trace",
    "rebuild_trace",
    "recover",
    "verify",
]
