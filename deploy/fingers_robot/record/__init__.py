"""Recording of every run as MCAP, and reading it back."""

from fingers_robot.record.log import Log, read_log

__all__ = ["Log", "read_log"]
