"""Repeats of a motion: in one record, in several, at lags between the samples."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.diagnosis.likelihood.repeats import repeats_of
from sysid.diagnosis.replay.band import EVERY, sample_rows

DT = 0.005


def waves(seconds, *hertz):
    t_s = np.arange(0.0, seconds, DT)
    return sum(
        np.sin(2.0 * np.pi * f * t_s) * np.sin(np.pi * t_s / seconds) for f in hertz
    )


def data_of(*pieces):
    """A joint that was moved along these targets, piece by piece."""
    steps = max(map(len, pieces))
    cmd = np.stack([np.pad(x, (0, steps - len(x)), "edge") for x in pieces], 1)
    rows = sample_rows(steps)
    valid = rows[:, None] < np.array([len(x) for x in pieces])[None]
    track = SimpleNamespace(cmd=cmd, ext=np.zeros_like(cmd))
    return SimpleNamespace(track=track, valid=valid, dt=DT)


def scatter(repeats, series, valid):
    d, counts = repeats.differences(series, valid)
    return float(np.std(d[counts])), float(np.mean(counts))


@pytest.mark.parametrize("rows", [1600, 1602, 1603])
def test_rounds_repeat_at_any_number_of_rows(rows):
    """Also where a round is no whole number of samples."""
    once = waves(rows * DT, 0.4, 1.1)[:rows]
    data = data_of(np.tile(once, 3))
    repeats = repeats_of(data)
    assert repeats
    at = sample_rows(len(data.track.cmd))[:, None]
    signal = 5.0 * np.tile(once, 3)[at]
    noise = np.random.default_rng(1).normal(size=signal.shape)
    found, share = scatter(repeats, signal + noise, data.valid)
    assert found == pytest.approx(1.0, rel=0.12)
    assert share > 0.45


def test_each_wave_three_times_as_a_plan_has_it():
    """Every wave has a lag of its own."""
    parts = [np.tile(waves(s, f), 3) for s, f in ((4.0, 0.5), (5.0, 1.3), (6.0, 0.8))]
    data = data_of(np.concatenate(parts))
    repeats = repeats_of(data)
    lags = np.unique(np.round(-repeats.lag[repeats.piece >= 0] * EVERY * DT, 2))
    assert {4.0, 5.0, 6.0} <= set(lags.tolist())


def test_records_of_the_same_motion_are_repeats():
    once = waves(10.0, 0.3, 0.7)
    repeats = repeats_of(data_of(once, np.concatenate([np.zeros(200), once]), once))
    assert repeats
    assert np.mean(repeats.piece[:, 1] == 0) > 0.5
    assert not repeats.root_piece[400:480, 2].any()
    late = repeats.lag[repeats.piece[:, 1] == 0, 1]
    assert np.median(late) == pytest.approx(-200 / EVERY, abs=0.05)


def test_other_settings_loads_and_pushes_make_other_motions():
    """Negative control: the targets are the same, and something else is not."""
    once = waves(10.0, 0.3, 0.7)
    data = data_of(once, once)
    assert repeats_of(data, [{"kp": 200.0}, {"kp": 200.0}])
    assert not repeats_of(data, [{"kp": 200.0}, {"kp": 400.0}])
    data.track.ext[500:600, 1] = 3.0
    assert not repeats_of(data)


def test_motions_that_differ_are_none():
    """Negative control: like each other, but not the same."""
    assert not repeats_of(data_of(waves(12.0, 0.4), waves(12.0, 0.43)))
    assert not repeats_of(data_of(np.zeros(2000)))
    rng = np.random.default_rng(2)
    walk = np.cumsum(rng.normal(size=4000))
    assert not repeats_of(data_of(np.convolve(walk, np.ones(40) / 40.0, "same")))
