"""Chooses the gain of the commands with which a policy that steers meets its bars.

python -m benchmarks.claims.command_gain POLICY [--apart] --json command_gain.json

A policy that goes at 0.8 of the speed it is asked for is shown more than is asked
(`fingers export --command-gain`). The rule, written before any gain was measured on the
seed by which it chooses: of 1.0, 1.1, … 1.5 for v_x and v_y alike, the smallest with
which every bar of steering_planted.yaml holds on seed 1, the task speed with the lower
end of its 95 % interval. Seed 0, which all other results here have, is not looked at.
On seed 0 the gains 1.1 and 1.25 had been tried before, with task speeds of 0.096 and
0.101 m/s.

`--apart` has a rule of its own, written after the first had chosen 1.2 and before its
grid was measured: of 1.0, 1.1, 1.2 and 1.3 for v_x with 1.0, 1.2, 1.4 and 1.6 for v_y,
of those with which every bar holds on seed 1 the pair with the least error of the
planar velocity over the commands of the paper, which punishes more than is asked as
well as less. The pairs (1, 1), (1.2, 1.2), (1, 1.3), (1.1, 1.1), (1.1, 1.6) and (1, 2)
had been tried on 256 other commands before. It chose (1.1, 1.4), which was not taken:
on seed 0 that turns unasked by more than the bar (`README.md`).
"""

import argparse
import dataclasses
import itertools
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.evaluation.setups import with_command
from fingers_mjx.evaluation.source import evaluate_source, summary
from fingers_mjx.evaluation.steering.commands import obeyed
from fingers_mjx.evaluation.steering.heading_hold import held
from fingers_mjx.evaluation.steering.worlds import Course
from fingers_mjx.policy.command_gain import with_command_gain
from fingers_mjx.policy.source import PolicySource, load_bundle_setup
from fingers_mjx.runs.settings import overridden
from fingers_robot.behaviour.heading import HeadingConfig

Gains = tuple[float, float]

ALIKE: tuple[Gains, ...] = tuple(
    (gain, gain) for gain in (1.0, 1.1, 1.2, 1.3, 1.4, 1.5)
)
APART: tuple[Gains, ...] = tuple(
    itertools.product((1.0, 1.1, 1.2, 1.3), (1.0, 1.2, 1.4, 1.6))
)
"""Of v_x and v_y."""

SEED = 1
PAPER = ["env.command.turning_fraction=0", "env.command.straight_fraction=0"]
"""Settings with which commands are drawn as in the paper."""
FORWARD = (0.16, 0.0, 0.0)
TURNS = ((0.1, 0.0, 0.45), (0.1, 0.0, -0.45), (0.0, 0.0, 0.45), (0.0, 0.0, -0.45))
STRAIGHT = (FORWARD, (0.0, 0.12, 0.0), (0.0, -0.12, 0.0))
RIGHT = STRAIGHT[-1]

ERROR = "planar_velocity_error_mps"
PARTICIPATION = ("five_finger_participation", "non_nail_participation")

AT_LEAST = {
    "task_speed_low_mps": 0.095,
    "survival": 0.98,
    **dict.fromkeys(PARTICIPATION, 0.97),
    "forward_path_speed_mps": 0.12,
    "right_path_speed_mps": 0.05,
    "settled": 0.9,
}
AT_MOST = {
    "turn_rate_error_rad_s": 0.12,
    "off_the_turn_rad_s": 0.1,
    "unasked_turn_rad_s": 0.06,
    "drift_deg_s": 1.0,
}


