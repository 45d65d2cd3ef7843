"""What a residual may be off by, against servos that take a jump late by chance."""

import numpy as np
import pytest

from sysid.diagnosis.replay.band import TAPS
from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S, timing_uncertainty
from sysid.drive import JointDrive, Nominal

DT_S, STEPS, AT, JUMP_RAD, KP = 4e-3, 200, 100, 0.3, 5.0
FINE = 40
"""Steps of the servos for one of the grid."""


def late_torques(cutoff_hz, count=400):
    """Standard deviation of torques in the band, over servos late by chance."""
    rng, fine_s = np.random.default_rng(0), DT_S / FINE
    step = 2.0 * np.pi * cutoff_hz * fine_s
    torques = []
    for late_s in CYCLE_S * rng.normal(size=count):
        taken = np.zeros(STEPS * FINE)
        start = AT * FINE + FINE // 2
        taken[start:] = JUMP_RAD
        taken[start] -= JUMP_RAD * late_s / fine_s  # the part of a step it is late by
        passed = taken
        if np.isfinite(cutoff_hz):
            passed, now = np.empty_like(taken), 0.0
            for k, target in enumerate(taken):
                now += -np.expm1(-step) * (target - now)
                passed[k] = now
        mean = passed.reshape(STEPS, FINE).mean(1)
        torques.append(KP * np.convolve(mean, TAPS, "same"))
    return np.std(torques, axis=0)


def said(cutoff_hz):
    cmd = np.zeros((STEPS, 1))
    cmd[AT:] = JUMP_RAD
    effects = {}
    if np.isfinite(cutoff_hz):
        effects = {"lowpass_cutoff": {"cutoff_hz": Nominal(cutoff_hz)}}
    drive = JointDrive(Nominal(KP), Nominal(0.1), effects=effects)
    given = cmd, np.zeros_like(cmd), np.array([KP]), drive, DT_S
    return timing_uncertainty(*given)[:, 0]


@pytest.mark.parametrize("cutoff_hz", [np.inf, 15.0, 3.0])
def test_uncertainty_is_that_of_servos_that_take_a_jump_late(cutoff_hz):
    expected, found = late_torques(cutoff_hz), said(cutoff_hz)
    inside = slice(20, -20)  # the ends of the band
    top = expected[inside].max()
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.15 * top)


def test_a_jump_makes_the_samples_before_it_uncertain():
    """The band looks ahead."""
    found = said(np.inf)
    assert found[AT - 3] > 0.3 * found[AT] > 0.0
    assert found[AT - 20] == 0.0
