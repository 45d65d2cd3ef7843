"""Statistics over seeds against synthetic studies with known answers, few of them.

With 400 studies a share of 95 % has a standard error of 1.1 %, and one of 5 % too.
"""

import numpy as np
import pytest
from scipy.stats import bootstrap

from benchmarks.statistics import coverage, rates
from benchmarks.statistics.shapes import SHAPES, study
from fingers_mjx.studies.statistics.intervals import bca_interval

STUDIES, SEED = 400, 3
NORMAL = SHAPES["normal"]


@pytest.mark.parametrize("n", [3, 12])
@pytest.mark.parametrize("name", ["normal", "heavy tails", "skewed"])
def test_t_intervals_cover_at_every_number_of_seeds(name, n):
    found = rates.coverage(SHAPES[name], n, STUDIES, SEED)
    assert 0.915 <= found["t"] <= 0.985


@pytest.mark.parametrize(
    ("n", "mean", "middle"), [(3, 0.75, 0.75), (5, 0.905, 0.94), (12, 0.935, 0.965)]
)
def test_bootstraps_cover_less_with_few_seeds(n, mean, middle):
    found = rates.coverage(NORMAL, n, STUDIES, SEED)
    assert found["bca"] == pytest.approx(mean, abs=0.05 if n < 5 else 0.035)
    assert found["iqm"] == pytest.approx(middle, abs=0.05 if n < 5 else 0.035)


def test_expansion_brings_the_bootstrap_nearer_to_what_is_asked():
    """Negative control: as `scipy.stats` has it, it covers less of the same studies."""
    [values] = study(np.random.default_rng(SEED), STUDIES, 8, (NORMAL.ours,))
    plain = bootstrap(
        (values,), np.mean, n_resamples=2000, batch=250, axis=-1, rng=SEED
    ).confidence_interval
    shares = [
        np.mean((low <= 0) & (high >= 0)) for low, high in (plain, bca_interval(values))
    ]
    assert shares[0] < 0.90 < shares[0] + 0.03 < shares[1]


def test_false_positives_are_as_rare_as_said():
    for n in (5, 12):
        found = rates.false_positives(NORMAL, n, STUDIES, SEED)
        assert 0.02 <= found["t"] <= 0.085
    assert found["signs"] == pytest.approx(found["t"], abs=0.03)
    assert rates.false_positives(NORMAL, 5, 50, SEED)["signs"] == 0


def test_holm_keeps_the_rate_of_ten_comparisons():
    for effects in coverage.EFFECTS.values():
        found = rates.family(effects, 12, STUDIES, SEED)
        assert found["holm"] <= 0.085
        assert found["alone"] > 0.12  # negative control


def test_what_is_called_detectable_is_found_in_four_of_five_studies():
    found = rates.power(5, 2000, SEED)
    assert found["at"] == pytest.approx(0.80, abs=0.035)
    assert found["half"] < 0.40
    assert found["low"] < 0.6 < 1.5 < found["high"]


@pytest.mark.parametrize("name", SHAPES)
def test_the_answer_of_a_study_is_its_mean_difference(name):
    shape = SHAPES[name]
    arms = study(np.random.default_rng(SEED), 500, 1000, (shape.ours, shape.other))
    difference = arms[0] - arms[1]
    error = difference.std() / np.sqrt(difference.size)
    assert difference.mean() == pytest.approx(shape.truth, abs=5 * error)


def test_tables_hold_every_number():
    found = {
        "shapes": [
            {
                "shape": "normal",
                "n": 3,
                "coverage": {"t": 0.95, "bca": 0.74, "iqm": 0.71},
                "false_positives": {"t": 0.053, "signs": 0.0},
            }
        ],
        "family": [{"what": "nothing differs", "holm": 0.043, "alone": 0.297}],
        "power": [{"n": 5, "at": 0.8, "half": 0.3, "low": 0.37, "high": 1.67}],
    }
    text = "\n".join(coverage.lines(found))
    assert "| normal | 3 | 95.0 | 74.0 | 71.0 | 5.3 | 0.0 |" in text
    assert "| nothing differs | 4.3 | 29.7 |" in text
    assert "| 5 | 80.0 | 30.0 | 0.37–1.67 |" in text
