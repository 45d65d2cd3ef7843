import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rewards

LOW, HIGH = 0.005, 0.015
slope = jax.jit(jax.grad(lambda x: rewards.smoothstep(LOW, HIGH, x)))
steps = jax.jit(lambda x: rewards.smoothstep(LOW, HIGH, x))


@settings(max_examples=50, deadline=None)
@given(st.floats(-1.0, 1.0, width=32), st.floats(0.0, 1.0, width=32))
def test_smoothstep_is_bounded_monotone_and_odd_about_its_middle(x, dx):
    value, later = steps(jnp.array([x, x + dx]))
    mirrored = steps(jnp.asarray(LOW + HIGH - x))
    # an ulp at the top: t² and 3 − 2t are rounded separately
    assert 0.0 <= value <= later + 2e-7 <= 1.0 + 4e-7
    assert value + mirrored == pytest.approx(1.0, abs=1e-5)
    assert slope(jnp.asarray(x)) >= 0.0


def test_smoothstep_is_continuously_differentiable_at_its_ends():
    span = HIGH - LOW
    for end in (LOW, HIGH):
        for side in (-1e-4, 0.0, 1e-4):
            # |S'| ≤ 6 |distance| / span² next to an end
            assert abs(slope(end + side * span)) <= 6.01e-4 / span
    assert steps(jnp.asarray(LOW)) == 0.0
    assert steps(jnp.asarray(HIGH)) == 1.0
    assert slope(0.5 * (LOW + HIGH)) == pytest.approx(1.5 / span, rel=1e-5)


def test_safe_norm_equals_numpy_and_is_flat_at_zero(rng):
    x = rng.normal(size=(7, 3)).astype(np.float32)
    x[3] = 0.0
    norm = rewards.safe_norm(jnp.asarray(x))
    np.testing.assert_allclose(norm, np.linalg.norm(x, axis=-1), rtol=1e-6)
    gradient = jax.jit(jax.grad(lambda x: rewards.safe_norm(x).sum()))(x)
    np.testing.assert_array_equal(gradient[3], 0.0)
    unit = np.delete(np.asarray(gradient), 3, axis=0)
    np.testing.assert_allclose(np.linalg.norm(unit, axis=-1), 1.0, rtol=1e-5)
    plain = jax.jit(jax.grad(lambda x: jnp.linalg.norm(x, axis=-1).sum()))(x)
    assert np.isnan(plain[3]).any()


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 10.0), st.floats(0.0, 2 * np.pi))
def test_tracking_kernel_falls_to_one_over_e_at_its_width(width, angle):
    error = width * jnp.array([np.cos(angle), np.sin(angle)])
    value = [rewards.tracking_kernel(s * error, width) for s in (0.0, 0.5, 1.0, 2.0)]
    assert value[0] == 1.0
    np.testing.assert_allclose(value, np.exp([0.0, -0.25, -1.0, -4.0]), rtol=1e-4)
