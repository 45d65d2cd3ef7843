"""Sine and cosine in plain arithmetic are those of the library, but for rounding."""

import jax.numpy as jnp
import numpy as np
import pytest

from envs.actuator.trigonometry import sine_cosine


@pytest.mark.parametrize("most", [1.0, 10.0, 8e3])
def test_sine_and_cosine_are_right_to_the_last_digit(most):
    x = np.random.default_rng(0).uniform(-most, most, 100_000).astype(np.float32)
    sine, cosine = (np.asarray(v, float) for v in sine_cosine(jnp.asarray(x)))
    assert sine == pytest.approx(np.sin(x.astype(float)), abs=1.2e-7)
    assert cosine == pytest.approx(np.cos(x.astype(float)), abs=1.2e-7)


def test_what_is_no_angle_stays_so():
    sine, cosine = sine_cosine(jnp.asarray([0.0, np.inf, np.nan, 1e30], jnp.float32))
    assert (sine[0], cosine[0]) == (0.0, 1.0)
    assert np.isnan(sine[1:3]).all() and np.isnan(cosine[1:3]).all()
    assert abs(sine[3]) <= 1.0 and abs(cosine[3]) <= 1.0
