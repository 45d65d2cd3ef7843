import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards


def oracle(tips, targets):
    stiffness = np.diag([0.25, 1.0, 1.0])
    return sum(
        (p - q) @ stiffness @ (p - q) for p, q in zip(tips, targets, strict=True)
    )


def test_equals_the_quadratic_forms_of_the_paper(rng):
    tips, targets = rng.normal(size=(2, 5, 3))
    value = rewards.footprint_departure(jnp.asarray(tips), jnp.asarray(targets))
    assert value == pytest.approx(oracle(tips, targets), rel=1e-5)


def test_lateral_and_vertical_cost_four_times_fore_aft(rng):
    step = rng.uniform(0.001, 0.1)
    stance = jnp.zeros((5, 3))
    finger = rng.integers(5)
    fore, lateral, vertical = (
        float(rewards.footprint_departure(stance.at[finger, axis].set(step), stance))
        for axis in range(3)
    )
    assert lateral == pytest.approx(4.0 * fore, rel=1e-6)
    assert vertical == pytest.approx(4.0 * fore, rel=1e-6)


def test_moving_body_and_targets_together_costs_nothing(rng):
    tips, shift = jnp.asarray(rng.normal(size=(5, 3))), jnp.asarray(rng.normal(size=3))
    assert rewards.footprint_departure(tips + shift, tips + shift) == 0.0
    assert rewards.footprint_departure(tips + shift, tips) > 0.0


def test_grows_with_the_square_of_the_departure(rng):
    tips = jnp.asarray(rng.normal(size=(5, 3)))
    values = [rewards.footprint_departure(s * tips, 0.0 * tips) for s in (1, 2, 4)]
    np.testing.assert_allclose(np.divide(values, values[0]), [1, 4, 16], rtol=1e-5)


def test_targets_are_captured_once(rng):
    tips = jnp.asarray(rng.normal(size=(4, 3, 5, 3)), jnp.float32)

    def rollout(tips):
        step = lambda m, p: (rewards.footprint_step(m, p),) * 2  # noqa: E731
        return jax.lax.scan(step, rewards.init_footprint_memory(), tips)[1]

    memory = jax.jit(jax.vmap(rollout))(tips)
    assert memory.captured.all()
    for later in range(3):
        np.testing.assert_array_equal(memory.target_v[:, later], tips[:, 0])
    assert not rewards.init_footprint_memory().captured
