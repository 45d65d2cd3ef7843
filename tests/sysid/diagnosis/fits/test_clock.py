"""What a drifting clock makes of repeats is no noise, and what noise makes no drift."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.fits.clock import without_drift

DT, PERIOD, RUNS, NOISE = 0.02, 400, 3, 2e-4
PPM = 40.0


class Repeated:
    """An angle that comes three times, read by a clock, and its simulation."""

    repeat = True

    def __init__(self, drift_ppm, bend=0.0, seed=0):
        self.drift, self.bend = drift_ppm, bend
        self.t_s = DT * np.arange(PERIOD * RUNS)
        self.noise = NOISE * np.random.default_rng(seed).normal(size=self.t_s.size)
        self.valid = np.stack([np.zeros((self.t_s.size, 1), bool)] * 2)
        self.valid[1] = True
        slot = SimpleNamespace(coordinate=lambda ppm: ppm / 30.0)
        self.space = SimpleNamespace(
            of=lambda name: [1] if name == "clock_drift" else [], slots=[None, slot]
        )
        self.data = SimpleNamespace(
            track=SimpleNamespace(cmd=np.zeros((self.t_s.size, 1))), dt=DT
        )

    def raw(self, thetas, weigh=True):
        del weigh
        late = 1e-6 * (self.drift - 30.0 * thetas[:, 1:]) * self.t_s
        speed = 2.0 * np.cos(2.0 * np.pi * self.t_s / (PERIOD * DT))
        error = self.noise + speed * late * (1.0 + self.bend * late) + 0.1
        return np.stack([np.zeros_like(error), error], 1)[..., None]

    def differences(self, series, valid):
        d = (series - np.roll(series, PERIOD, 0)) / np.sqrt(2.0)
        first = np.arange(len(series)) < PERIOD
        return d, valid & ~first[:, None]


def repeated(drift_ppm, bend=0.0, seed=0) -> Any:
    return Repeated(drift_ppm, bend, seed)


def scatter(problem, raw):
    d, valid = problem.differences(raw[1], problem.valid[1])
    return float(np.std(d[valid]))


@pytest.mark.parametrize("bend", [0.0, 300.0])
def test_repeats_that_a_clock_reads_late_differ_by_noise(bend):
    problem, nominal = repeated(PPM, bend), np.zeros(2)
    plain = problem.raw(nominal[None])[0]
    assert scatter(problem, plain) > 1.5 * NOISE
    assert scatter(problem, without_drift(problem, nominal)) == pytest.approx(
        NOISE, rel=0.05
    )
    assert np.all(nominal == 0.0)


def test_repeats_in_time_stay_as_they_are():
    for seed in range(5):
        problem, nominal = repeated(0.0, seed=seed), np.zeros(2)
        plain = problem.raw(nominal[None])[0]
        assert np.all(without_drift(problem, nominal) == plain)


def test_where_nothing_repeats_nothing_is_tried():
    problem, nominal = repeated(PPM), np.zeros(2)
    problem.repeat = False
    assert np.all(without_drift(problem, nominal) == problem.raw(nominal[None])[0])
