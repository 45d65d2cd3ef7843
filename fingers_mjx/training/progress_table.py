"""What the terminal shows of a run: a bar, the metrics and the reward terms."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

_METRICS = {
    "episode/return": "return",
    "episode/length": "episode length",
    "task_speed_mps": "task speed [m/s]",
    "kl": "KL",
    "learning_rate": "learning rate",
    "policy/entropy": "entropy",
    "policy/std": "noise",
    "loss/value": "value loss",
    "invalid": "invalid steps",
    "updates_skipped": "updates skipped",
}


class Board:
    """Keeps the newest event of each kind and draws them."""

    def __init__(self) -> None:
        self._row: Mapping[str, Any] = {}
        self._compiling_s = 0.0

    def take(self, event: Mapping[str, Any]) -> str:
        """Takes in one event and returns the sentence to print above, if any."""
        match event["event"]:
            case "compiling":
                self._compiling_s = event["elapsed_s"]
            case "progress":
                self._row = event
            case "checkpoint":
                return f"saved {event['path']}"
            case "note":
                return event["text"]
        return ""

    def render(self) -> RenderableType:
        """Returns the picture of the run as it stands."""
        if not self._row:
            return Text(f"compiling… {self._compiling_s:.0f} s")
        return Group(self._headline(), self._metrics())

    def _headline(self) -> Text:
        """Returns steps, speed and the remaining time."""
        row = self._row
        share = row["iteration"] / row["iterations"]
        bar = "━" * round(24 * share) + "╌" * (24 - round(24 * share))
        speed = row.get("steps_per_s")
        rate = f"{speed:,.0f} steps/s" if speed else "…"
        eta = f"ETA {clock(row['eta_s'])}" if "eta_s" in row else ""
        done = f"{row['iteration']}/{row['iterations']}"
        return Text(f"{bar} {done}  {row['env_steps']:,} steps  {rate}  {eta}")

    def _metrics(self) -> Table:
        """Returns two columns: metrics and reward terms."""
        row, table = self._row, Table.grid(padding=(0, 3))
        left = [(t, shown(row[k])) for k, t in _METRICS.items() if k in row]
        names = sorted(k for k in row if k.startswith("reward/"))
        right = [(k, shown(row[k])) for k in names]
        for index in range(max(len(left), len(right))):
            cells = [*_pair(left, index), *_pair(right, index)]
            table.add_row(*cells)
        return table


def clock(seconds: float) -> str:
    """Returns a time span as h:mm:ss."""
    minutes, second = divmod(round(seconds), 60)
    hour, minute = divmod(minutes, 60)
    return f"{hour}:{minute:02d}:{second:02d}"


def shown(value: float) -> str:
    """Returns a number in four significant digits."""
    return f"{value:.4g}"


def _pair(cells: list[tuple[str, str]], index: int) -> tuple[str, str]:
    """Returns the cells of line `index`, empty after the last."""
    return cells[index] if index < len(cells) else ("", "")
