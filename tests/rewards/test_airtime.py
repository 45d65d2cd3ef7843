import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

DT_S = 0.02
PARAMS = rewards.AirTimeParams()


@jax.jit
def values(tip_force_n, command_planar):
    def step(memory, force):
        return rewards.air_time_step(memory, force, command_planar, DT_S, PARAMS)

    return jax.lax.scan(step, rewards.init_air_time_memory(), tip_force_n)[1]


def swing(airborne_steps, before=3, after=4):
    """Forces of a hand whose second tip swings once."""
    force = np.ones((before + airborne_steps + after, 5))
    force[before : before + airborne_steps, 1] = 0.0
    return jnp.asarray(force)


@pytest.mark.parametrize("airborne_steps", [1, 24, 40])
def test_swing_is_paid_once_at_touchdown(airborne_steps):
    paid = values(swing(airborne_steps), jnp.array([0.2, 0.0]))
    expected = np.zeros(paid.shape)
    # The landing interval counts as flight, as in Isaac Lab's sensor.
    expected[3 + airborne_steps] = (airborne_steps + 1) * DT_S - 0.5
    np.testing.assert_allclose(paid, expected, atol=1e-5)


def test_term_is_negative_for_short_and_positive_for_long_swings():
    command = jnp.array([0.0, -0.2])
    assert values(swing(10), command).min() < 0.0
    assert values(swing(40), command).max() > 0.0


def test_command_must_exceed_its_threshold():
    for speed, paid in ((0.1, False), (0.1001, True)):
        assert bool(values(swing(40), jnp.array([speed, 0.0])).any()) == paid


def test_tip_that_starts_in_contact_has_not_landed():
    assert not values(jnp.ones((5, 5)), jnp.array([0.2, 0.0])).any()


def test_long_flight_of_two_tips_adds_up():
    force = jnp.ones((50, 5)).at[1:40, jnp.array([0, 3])].set(0.0)
    both = values(force, jnp.array([0.2, 0.0])).sum()
    one = values(force.at[:, 0].set(1.0), jnp.array([0.2, 0.0])).sum()
    assert float(both) == pytest.approx(2.0 * float(one), rel=1e-5)
