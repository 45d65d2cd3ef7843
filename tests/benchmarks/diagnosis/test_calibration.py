"""The reliability of probabilities, on cases whose truth is drawn from them."""

import dataclasses

import numpy as np
import pytest

from benchmarks.diagnosis.calibration import (
    Case,
    calibration_error,
    cases_of,
    fitted,
    leading,
    log_score,
)
from benchmarks.diagnosis.score import Row
from sysid.diagnosis.verdict.posterior import CALIBRATION, posterior

EFFECTS = ("armature", "backlash", "deadband")
SURER = dataclasses.replace(CALIBRATION, temper=3.0)


def drawn(count: int, seed: int) -> list[Case]:
    """Cases with the truth that the posterior says, as often as it says."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        gains = rng.uniform(-5.0, 60.0, len(EFFECTS))
        said = {(): 0.0} | {(e,): g for e, g in zip(EFFECTS, gains, strict=True)}
        named = {max(said, key=said.__getitem__)}
        odds = posterior(said, named, False)
        truth = list(odds)[rng.choice(len(odds), p=list(odds.values()))]
        cases.append(Case(said, named, False, truth))
    return cases


def test_probabilities_that_come_true_as_often_as_said_are_calibrated():
    assert calibration_error(*leading(CALIBRATION, drawn(2000, 0))) < 0.04


def test_probabilities_that_are_too_sure_are_not():
    assert calibration_error(*leading(SURER, drawn(2000, 0))) > 0.1


def test_a_fit_finds_probabilities_that_are_right():
    cases, fresh = drawn(300, 1), drawn(1000, 2)
    found = fitted(cases)
    assert log_score(found, cases) >= log_score(CALIBRATION, cases) - 1e-3
    assert calibration_error(*leading(found, fresh)) < 0.06


def row(**changes) -> Row:
    evidence = {
        "a": {"": -40.0, "deadband": 0.0, "backlash": -1.0},
        "b": {"": 0.0, "deadband": -2.0},
    }
    fields = {
        "group": "single", "seed": 1, "kind": "arm", "effects": ("deadband",),
        "joint": "a", "magnitude": "strong", "ratio": 4.0, "verdict": "ambiguous",
        "causes": ("deadband",), "alternatives": ("backlash",), "evidence": evidence,
        "signs": ("b: the position residual is 2.0 times the noise",),
    }  # fmt: skip
    return Row(**{**fields, **changes})


def test_a_row_is_a_case_for_every_joint():
    a, b = cases_of(row())
    assert a.named == {("deadband",), ("backlash",)} and a.truth == ("deadband",)
    assert b.named == {()} and b.truth == ()
    assert (a.left, b.left) == (False, True)


@pytest.mark.parametrize(("group", "truth"), [("outside", None), ("invisible", ())])
def test_the_truth_of_a_row(group, truth):
    assert cases_of(row(group=group))[0].truth == truth
