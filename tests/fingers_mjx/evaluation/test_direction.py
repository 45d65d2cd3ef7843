"""Which direction is better: the table against the measures that evaluations have."""

import json
from pathlib import Path

import pytest

from envs.registry import task_names
from fingers_mjx.evaluation.direction import BETTER, better

ROOT = Path(__file__).parents[3]
OF_TRANSFER = {
    "drift_deg_s",
    "sideways_mps",
    "straight_speed_mps",
    "straight_survival",
}
MEANINGS = {
    "higher": ("speed", "survival", "participation", "fraction", "delivered",
               "righted"),
    "lower": ("error", "time", "latency", "rate", "wrong", "stray", "tilt", "drift",
              "transport", "sideways", "stopped"),
}  # fmt: skip


@pytest.mark.parametrize("task", BETTER)
def test_every_measure_of_the_table_is_measured(task):
    assert task in task_names()
    file = ROOT / "fingers_mjx" / "policies" / task / "evaluation.json"
    measured = set(json.loads(file.read_text())["measures"]) | OF_TRANSFER
    assert set(BETTER[task]) <= measured
    described = {"command_speed_mps", "energy_j", "duration_s", "contact_overflow_rate"}
    assert not described & set(BETTER[task])


@pytest.mark.parametrize("task", BETTER)
def test_directions_are_those_of_their_names(task):
    for measure, direction in BETTER[task].items():
        other = "lower" if direction == "higher" else "higher"
        assert any(word in measure for word in MEANINGS[direction]), measure
        strict = [
            w for w in MEANINGS[other] if w in measure and w not in ("rate", "fraction")
        ]
        assert not strict, measure


def test_other_tasks_and_measures_have_what_is_common_or_nothing():
    assert better("of_my_own", "survival") == "higher"
    assert better("of_my_own", "task_speed_mps") is None
    assert better("crawl", "no_such") is None
