"""The sweeps behind the claims: the ablation, tuned stock rewards, doubled weights."""

import math
from dataclasses import replace
from pathlib import Path

from benchmarks.claims.claims import SPEED, TUNED
from fingers_mjx.studies.comparison.results import Results, read_results
from fingers_mjx.studies.sweep.manifest import read_manifest

RESULTS = Path("benchmarks/results")
ABLATION = RESULTS / "ablation"
TUNED_STOCK, WEIGHTS = RESULTS / "tuned_stock", RESULTS / "weights"

CHOSE, TEST = (0, 1), range(2, 8)
"""Seeds of the search of tuned stock, on which three settings were chosen, and of the
test of these three."""


def read(root: Path) -> Results:
    """Reads a sweep.

    Args:
        root: its directory.
    """
    return read_results(root, read_manifest(root))


def tested(stock: Results) -> dict[str, dict[int, float]]:
    """Returns the task speeds of the settings that are in the test, by seed [m/s].

    Args:
        stock: results of the sweep of tuned stock.
    """
    speeds = {name: dict(of[SPEED]) for name, of in stock.values.items()}
    return {name: of for name, of in speeds.items() if any(s in TEST for s in of)}


def chosen(stock: Results) -> str | None:
    """Returns the setting that is fastest on the seeds of the test.

    Args:
        stock: results of the sweep of tuned stock.

    Returns:
        None while a member of the test is missing.
    """
    settings = tested(stock)
    means = {
        name: sum(of.get(seed, math.nan) for seed in TEST) / len(TEST)
        for name, of in settings.items()
    }
    if not means or any(map(math.isnan, means.values())):
        return None
    return max(means, key=lambda name: means[name])


def joined(ablation: Results, stock: Results, weights: Results) -> Results:
    """Returns the members that claims are about as those of one sweep.

    Args:
        ablation: with `ours`.
        stock: of which the chosen setting is `tuned_stock`.
        weights: footprint and lift at other weights.

    Raises:
        ValueError: evaluations that were made in different ways.
    """
    parts = [ablation, weights]
    if name := chosen(stock):
        lacks = [m for m in stock.missing if m.configuration == name]
        parts.append(
            replace(
                stock,
                configurations=(TUNED,),
                values={TUNED: stock.values[name]},
                missing=tuple(replace(m, configuration=TUNED) for m in lacks),
            )
        )
    made = [part.conditions for part in parts if part.conditions]
    if any(conditions != made[0] for conditions in made):
        raise ValueError("the sweeps were evaluated in different ways")
    return replace(
        ablation,
        configurations=tuple(n for part in parts for n in part.configurations),
        values={n: of for part in parts for n, of in part.values.items()},
        missing=tuple(m for part in parts for m in part.missing),
    )
