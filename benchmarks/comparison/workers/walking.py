"""What walking is, for all alike, and how a worker reports it; standard library alone.

Looked at are all worlds of the training itself over the last 1,000 control steps of
each, which is one episode: the palm's mean speed along the command, and how often a
hand fell. A hand walks where it makes 0.05 m/s and falls once at most. Both are means
over worlds and steps, so that it does not matter when episodes end; they begin at
random ages. It walks since a time where it does so from then on until the time is over.

Peers are commanded straight forward, the easiest command; ours draws its training's
commands: forward and sideways, with turns.
"""

import os
import time
from collections import deque
from pathlib import Path

from benchmarks.comparison.workers.report import say

COMMAND_MPS = 0.12
"""Speed straight forward that peers are asked for: the mean of our commands [m/s]."""
WIDTH_MPS = 0.1
"""Width of the kernel that pays for velocity, ours and the peers' [m/s]."""
ALIVE, TRACKING, ACTION_RATE = 1.0, 2.0, -0.01
"""Weights of the peers: not fallen, that kernel, squared change of the action."""
LOWEST_M = 0.07
"""Height of the palm below which a peer's hand has fallen [m]."""
START_RAD = 0.02
"""Half width of the joints' noise at the start of a peer's episode [rad]."""
LAYERS = (512, 256, 128)
"""Sizes of both networks: ours of the preset, and the peers'."""
WALKING_MPS = 0.05
FALLS = 1.0
"""Falls of a world in `WINDOW` control steps that a walking hand may have."""
WINDOW = 1000
"""Control steps of each world that are looked at: one episode."""
ITERATIONS = 100_000
"""More than any peer does in the time that it has."""
SINCE = "seconds from the start of the process to a hand that walks from then on"
SPEED = "speed along the command, all worlds, last 1,000 control steps"
FELL = "falls per world, last 1,000 control steps"


class Walking:
    """Looks at a training until its time is over, and reports then.

    Args:
        seconds: that the training has, from the start of the process.
        version: of what trains.
        note: what is trained.
    """

    def __init__(self, seconds: float, version: str, note: str):
        self._seconds, self._about = seconds, {"version": version, "note": note}
        self._recent: deque[tuple[int, float, float]] = deque()
        self._since_s: float | None = None
        self._first_s: float | None = None
        self._steps, self._said = 0, False

    def over(self, steps: int, speed_mps: float, falls: float) -> bool:
        """Takes the means of an iteration; whether all is said, and nothing is to do.

        Args:
            steps: control steps of each world.
            speed_mps: of the palm along the command, mean of all worlds and steps.
            falls: of all worlds together, by the number of worlds.
        """
        now_s = age_s()
        self._steps += steps
        self._recent.append((steps, speed_mps * steps, falls))
        while self._seen() - self._recent[0][0] >= WINDOW:
            self._recent.popleft()
        if not self._walks():
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
            self._first_s = self._first_s or now_s
        if now_s < self._seconds:
            return False
        if not self._said:
            self._say()
        self._said = True
        return True

    def _seen(self) -> int:
        return sum(steps for steps, _, _ in self._recent)

    def _means(self) -> tuple[float, float]:
        """Returns the speed [m/s], and the falls of a world in 1,000 control steps."""
        seen = self._seen()
        speed_mps = sum(way for _, way, _ in self._recent) / seen
        return speed_mps, sum(falls for _, _, falls in self._recent) * WINDOW / seen

    def _walks(self) -> bool:
        speed_mps, falls = self._means()
        full = self._seen() >= WINDOW
        return full and speed_mps >= WALKING_MPS and falls <= FALLS

    def _say(self) -> None:
        (speed_mps, falls), about = self._means(), dict(self._about)
        about["note"] += f"; {self._seconds:g} s, {self._steps:,} control steps a world"
        missing = ""
        if self._since_s is None:
            missing = "; does not walk at the end of the time"
            if self._first_s is not None:
                missing += f", did so first at {self._first_s:.0f} s and relapsed"
        since = about | {"note": about["note"] + missing}
        say(quantity=SINCE, unit="s", value=self._since_s, **since)
        say(quantity=SPEED, unit="m/s", value=speed_mps, **about)
        say(quantity=FELL, unit="falls", value=falls, **about)
        say(done=True)


def age_s() -> float:
    """Returns the time since this process was started [s]."""
    fields = Path("/proc/self/stat").read_text("utf-8").rpartition(")")[2].split()
    started_s = int(fields[19]) / os.sysconf("SC_CLK_TCK")
    return time.clock_gettime(time.CLOCK_BOOTTIME) - started_s