def measured(source: PolicySource, episodes: int) -> dict[str, float]:
    """Returns what the bars are about, the worst where they are about several.

    Args:
        source: policy.
        episodes: of each evaluation; of each command and heading an eighth of them.
    """
    drawn = _means(source, overridden(source.setup, PAPER), episodes)
    forward = _means(source, with_command(source.setup, FORWARD), episodes)
    course, rates = Course(episodes // 8, SEED), source.setup.env.command.yaw_rate_rps
    rows = {tuple(row["command"]): row for row in obeyed(source, course)}
    turned = {command: row["turn_rate_rad_s"]["mean"] for command, row in rows.items()}
    headings = held(source, course, HeadingConfig(4.0, 0.0, *rates))
    names = (ERROR, "turn_rate_error_rad_s", "survival", *PARTICIPATION)
    return {
        "task_speed_mps": drawn["task_speed_mps"]["mean"],
        "task_speed_low_mps": drawn["task_speed_mps"]["low"],
        **{name: drawn[name]["mean"] for name in names},
        "forward_path_speed_mps": forward["path_speed_mps"]["mean"],
        "right_path_speed_mps": rows[RIGHT]["path_speed_mps"]["mean"],
        "off_the_turn_rad_s": max(abs(turned[turn] - turn[2]) for turn in TURNS),
        "unasked_turn_rad_s": max(abs(turned[straight]) for straight in STRAIGHT),
        "drift_deg_s": abs(headings[0]["drift_deg_s"]["mean"]),
        "settled": min(row["settled"]["mean"] for row in headings),
    }


def missed(row: Mapping[str, float]) -> list[str]:
    """Returns the bars that a row misses; what is undefined misses."""
    low = [name for name, bar in AT_LEAST.items() if not row[name] >= bar]
    return low + [name for name, bar in AT_MOST.items() if not row[name] <= bar]


def chosen(rows: Sequence[Mapping[str, Any]], least: str) -> Gains | None:
    """Returns the gains of the row that misses no bar, None if each misses one.

    Args:
        rows: of a policy under each of the gains.
        least: what is the least of that row among those that miss none.
    """
    good = [row for row in rows if not missed(row)]
    if not good:
        return None
    best = min(good, key=lambda row: row[least])
    return best["gain_vx"], best["gain_vy"]


def rows_of(
    path: Path, gains: Sequence[Gains], episodes: int
) -> list[dict[str, float]]:
    """Measures a policy under each pair of gains, printing as it goes.

    Raises:
        InputError: no bundle, or of a policy without commands.
    """
    bundle, setup = load_bundle_setup(path)
    steps = bundle.manifest.provenance.normalizer.steps
    interface = bundle.manifest.interface
    found = []
    for along, across in gains:
        factors = (along, across, 1.0)
        network = with_command_gain(bundle.network, interface, factors)
        row = measured(PolicySource(path, setup, network, steps), episodes)
        found.append({"gain_vx": along, "gain_vy": across, **row})
        shown = ", ".join(f"{name} {value:.4g}" for name, value in found[-1].items())
        print(f"{shown}; misses: {', '.join(missed(row)) or 'none'}", flush=True)
    return found


def _means(
    source: PolicySource, setup: Any, episodes: int
) -> dict[str, dict[str, float]]:
    """Returns the summaries of an evaluation in another setup."""
    source = dataclasses.replace(source, setup=setup)
    table = evaluate_source(source, episodes, SEED)
    return summary(source, table.columns, SEED)["measures"]


def main(words: Sequence[str] | None = None) -> int:
    """Measures, prints the choice, and keeps the rows."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("policy", type=Path, metavar="POLICY")
    what = "gains of their own for v_x and v_y, by the second rule"
    parser.add_argument("--apart", action="store_true", help=what)
    parser.add_argument("--episodes", type=int, default=256)
    parser.add_argument("--json", type=Path)
    args = parser.parse_args(words)
    try:
        rows = rows_of(args.policy, APART if args.apart else ALIKE, args.episodes)
    except InputError as error:
        print(f"command_gain: {error}", file=sys.stderr)
        return 2
    least = ERROR if args.apart else "gain_vx"
    print(f"chosen: {chosen(rows, least) or 'none, each misses a bar'}")
    if args.json:
        write_atomic(args.json, (json.dumps(rows, indent=1) + "\n").encode())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
