"""The page about the paper's claims says what was measured, by its rule."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from support.synthetic_sweep import write_sweep

from benchmarks.claims import claims_page, sweeps
from benchmarks.claims.claims import (
    CLAIMS,
    FIVE,
    MORE_CLAIMS,
    SEEDS,
    SPEED,
    TUNED,
    WALK,
    gaps,
    measured,
    too_small,
    verdict,
    walkers,
)
from benchmarks.claims.claims_page import DIGEST, FIGURE, MEASURES, PAGE, digest
from benchmarks.claims.sweeps import (
    ABLATION,
    CHOSE,
    TEST,
    TUNED_STOCK,
    WEIGHTS,
    chosen,
    joined,
    read,
)
from envs.config.typed import load_yaml
from fingers_mjx.studies.comparison.results import Missing, Results, read_results
from fingers_mjx.studies.sweep.manifest import read_manifest
from fingers_mjx.studies.sweep.promote import choosing
from fingers_mjx.studies.sweep.spec import Sweep, seed_list

FASTER, ALIKE = CLAIMS[0], next(c for c in CLAIMS if c.paper is None)
NOISE = 0.004 * np.cos(2.4 * np.arange(SEEDS))
NONE = Results("crawl", (), {}, {}, (), {})


def page(results, stock=NONE, weights=NONE):
    return claims_page.page(results, stock, weights)


def made(gain, claim=FASTER, seeds=SEEDS, speed=0.08) -> Results:
    """Results in which `ours` is ahead by a gain, with some noise."""
    ours = dict(enumerate(speed + NOISE[:seeds]))
    other = {i: v - gain - 0.3 * NOISE[(i + 5) % SEEDS] for i, v in ours.items()}
    values: Any = {name: {claim.measure: x} for name, x in
                   ((claim.ours, ours), (claim.other, other))}  # fmt: skip
    return Results("crawl", tuple(values), values, {}, (), {})


def judged(results, claim=FASTER):
    lacks = gaps(claim, results)
    return verdict(claim, measured(claim, results), lacks, too_small(results))


def said(gain, claim=FASTER, **given):
    return judged(made(gain, claim, **given), claim)


def swept(path, gain, states, seeds=SEEDS):
    """Results of a sweep of two configurations, of which some members are not done."""
    values = {
        name: {
            i: {FASTER.measure: speed + NOISE[i % SEEDS] * share} for i in range(seeds)
        }
        for name, speed, share in (
            ("ours", 0.08, 1.0),
            ("no_footprint", 0.08 - gain, 1.3),
        )
    }
    write_sweep(path, values, states, curves=False)
    return read_results(path, read_manifest(path))


def row_of(text):
    return next(x for x in text.splitlines() if x.startswith(f"| {FASTER.text}"))


def test_the_page_is_what_the_results_say():
    read_all = tuple(map(read, (ABLATION, TUNED_STOCK, WEIGHTS)))
    assert PAGE.read_text("utf-8") == page(*read_all)
    names = "ours", chosen(read_all[1]) or "", "lift_2"
    for results, name in zip(read_all, names, strict=True):
        speeds: Any = results.values[name][SPEED]
        speeds[1] += 0.01
        assert PAGE.read_text("utf-8") != page(*read_all)
        speeds[1] -= 0.01


def stock(fastest="b", lacks=()):
    """Results of a test of two settings, one of them faster on its seeds alone."""
    values: Any = {
        name: {SPEED: {s: 0.01 + 0.01 * (name == fastest) for s in (*TEST, 8)}}
        for name in ("a", "b")
    }
    values["a"][SPEED] |= dict.fromkeys((0, 1), 0.5)  # by which they were chosen
    values["c"] = {SPEED: {0: 0.9}}  # not in the test
    for name, seed in lacks:
        del values[name][SPEED][seed]
    missing = tuple(Missing(name, seed, "", "failed") for name, seed in lacks)
    return Results("crawl", tuple(values), values, {}, missing, {})


def test_the_seeds_of_tuned_stock_are_those_of_its_specification():
    spec = load_yaml(Sweep, TUNED_STOCK / "spec.yaml")
    in_test = sweeps.tested(read(TUNED_STOCK))
    chose = choosing(spec, read_manifest(TUNED_STOCK))
    assert spec.promote is not None and len(in_test) == spec.promote.top
    assert chose == dict.fromkeys(in_test, CHOSE)
    assert seed_list(spec.promote.seeds, max(CHOSE)) == tuple(TEST)


def test_tuned_stock_is_what_is_fastest_on_the_seeds_of_its_test():
    assert chosen(stock("a")) == "a" and chosen(stock("b")) == "b"
    assert chosen(stock("b", [("a", TEST[0])])) is None
    assert chosen(NONE) is None


def test_the_page_says_how_many_fingers_tuned_stock_uses_if_it_is_known():
    without, known = stock("b"), stock("b")
    known.values["b"][FIVE] = {2: 0.5, 3: 0.0}
    known.values["a"][FIVE] = {2: 1.0}
    pages = [page(made(0.01), tuned, NONE) for tuned in (without, known)]
    assert ["take part in 0.25 of" in text for text in pages] == [False, True]
    assert ["take part" in text for text in pages] == [False, True]


def test_the_chosen_setting_is_compared_as_tuned_stock():
    every = joined(made(0.01), stock("b", [("b", 8)]), NONE)
    assert every.values[TUNED][SPEED] == dict.fromkeys(TEST, 0.02)
    assert [(m.configuration, m.seed) for m in every.missing] == [(TUNED, 8)]
    claim = MORE_CLAIMS[0]
    assert measured(claim, every).n == len(TEST)
    lost = [(gap.configuration, gap.seed) for gap in gaps(claim, every) if gap.lost]
    assert lost == [(TUNED, 8)]


def test_sweeps_that_were_evaluated_in_other_ways_are_not_compared():
    other = Results("crawl", (), {}, {}, (), {"seed": 1})
    ours = replace(made(0.01), conditions={"seed": 0})
    assert joined(ours, NONE, replace(other, conditions={"seed": 0}))
    with pytest.raises(ValueError, match="different ways"):
        joined(ours, NONE, other)


@pytest.mark.parametrize(("behind", "answer"), [(0, "agrees"), (1, "disagrees: in 11")])
def test_what_is_said_of_every_seed_holds_for_every_seed(behind, answer):
    claim = next(c for c in MORE_CLAIMS if c.every)
    results = made(0.05, claim)
    ours: Any = results.values[claim.ours]
    ours[SPEED] = dict.fromkeys(range(SEEDS), 0.08)
    ours[claim.measure] |= {i: -1.0 for i in range(behind)}
    assert judged(results, claim).startswith(answer)


def test_six_seeds_are_enough_where_the_paper_had_six():
    claim = next(c for c in MORE_CLAIMS if c.seeds == 6)
    results = made(0.05, claim, seeds=6)
    values: Any = results.values
    values["ours"] = {SPEED: dict.fromkeys(range(SEEDS), 0.08)}
    assert judged(results, claim) == "agrees"
    del values[claim.other][claim.measure][5]
    assert judged(results, claim) == "not yet: 5 of 6 seeds"


def test_the_readme_quotes_the_page():
    text = PAGE.read_text("utf-8")
    readme = " ".join((PAGE.parents[2] / "README.md").read_text("utf-8").split())
    for claim in CLAIMS[:2]:
        row = next(x for x in text.splitlines() if x.startswith(f"| {claim.text}"))
        assert row.split(" | ")[2] in readme


@pytest.mark.parametrize(
    ("gain", "answer"),
    [(0.01, "agrees"), (-0.01, "disagrees"), (0.0, "undecided: the interval has")],
)
def test_a_difference_is_on_one_side_of_zero(gain, answer):
    assert said(gain).startswith(answer)


def test_no_effect_is_one_that_is_surely_small():
    assert said(0.0, ALIKE) == "agrees"
    assert said(0.01, ALIKE) == "disagrees"
    wide = made(0.0, ALIKE)
    other: Any = wide.values[ALIKE.other][ALIKE.measure]
    other.update({i: v + 10 * NOISE[-i] for i, v in other.items()})
    assert judged(wide, ALIKE) == "undecided: the interval is too wide"


def test_nothing_is_said_before_all_seeds_are_there():
    assert said(0.01, seeds=SEEDS - 1) == "not yet: 11 of 12 seeds"
    none = Results("crawl", (), {}, {}, (), {})
    assert measured(FASTER, none).n == 0


def test_nothing_is_said_where_ours_stands():
    assert said(0.01, speed=0.03) == "undecided: the budget is too small"
    results = made(0.01)
    ours: Any = results.values["ours"]["task_speed_mps"]
    ours.update(dict.fromkeys(range(SEEDS - WALK + 1), 0.0))
    assert too_small(results) and walkers(results)[0] < WALK
    assert "Nothing can be concluded under this budget.** Of `ours` 9 of 12" in page(
        results
    )
    ours[0] = 0.06
    assert not too_small(results) and walkers(results)[0] >= WALK


def test_a_budget_is_too_small_as_soon_as_nothing_can_change_it():
    """Negative control: one that stands less, and those to come may walk."""
    results = made(0.01, seeds=5)
    ours: Any = results.values["ours"]["task_speed_mps"]
    ours.update(dict.fromkeys(range(2), 0.0))
    assert not too_small(results)
    ours[2] = 0.0
    assert too_small(results)
    assert judged(results) == "undecided: the budget is too small"


def test_a_claim_that_is_contradicted_comes_first():
    results = made(-0.01)
    text = page(results)
    assert "**Ours contradicts the paper:** The footprint objective makes" in text
    assert text.index("disagrees |") < text.index("not yet")


def test_before_anything_is_judged_the_page_says_so():
    assert "Nothing is concluded yet. Of `ours` 11 of 11" in page(made(0.01, seeds=11))
    assert "None is contradicted." in page(made(0.01))


LOST = {
    ("no_footprint", 3): ("diverged", "loss is not finite | iteration 7"),
    ("ours", 5): ("failed", "killed by SIGKILL"),
}


def test_members_that_are_lost_are_left_out_and_named(tmp_path):
    row = row_of(page(swept(tmp_path, 0.01, LOST)))
    assert "| 10 | agrees; without seed 3: `no_footprint` diverged in walk" in row
    assert "loss is not finite / iteration 7; without seed 5: `ours` failed" in row
    assert row.count("|") == 6


@pytest.mark.parametrize("state", ["waiting", "running"])
def test_a_claim_waits_for_members_that_are_not_lost(tmp_path, state):
    states = {**LOST, ("ours", 7): (state, "")}
    row = row_of(page(swept(tmp_path, 0.01, states)))
    assert "| 9 | not yet: 9 of 12 seeds; without seed 3" in row
    assert "seed 7" not in row


def test_a_member_that_is_lost_does_not_walk(tmp_path):
    lost = {("ours", i): ("diverged", "") for i in range(SEEDS - WALK)}
    assert judged(swept(tmp_path / "enough", 0.01, lost)) == "agrees"
    lost["ours", SEEDS - 1] = ("diverged", "")
    few = swept(tmp_path / "few", 0.01, lost)
    assert judged(few) == "undecided: the budget is too small"


def test_a_measure_that_no_episode_defines_is_left_out_and_named():
    results = made(0.01)
    other: Any = results.values[FASTER.other][FASTER.measure]
    other[4] = np.nan
    text = f"seed 4: `no_footprint` no episode defines {FASTER.measure}"
    assert f"| 11 | agrees; without {text} |" in row_of(page(results))


def test_seeds_beyond_the_specification_count_nowhere(tmp_path):
    """Neither as pairs nor as members that walk, nor does a claim wait for them."""
    twelve = made(0.01)
    more = swept(tmp_path, 0.01, {("ours", SEEDS): ("waiting", "")}, seeds=SEEDS + 8)
    assert walkers(more) == walkers(twelve) == (SEEDS, SEEDS)
    assert measured(FASTER, more).n == SEEDS
    assert judged(more) == "agrees"
    ours: Any = more.values["ours"][FASTER.measure]
    ours.update(dict.fromkeys(range(SEEDS - WALK + 1), 0.0))
    assert walkers(more)[0] < WALK


def test_the_picture_is_of_the_results():
    results = read(ABLATION)
    assert stamp(FIGURE) == digest(results)
    speeds: Any = results.values["ours"]["task_speed_mps"]
    speeds[0] += 1e-9
    assert stamp(FIGURE) != digest(results)


@pytest.mark.parametrize("measure", MEASURES)
def test_the_stamp_is_of_every_value_that_is_drawn(measure):
    results = read_results(ABLATION, read_manifest(ABLATION))
    before = digest(results)
    values: Any = results.values["ours"][measure]
    values[99] = values.pop(0)
    assert digest(results) != before


def test_one_command_writes_the_page_and_the_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(claims_page, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr(claims_page, "FIGURE", tmp_path / "picture.png")
    assert claims_page.main() == 0
    assert (tmp_path / "page.md").read_text("utf-8") == PAGE.read_text("utf-8")
    assert stamp(tmp_path / "picture.png") == stamp(FIGURE)


def stamp(path):
    """Of which values a picture says that it was made."""
    with Image.open(path) as picture:
        return picture.info[DIGEST]
