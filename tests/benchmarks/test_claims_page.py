"""The page about the paper's claims says what was measured, by its rule."""

from typing import Any

import numpy as np
import pytest

from benchmarks.claims.claims import CLAIMS, SEEDS, WALK, measured, verdict, walkers
from benchmarks.claims.claims_page import ABLATION, PAGE, page
from fingers_mjx.studies.comparison.results import Results, read_results
from fingers_mjx.studies.sweep.manifest import read_manifest

FASTER, ALIKE = CLAIMS[0], CLAIMS[2]
NOISE = 0.004 * np.cos(2.4 * np.arange(SEEDS))


def made(gain, claim=FASTER, seeds=SEEDS, speed=0.08) -> Results:
    """Results in which `ours` is ahead by a gain, with some noise."""
    ours = dict(enumerate(speed + NOISE[:seeds]))
    other = {i: v - gain - 0.3 * NOISE[(i + 5) % SEEDS] for i, v in ours.items()}
    values: Any = {name: {claim.measure: x} for name, x in
                   ((claim.ours, ours), (claim.other, other))}  # fmt: skip
    return Results("crawl", tuple(values), values, {}, (), {})


def said(gain, claim=FASTER, **given):
    results = made(gain, claim, **given)
    return verdict(claim, measured(claim, results), walkers(results)[0] >= WALK)


def test_the_page_is_what_the_results_say():
    results = read_results(ABLATION, read_manifest(ABLATION))
    assert PAGE.read_text("utf-8") == page(results)
    speeds: Any = results.values["ours"]["task_speed_mps"]
    speeds[0] += 0.01
    assert PAGE.read_text("utf-8") != page(results)


@pytest.mark.parametrize(
    ("gain", "answer"),
    [(0.01, "agrees"), (-0.01, "disagrees"), (0.0, "open: the interval has")],
)
def test_a_difference_is_on_one_side_of_zero(gain, answer):
    assert said(gain).startswith(answer)


def test_no_effect_is_one_that_is_surely_small():
    assert said(0.0, ALIKE) == "agrees"
    assert said(0.01, ALIKE) == "disagrees"
    wide = made(0.0, ALIKE)
    other: Any = wide.values[ALIKE.other][ALIKE.measure]
    other.update({i: v + 10 * NOISE[-i] for i, v in other.items()})
    found = measured(ALIKE, wide)
    assert verdict(ALIKE, found, True) == "open: the interval is too wide"


def test_nothing_is_said_before_all_seeds_are_there():
    assert said(0.01, seeds=SEEDS - 1) == "not yet: 11 of 12 seeds"
    none = Results("crawl", (), {}, {}, (), {})
    assert measured(FASTER, none).n == 0


def test_nothing_is_said_where_ours_stands():
    assert said(0.01, speed=0.03) == "open: the budget is too small"
    results = made(0.01)
    ours: Any = results.values["ours"]["task_speed_mps"]
    ours.update(dict.fromkeys(range(SEEDS - WALK + 1), 0.0))
    assert walkers(results)[0] < WALK
    ours[0] = 0.06
    assert walkers(results)[0] >= WALK


def test_a_claim_that_is_contradicted_comes_first():
    results = made(-0.01)
    text = page(results)
    assert "**Ours contradicts the paper:** The footprint objective makes" in text
    assert text.index("disagrees |") < text.index("not yet")


def test_before_anything_is_judged_the_page_says_so():
    assert "Nothing is concluded yet. Of `ours` 11 of 11" in page(made(0.01, seeds=11))
    assert "None is contradicted." in page(made(0.01))
