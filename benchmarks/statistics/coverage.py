"""How often statistics over seeds are right, as tables.

python -m benchmarks.statistics.coverage [--studies 2000] [--seed 0] [--json FILE]
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from benchmarks.statistics import rates
from benchmarks.statistics.shapes import SHAPES
from envs.config.atomic_file import write_atomic
from fingers_mjx.reports.page import commit_here

SEEDS = (3, 5, 12)
EFFECTS = {"nothing differs": (0.0,) * 10, "half of ten differ": (0.0, 1.0) * 5}
PROCESSES = 2


def main() -> None:
    """Draws the studies, prints the tables and keeps the numbers."""
    parser = argparse.ArgumentParser(
        description="Count how often statistics are right."
    )
    parser.add_argument("--studies", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    found = measured(args.studies, args.seed)
    print("\n".join(lines(found)))
    if args.json:
        write_atomic(args.json, json.dumps(found, indent=2) + "\n")


def measured(studies: int, seed: int) -> dict:
    """Returns all rates by name, the same for the same arguments.

    Args:
        studies: of each kind.
        seed: of all draws.
    """
    cells = [(shape, n) for shape in SHAPES for n in SEEDS]
    work = [(*cell, studies, seed) for cell in cells]
    with ProcessPoolExecutor(PROCESSES) as pool:
        rows = list(pool.map(_cell, work))
    return {
        "commit": commit_here(),
        "studies": studies,
        "seed": seed,
        "shapes": rows,
        "family": [
            {"what": what, **rates.family(effects, 12, studies, seed)}
            for what, effects in EFFECTS.items()
        ],
        "power": [{"n": n, **rates.power(n, studies, seed)} for n in SEEDS],
    }


def _cell(work: tuple[str, int, int, int]) -> dict:
    name, n, studies, seed = work
    what = (SHAPES[name], n, studies, seed)
    positives = rates.false_positives(*what)
    return {
        "shape": name,
        "n": n,
        "coverage": rates.coverage(*what),
        "false_positives": positives,
    }


def lines(found: dict) -> list[str]:
    """Returns the tables as Markdown, in percent.

    Args:
        found: from `measured`.
    """
    head = "| differences | seeds | t, mean | BCa, mean | BCa, interquartile mean |"
    text = [f"{head} t test | permuted signs |", "|---|" + "---:|" * 6]
    for row in found["shapes"]:
        cells = [*row["coverage"].values(), *row["false_positives"].values()]
        text.append(_row(row["shape"], row["n"], *map(_percent, cells)))
    text += ["", "| ten comparisons | Holm | uncorrected |", "|---|---:|---:|"]
    text += [
        _row(row["what"], _percent(row["holm"]), _percent(row["alone"]))
        for row in found["family"]
    ]
    head = "| seeds | found | found at half | said to be detectable, relative |"
    text += ["", head, "|---:|---:|---:|---:|"]
    for row in found["power"]:
        said = f"{row['low']:.2f}–{row['high']:.2f}"
        text.append(_row(row["n"], _percent(row["at"]), _percent(row["half"]), said))
    return text


def _row(*cells: object) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"


def _percent(share: float) -> str:
    return f"{100 * share:.1f}"


if __name__ == "__main__":
    main()
