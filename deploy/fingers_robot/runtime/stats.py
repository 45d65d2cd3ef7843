"""Timing of a loop, in a fixed amount of memory."""

import numpy as np

LATE_S, GAP_S = 0.005, 0.004
_BIN_S = 1e-4
_BINS = 1000  # up to 100 ms; the last bin takes what is longer
_WINDOW = 500  # control steps of the rate that is warned about: 10 s
WARN_SHARE = 0.01


class Timing:
    """Histogram of one duration, and its worst case."""

    def __init__(self) -> None:
        self._counts = np.zeros(_BINS + 1, np.int64)
        self.worst_s = 0.0

    def add(self, duration_s: float) -> None:
        """Adds a duration [s]; negative counts as zero."""
        place = min(max(int(duration_s / _BIN_S), 0), _BINS)
        self._counts[place] += 1
        self.worst_s = max(self.worst_s, duration_s)

    @property
    def count(self) -> int:
        """Number of durations."""
        return int(self._counts.sum())

    def quantile(self, share: float) -> float:
        """Upper edge of the bin in which the share is reached [s]; NaN if empty.

        No more than the worst case, which is also the edge of the last bin.
        """
        total = self._counts.cumsum()
        if not total[-1]:
            return float("nan")
        place = int(np.searchsorted(total, share * total[-1]))
        edge_s = np.inf if place == _BINS else (place + 1) * _BIN_S
        return float(min(edge_s, self.worst_s))

    def histogram(self) -> str:
        """Counts of the bins that are not empty, as `lower edge [ms]: count, …`."""
        used = np.flatnonzero(self._counts).tolist()
        return ", ".join(f"{1e3 * _BIN_S * k:.1f}: {self._counts[k]}" for k in used)

    def above(self, limit_s: float) -> int:
        """How many durations were longer than a multiple of 0.1 ms."""
        return int(self._counts[round(limit_s / _BIN_S) :].sum())


class LoopStats:
    """Timing of the control steps.

    Attributes:
        late: start of a control step after its deadline.
        done: end of a control step after its deadline; more than 5 ms is a miss.
        gap: time from one step of the loop to the next, control step or not.
        work: duration of a step of the loop.
        answer: observation sent to proposal received.
        skipped: control steps that were given up.
    """

    def __init__(self) -> None:
        self.late, self.done, self.gap = Timing(), Timing(), Timing()
        self.work, self.answer = Timing(), Timing()
        self.skipped = 0
        self._recent = np.zeros(_WINDOW, bool)
        self._steps = 0

    def step(self, late_s: float, skipped: int, done_s: float) -> None:
        """Adds a control step that started `late_s` and ended `done_s` after its time.

        `skipped` control steps before it were given up.
        """
        self.late.add(late_s)
        self.done.add(done_s)
        self.skipped += skipped
        self._recent[self._steps % _WINDOW] = done_s > LATE_S or skipped > 0
        self._steps += 1

    @property
    def warning(self) -> bool:
        """More than 1 % of the last 500 control steps were late or skipped."""
        return bool(self._recent.mean() > WARN_SHARE)

    def summary(self) -> dict[str, float]:
        """Numbers for log and status, times in ms."""
        late = self.late
        return {
            "control_steps": late.count,
            "skipped": self.skipped,
            "late_over_5ms": self.done.above(LATE_S),
            "late_p50_ms": 1e3 * late.quantile(0.5),
            "late_p99_ms": 1e3 * late.quantile(0.99),
            "late_p999_ms": 1e3 * late.quantile(0.999),
            "late_max_ms": 1e3 * late.worst_s,
            "loop_steps": self.gap.count,
            "gaps_over_4ms": self.gap.above(GAP_S),
            "gap_max_ms": 1e3 * self.gap.worst_s,
            "work_p50_ms": 1e3 * self.work.quantile(0.5),
            "work_max_ms": 1e3 * self.work.worst_s,
            "answer_p50_ms": 1e3 * self.answer.quantile(0.5),
            "answer_p999_ms": 1e3 * self.answer.quantile(0.999),
            "answer_max_ms": 1e3 * self.answer.worst_s,
        }

    def histograms(self) -> dict[str, str]:
        """Histograms for the log, in bins of 0.1 ms, the last for 100 ms and more."""
        timings = {"late": self.late, "gap": self.gap, "answer": self.answer}
        return {f"{name}_histogram": x.histogram() for name, x in timings.items()}
