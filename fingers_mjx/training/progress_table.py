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


_OF_MEMBERS = {
    k: _METRICS[k]
    for k in ("episode/return", "episode/length", "task_speed_mps", "kl", "policy/std")
}


class Board:
    """Keeps the newest event of each kind and draws them."""

    def __init__(self) -> None:
        self._rows: dict[str, Mapping[str, Any]] = {}
        self._compiling_s = 0.0

    def take(self, event: Mapping[str, Any]) -> str:
        """Takes in one event and returns the sentence to print above, if any."""
        match event["event"]:
            case "compiling":
                self._compiling_s = event["elapsed_s"]
            case "progress":
                self._rows[event.get("member", "")] = event
            case "checkpoint":
                return f"saved {event['path']}"
            case "note":
                return event["text"]
        return ""

    def render(self) -> RenderableType:
        """Returns the picture of the run, or of the members, as it stands."""
        if not self._rows:
            return Text(f"compiling… {self._compiling_s:.0f} s")
        latest = max(self._rows.values(), key=lambda row: row["iteration"])
        table = _metrics(latest) if "" in self._rows else _members(self._rows)
        return Group(_headline(latest, len(self._rows)), table)


def _headline(row: Mapping[str, Any], members: int) -> Text:
    """Returns steps and speed of all members together, and the remaining time."""
    share = row["iteration"] / row["iterations"]
    bar = "━" * round(24 * share) + "╌" * (24 - round(24 * share))
    speed = row.get("steps_per_s")
    rate = f"{members * speed:,.0f} steps/s" if speed else "…"
    eta = f"ETA {clock(row['eta_s'])}" if "eta_s" in row else ""
    done, steps = f"{row['iteration']}/{row['iterations']}", members * row["env_steps"]
    return Text(f"{bar} {done}  {steps:,} steps  {rate}  {eta}")


def _metrics(row: Mapping[str, Any]) -> Table:
    """Returns two columns: metrics and reward terms."""
    table = Table.grid(padding=(0, 3))
    left = [(t, shown(row[k])) for k, t in _METRICS.items() if k in row]
    names = sorted(k for k in row if k.startswith("reward/"))
    right = [(k, shown(row[k])) for k in names]
    for index in range(max(len(left), len(right))):
        cells = [*_pair(left, index), *_pair(right, index)]
        table.add_row(*cells)
    return table


def _members(rows: Mapping[str, Mapping[str, Any]]) -> Table:
    """Returns a line for each member; one that diverged stands still."""
    table = Table(box=None, padding=(0, 2))
    for title in ("member", "iteration", *_OF_MEMBERS.values()):
        table.add_column(title, justify="right")
    for name, row in sorted(rows.items()):
        found = [shown(row[k]) if k in row else "" for k in _OF_MEMBERS]
        table.add_row(name, str(row["iteration"]), *found)
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
