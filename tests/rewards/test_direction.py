import itertools

import jax.numpy as jnp
import numpy as np
import pytest

import rewards

AHEAD = jnp.array([0.1, 0.0, 0.0])


def moving(x, y=0.0, z=0.0):
    return jnp.tile(jnp.array([x, y, z]), (5, 1))


@pytest.mark.parametrize(
    ("airborne", "commanded"), list(itertools.product([False, True], repeat=2))
)
def test_gate_truth_table(airborne, commanded):
    just_below = np.nextafter(0.15, 0.0, dtype=np.float32)
    force = jnp.full(5, just_below if airborne else 0.15)
    command = jnp.array([0.02 if commanded else 0.0199, 0.0, 0.4])
    value = rewards.swing_against_command(moving(-0.2), force, command)
    assert value == pytest.approx(1.0 if airborne and commanded else 0.0, rel=1e-6)


def test_only_the_component_against_the_command_counts(rng):
    angle, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.02, 0.2)
    back, side, up = rng.uniform(0.01, 0.3, 3)
    heading = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-heading[1], heading[0]])
    command = jnp.array([*(speed * heading), 0.3])
    lifted = jnp.zeros(5)
    for sign, expected in ((-1.0, 5 * back), (1.0, 0.0)):
        velocity = moving(*(sign * back * heading + side * across), up)
        value = rewards.swing_against_command(velocity, lifted, command)
        assert value == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_size_of_the_command_does_not_matter():
    lifted = jnp.zeros(5)
    values = [
        rewards.swing_against_command(moving(-0.1, 0.05), lifted, s * AHEAD)
        for s in (0.3, 1.0, 2.0)
    ]
    np.testing.assert_allclose(values, values[0], rtol=1e-6)
    assert values[0] > 0.0


def test_each_airborne_tip_adds_its_own_speed(rng):
    backward, lifted = rng.uniform(0.0, 0.2, 5), rng.random(5) < 0.5
    velocity = jnp.zeros((5, 3)).at[:, 0].set(-backward)
    value = rewards.swing_against_command(
        velocity, jnp.where(jnp.asarray(lifted), 0.0, 1.0), AHEAD
    )
    assert value == pytest.approx((backward * lifted).sum(), rel=1e-5)
