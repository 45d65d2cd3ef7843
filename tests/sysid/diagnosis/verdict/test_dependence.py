"""A residual that knows where the joint is, and noise that does not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.diagnosis.verdict.dependence import depends_on

STEPS, PIECES = 1200, 2
VALID = np.ones((STEPS, PIECES), bool)


def motion(rng):
    """A joint that wanders over 0.8 rad."""
    t = np.arange(STEPS)[:, None] / 20.0
    hertz, start = rng.uniform(0.1, 0.4, (2, PIECES)), rng.uniform(0.0, 6.0, PIECES)
    return 0.3 * np.sin(2 * np.pi * hertz[0] * t + start) + 0.1 * np.sin(
        2 * np.pi * hertz[1] * t
    )


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.9])
def test_noise_does_not_know_the_position(pole):
    """White, or correlated as what a simulation errs by is."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        noise = lfilter([1.0], [1.0, -pole], rng.normal(size=VALID.shape), axis=0)
        assert not depends_on(np.asarray(noise), motion(rng), VALID)


@pytest.mark.parametrize("pole", [0.0, 0.6])
@pytest.mark.parametrize("per_rad", [8.0, 60.0])
def test_a_wave_below_the_noise_is_seen(pole, per_rad):
    """Of half its variance: a mean square of 1.5 alone would be a model's error."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        noise = lfilter([1.0], [1.0, -pole], rng.normal(size=VALID.shape), axis=0)
        noise, x = np.asarray(noise) * np.sqrt(1.0 - pole**2), motion(rng)
        assert depends_on(noise + np.sin(per_rad * x), x, VALID)


def test_what_is_small_beside_the_noise_does_not_matter():
    """However surely a long record shows it: 0.08 and 0.02 of its square."""
    rng = np.random.default_rng(3)
    t = np.arange(50_000)[:, None] / 20.0
    x, valid = np.sin(t), np.ones(t.shape, bool)
    noise, wave = rng.normal(size=t.shape), np.sin(20.0 * x)
    assert depends_on(noise + 0.4 * wave, x, valid)
    assert not depends_on(noise + 0.2 * wave, x, valid)


def test_an_offset_of_each_hold_is_not_the_position_s():
    """Dry friction leaves one; in few holds chance makes a wave of it."""
    rng = np.random.default_rng(5)
    for holds, samples in ((4, 400), (8, 200), (16, 100)):
        valid = np.ones((holds * samples, 1), bool)
        for _ in range(30):
            offset = rng.normal(0.0, rng.choice([0.3, 0.5, 1.0]), holds)
            x, own = (
                np.repeat(y, samples) for y in (rng.uniform(-1, 1, holds), offset)
            )
            noise = rng.normal(size=x.shape)
            assert not depends_on((noise + own)[:, None], x[:, None], valid)


def test_nothing_that_is_left_depends_on_nothing():
    assert not depends_on(np.zeros_like(VALID, float), motion(np.random), VALID)


def test_samples_that_do_not_count_are_not_asked():
    rng = np.random.default_rng(4)
    x = motion(rng)
    wave = 3.0 * np.sin(20.0 * x)
    here = x > 0.0
    left = np.where(here, wave, rng.normal(size=x.shape))
    assert depends_on(left, x, VALID)
    assert not depends_on(left, x, ~here)
    assert not depends_on(wave, x, np.zeros_like(VALID))
    assert not depends_on(wave, np.zeros_like(x), VALID)
