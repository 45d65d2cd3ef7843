"""Dry friction, or a hysteresis that is dry friction? With models written here."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.replay.band import BAND_STEPS, sample_rows
from sysid.diagnosis.search.presliding import (
    RESOLVED,
    is_dry,
    repeats_friction,
    turning_travel,
)
from sysid.diagnosis.search.stage import deciding_gap, simplest_first

NOISE_RAD = 1e-3
COULOMB = Slot("coulomb_friction", "torque_nm", "N·m", "linear", 1.0, 0.0, 0.0, 9.0,
               0.0, (), True)  # fmt: skip
HEIGHT = Slot("hysteresis", "torque_nm", "N·m", "linear", 1.0, 0.0, 0.0, 9.0, 0.0, (),
              True)  # fmt: skip
RANGE = Slot("hysteresis", "range_rad", "rad", "linear", 1.0, 0.0, 0.0, 9.0, 0.0, (),
             False)  # fmt: skip
STEP_S, STEPS, RATE, SWING = 0.01, 4000, 3.0, 0.5


def track(swing) -> Any:
    """A sine of 3 rad/s; it turns at q̈ = 9 times its size."""
    t_s = STEP_S * np.arange(STEPS)[:, None]
    vel, acc = RATE * np.cos(RATE * t_s), -(RATE**2) * np.sin(RATE * t_s)
    motion = SimpleNamespace(vel=swing * vel, acc=swing * acc)
    valid = np.ones((len(sample_rows(STEPS)), 1), bool)
    return SimpleNamespace(noise=(NOISE_RAD, 0.0), track=motion, valid=valid, dt=STEP_S)


PROBLEM: Any = SimpleNamespace(
    space=Space((COULOMB, HEIGHT, RANGE)), samples=2000, data=track(0.0)
)
DRY, WIDE = 0.9 * RESOLVED * NOISE_RAD, 1.1 * RESOLVED * NOISE_RAD


def model(effects, score, range_rad=0.0) -> Any:
    """A fit; its gap to another is half the difference of their scores."""
    return SimpleNamespace(
        effects=effects,
        score=score,
        noise_cost=0.0,
        correlation=1e-9,
        variance=lambda samples: 1.0,
        fit=SimpleNamespace(theta=np.array([0.1, 0.1, range_rad])),
    )


def first(behind, range_rad, gain=1000.0):
    """The effect that is first where a hysteresis is ahead of dry friction."""
    nothing = model((), 2.0 * gain)
    hysteresis = model(("hysteresis",), 0.0, range_rad)
    friction = model(("coulomb_friction",), 2.0 * behind)
    return simplest_first(PROBLEM, nothing, [hysteresis, friction])[0].effects[0]


@pytest.mark.parametrize(
    ("behind", "range_rad", "wins"),
    [
        (90.0, DRY, "coulomb_friction"),
        (110.0, DRY, "hysteresis"),
        (90.0, WIDE, "hysteresis"),
        (10.0, WIDE, "coulomb_friction"),
    ],
)
def test_a_tenth_decides_where_readings_do_not_show_the_range(behind, range_rad, wins):
    assert first(behind, range_rad) == wins


def test_small_gains_tie_as_those_of_other_effects_do():
    """A tenth of 20 nat would decide where the usual 3 nat do not."""
    assert first(2.5, DRY, gain=20.0) == "coulomb_friction"
    assert first(3.5, DRY, gain=20.0) == "hysteresis"


def test_a_range_that_is_crossed_within_the_band_of_a_turn_is_dry():
    crossed = 0.5 * RATE**2 * SWING * (BAND_STEPS * STEP_S) ** 2
    assert turning_travel(track(SWING)) == pytest.approx(crossed, rel=1e-3)
    assert turning_travel(track(0.0)) == 0.0
    fast: Any = SimpleNamespace(**vars(PROBLEM) | {"data": track(SWING * 10.0)})
    wide = model(("hysteresis",), 0.0, 9.0 * crossed)
    assert is_dry(fast, wide)
    assert not is_dry(PROBLEM, wide)
    assert not is_dry(fast, model(("hysteresis",), 0.0, 11.0 * crossed))


def test_the_effect_added_last_is_the_one_that_is_judged():
    assert is_dry(PROBLEM, model(("hysteresis",), 0.0, DRY))
    assert not is_dry(PROBLEM, model(("hysteresis", "backlash"), 0.0, DRY))
    other = model(("hysteresis", "stribeck_friction"), 0.0, DRY)
    assert deciding_gap(PROBLEM, "coulomb_friction", other, 1000.0) == pytest.approx(15)


def test_dry_friction_is_not_added_twice():
    """Else dry friction would go for it when effects that idle are dropped."""
    friction = ("coulomb_friction",)
    twice = model((*friction, "hysteresis"), 0.0, DRY)
    assert repeats_friction(PROBLEM, twice)
    assert not repeats_friction(PROBLEM, model(twice.effects, 0.0, WIDE))
    backlash = model((*friction, "backlash"), 50.0)
    found = simplest_first(PROBLEM, model(friction, 100.0), [twice, backlash])
    assert found == [backlash]
    assert simplest_first(PROBLEM, model(friction, 100.0), [twice]) == []
