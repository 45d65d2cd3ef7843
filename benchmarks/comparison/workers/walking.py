"""What walking is, for all alike, and how a worker reports it; standard library alone.

Peers are commanded straight forward, the easiest command; ours draws its training's
commands: forward and sideways, with turns. A hand walks where ended episodes last 10 s
on average and the palm moves at 0.05 m/s along the command on average. The speed is
that of all worlds in the last iteration; of Brax, which logs no other, that of the last
100 ended episodes, so it is known up to an episode later.
"""

import os
import time
from pathlib import Path

from benchmarks.comparison.workers.report import STANDING_STEPS, say

COMMAND_MPS = 0.12
"""Speed straight forward that peers are asked for: the mean of our commands [m/s]."""
WIDTH_MPS = 0.1
"""Width of the kernel that pays for velocity, ours and the peers' [m/s]."""
TRACKING = 2.0
"""Weight of that kernel beside 1 for staying upright, in the peers."""
WALKING_MPS = 0.05
ITERATIONS = 100_000
"""More than any peer does in the time that it has."""
SINCE = "seconds from the start of the process to a hand that walks"
SPEED = "speed along the command at the end of the time"


class Walking:
    """Looks at a training until its time is over, and reports then.

    Args:
        seconds: that the training has, from the start of the process.
        version: of what trains.
        note: what is trained.
    """

    def __init__(self, seconds: float, version: str, note: str):
        self._seconds, self._about = seconds, {"version": version, "note": note}
        self._since_s: float | None = None
        self._said = False

    def over(self, length: float, speed_mps: float) -> bool:
        """Takes the means of an iteration; whether all is said, and nothing is to do.

        Args:
            length: of ended episodes [control steps].
            speed_mps: of the palm along the command [m/s].
        """
        walks = length >= STANDING_STEPS and speed_mps >= WALKING_MPS
        if walks and self._since_s is None:
            self._since_s = age_s()
        if age_s() < self._seconds:
            return False
        if not self._said:
            self._say(length, speed_mps)
        self._said = True
        return True

    def _say(self, length: float, speed_mps: float) -> None:
        since, about = self._since_s, dict(self._about)
        if since is None:
            about["note"] += f"; does not walk within {self._seconds:g} s"
        say(quantity=SINCE, unit="s", value=since, **about)
        about["note"] = f"{self._about['note']}; after {self._seconds:g} s"
        about["note"] += f", episodes of {length:.0f} steps"
        say(quantity=SPEED, unit="m/s", value=speed_mps, **about)
        say(done=True)


def age_s() -> float:
    """Returns the time since this process was started [s]."""
    fields = Path("/proc/self/stat").read_text("utf-8").rpartition(")")[2].split()
    started_s = int(fields[19]) / os.sysconf("SC_CLK_TCK")
    return time.clock_gettime(time.CLOCK_BOOTTIME) - started_s
