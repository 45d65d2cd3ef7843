"""Writes the page about steering from what `fingers steer --json` measured.

python -m benchmarks.claims.steering_page
"""

import json
from pathlib import Path

from envs.config.atomic_file import write_atomic

RESULTS = Path("benchmarks/results/steering_planted")
GAINED = Path("benchmarks/results/command_gain")
WALKER = Path("benchmarks/results/steering_walker/crawl.json")
PAGE = Path("docs/results/steering.md")
FIGURE = Path("docs/images/steering.png")
TAKEN, FAST = "steer", "crawl"
OTHER_GAIN = "steer-gain-1"
MEMBERS = ("planted-0", "planted-1", "planted_more-0", "planted_more-1")
TURNS = ([0.1, 0.0, 0.45], [0.1, 0.0, -0.45], [0.0, 0.0, 0.45], [0.0, 0.0, -0.45])
FORWARD, RIGHT = [0.16, 0.0, 0.0], [0.0, -0.12, 0.0]


TEXT = """\
# Steering

What policies make of fixed commands, and how the robot's heading controller holds a
heading with them: 32 randomized episodes of 10 s of each kind, seed 0, in C MuJoCo;
means with 95 % intervals over episodes.

![turn rates asked and achieved](../images/steering.png)

## Turn rate

{commands}

v_x, v_y and path speed in m/s, turn rates in rad/s. The policy that walks fast turns as
its gait does, whatever it is asked; the one that steers obeys. To either side it drifts
forward, and to the right it goes at {right} of the 0.12 m/s that it is asked for.

## Every member of the population

Turn rates for (v_x, v_y, turn rate), and the path speed at full forward:

{members}

`planted_more-1` was taken, and is shown v_x and v_y times 1.2 since
(`fingers export --command-gain`); the other tables are of what came of that. By which
rules is in the README of [the
policy](../../fingers_mjx/policies/crawl_steering/README.md).

## Headings

Mean error of the heading in the last second, and the share of episodes that settled
within 3° in 5 s:

{headings}

A randomized hand turns by itself at some hundredths of a radian per second, and a
proportional controller comes to rest beside its heading by that over its gain. The
gain of 4 /s was chosen for an earlier policy, on the seeds 1 and 2.

```sh
fingers steer fingers_mjx/policies/crawl_steering --json steering.json
fingers steer fingers_mjx/policies/crawl --json crawl.json
python -m benchmarks.claims.steering_page
```
"""


def read() -> dict[str, dict]:
    """Returns, by name, what `fingers steer --json` wrote of each policy."""
    files = [*RESULTS.glob("*-steer*.json"), *GAINED.glob("steer*.json"), WALKER]
    return {path.stem: json.loads(path.read_text("utf-8")) for path in files}


def page(results: dict[str, dict]) -> str:
    """Returns the page in Markdown.

    Args:
        results: what `read` returns.
    """
    tables = {"commands": _commands, "members": _members, "headings": _headings}
    aside = _row(results[TAKEN], RIGHT)["vel_y_mps"]["mean"]
    written = {name: "\n".join(table(results)) for name, table in tables.items()}
    return TEXT.format(**written, right=f"{-aside:.3f}")


def _commands(results: dict[str, dict]) -> list[str]:
    """Table of all commands under both policies."""
    lines = [
        "| v_x | v_y | asked | steers | its path speed | walks fast |",
        "|---|---|---|---|---|---|",
    ]
    rows = zip(results[TAKEN]["commands"], results[FAST]["commands"], strict=True)
    for ours, fast in rows:
        asked = " | ".join(f"{x:+.2f}" for x in ours["command"])
        rates = [_interval(row["turn_rate_rad_s"]) for row in (ours, fast)]
        speed = f"{ours['path_speed_mps']['mean']:.3f}"
        lines.append(f"| {asked} | {rates[0]} | {speed} | {rates[1]} |")
    return lines


def _members(results: dict[str, dict]) -> list[str]:
    """Table of all members: the four turns, and the speed at full forward."""
    head = [f"({vx:g}, {vy:g}, {rate:g})" for vx, vy, rate in TURNS]
    lines = [
        f"| member | {' | '.join(head)} | full forward [m/s] |",
        "|---|---|---|---|---|---|",
    ]
    for name in MEMBERS:
        result = results[f"{name}-steer"]
        found = [_row(result, turn)["turn_rate_rad_s"] for turn in TURNS]
        speed = _row(result, FORWARD)["path_speed_mps"]
        cells = " | ".join(_interval(one) for one in [*found, speed])
        lines.append(f"| `{name}` | {cells} |")
    return lines


def _headings(results: dict[str, dict]) -> list[str]:
    """Table of the headings: gain of 4 beside 1, and the policy that walks fast."""
    lines = [
        "| step | error, steers, gain 4 | settled in 5 s | gain 1 | settled | "
        "walks fast, gain 4 | settled |",
        "|---|---|---|---|---|---|---|",
    ]
    three = [results[name]["headings"] for name in (TAKEN, OTHER_GAIN, FAST)]
    for rows in zip(*three, strict=True):
        cells = [
            f"{row['error_deg']['mean']:.1f}° | {row['settled']['mean']:.2f}"
            for row in rows
        ]
        lines.append(f"| {rows[0]['step_deg']:+.0f}° | {' | '.join(cells)} |")
    return lines


def _row(result: dict, command: list[float]) -> dict:
    return next(row for row in result["commands"] if row["command"] == command)


def _interval(found: dict) -> str:
    return f"{found['mean']:.3f} ({found['low']:.3f} to {found['high']:.3f})"


def draw(results: dict[str, dict], path: Path) -> None:
    """Draws the turn rates that were asked for and achieved."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True)
    for axis, name, title in zip(
        axes, (TAKEN, FAST), ("crawl_steering", "crawl"), strict=True
    ):
        axis.plot([-0.5, 0.5], [-0.5, 0.5], color="0.7", zorder=0, label="obeyed")
        for moving, label in ((True, "while walking"), (False, "on the spot")):
            rows = [
                r for r in results[name]["commands"] if any(r["command"][:2]) == moving
            ]
            asked = [r["command"][2] for r in rows]
            rates = [r["turn_rate_rad_s"] for r in rows]
            mean = [r["mean"] for r in rates]
            ends = [
                [r["mean"] - r["low"] for r in rates],
                [r["high"] - r["mean"] for r in rates],
            ]
            axis.errorbar(
                asked, mean, ends, fmt="o" if moving else "s", ms=5, label=label
            )
        axis.set(title=title, xlabel="turn rate asked [rad/s]")
    axes[0].set_ylabel("achieved, 95 % interval [rad/s]")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    """Writes page and figure."""
    results = read()
    draw(results, FIGURE)
    write_atomic(PAGE, page(results).encode())


if __name__ == "__main__":
    main()
