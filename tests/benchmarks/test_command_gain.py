"""How the gain of the commands is chosen."""

import json
from pathlib import Path

import pytest

from benchmarks.claims.command_gain import (
    ALIKE,
    APART,
    AT_LEAST,
    AT_MOST,
    ERROR,
    RIGHT,
    chosen,
    main,
    measured,
    missed,
)
from fingers_deploy import load_bundle
from fingers_mjx.policy.command_gain import with_command_gain
from fingers_mjx.policy.digest import digest
from fingers_mjx.policy.source import load_source

POLICY = Path("fingers_mjx/policies/crawl_steering")
PLANTED = Path("benchmarks/claims/policies/steering_planted")
RESULTS = Path("benchmarks/results/command_gain")
GOOD = AT_LEAST | AT_MOST


def test_a_row_on_every_bar_misses_none():
    assert missed(GOOD) == []


@pytest.mark.parametrize("name", AT_LEAST)
def test_less_than_is_asked_for_misses(name):
    assert missed(GOOD | {name: 0.999 * GOOD[name]}) == [name]


@pytest.mark.parametrize("name", AT_MOST)
def test_more_than_is_allowed_misses(name):
    assert missed(GOOD | {name: 1.001 * GOOD[name]}) == [name]


@pytest.mark.parametrize("name", GOOD)
def test_what_is_undefined_misses(name):
    assert missed(GOOD | {name: float("nan")}) == [name]


def measured_rows(gains, name):
    rows = json.loads((RESULTS / name).read_text("utf-8"))
    assert [(row["gain_vx"], row["gain_vy"]) for row in rows] == list(gains)
    return rows


def row(gains, error, **changed):
    along, across = gains
    return GOOD | {"gain_vx": along, "gain_vy": across, ERROR: error} | changed


def test_the_least_of_those_that_miss_no_bar_is_chosen():
    bad = row((1.0, 1.0), 0.01, survival=0.5)
    rows = [bad, row((1.3, 1.0), 0.03), row((1.2, 1.4), 0.04)]

    assert chosen(rows, ERROR) == (1.3, 1.0)
    assert chosen(rows, "gain_vx") == (1.2, 1.4)
    assert chosen(rows[:1], ERROR) is None


def test_the_committed_policy_has_the_gain_that_was_chosen():
    gains = chosen(measured_rows(ALIKE, "gains.json"), "gain_vx")
    assert gains is not None
    before, after = load_bundle(PLANTED), load_bundle(POLICY)
    interface = before.manifest.interface

    wanted = with_command_gain(before.network, interface, (*gains, 1.0))

    assert digest(after.network) == digest(wanted) != digest(before.network)


def test_gains_apart_turn_too_much_unasked_on_the_seed_of_the_other_results():
    gains = chosen(measured_rows(APART, "gains-apart.json"), ERROR)
    steered = json.loads((RESULTS / "apart-1.1-1.4.json").read_text("utf-8"))
    rows = {tuple(row["command"]): row for row in steered["commands"]}

    assert gains == (1.1, 1.4)
    assert -rows[RIGHT]["turn_rate_rad_s"]["mean"] > AT_MOST["unasked_turn_rad_s"]


def test_what_the_bars_are_about_is_measured():
    found = measured(load_source(POLICY), 8)

    assert set(found) == set(GOOD) | {"task_speed_mps", ERROR}
    assert found["task_speed_low_mps"] < found["task_speed_mps"] < 0.16


def test_a_policy_without_commands_is_refused(capsys):
    assert main(["fingers_mjx/policies/keyboard"]) == 2
    assert "command of 3 entries" in capsys.readouterr().err
