"""Kernels of keyboard pressing against values worked out by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

ASKED, IDLE = jnp.array(1.0), jnp.array(0.0)
ACTUATION_M = jnp.array([0.002, 0.002, 0.001])
SECOND = jnp.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("distance_m", "value"), [(0.0, 0.0), (0.01, 0.5), (0.03, 0.75), (1e3, 1.0)]
)
def test_distance_is_half_at_its_width_and_never_above_one(distance_m, value):
    for axis in jnp.eye(3):
        far = rewards.fingertip_distance(distance_m * axis, ASKED)
        assert far == pytest.approx(value, abs=1e-4)
    assert rewards.fingertip_distance(jnp.array([0.0, distance_m, 0.0]), IDLE) == 0.0


def test_distance_pulls_most_where_the_tip_is_nearly_there():
    slope = jax.grad(lambda d: rewards.fingertip_distance(d * jnp.ones(3), ASKED))
    near, far = slope(0.001), slope(0.02)
    assert near > 5 * far > 0
    assert np.isfinite(jax.grad(rewards.fingertip_distance)(jnp.zeros(3), ASKED)).all()


def test_depth_counts_up_to_actuation_and_for_the_requested_key_only():
    depth_m = jnp.array([0.001, 0.001, 0.004])
    assert rewards.requested_depth(depth_m, ACTUATION_M, SECOND) == pytest.approx(0.5)
    assert rewards.other_depth(depth_m, ACTUATION_M, SECOND) == pytest.approx(1.5)
    nothing = jnp.zeros(3)
    assert rewards.requested_depth(depth_m, ACTUATION_M, nothing) == 0.0
    assert rewards.other_depth(depth_m, ACTUATION_M, nothing) == pytest.approx(2.0)
    # A key above its rest, as soft joint limits allow, is not pressed.
    assert rewards.other_depth(-depth_m, ACTUATION_M, nothing) == 0.0


def test_support_is_a_share_of_the_tips():
    force_n = jnp.array([0.0, 0.1499, 0.15, 2.0])
    assert rewards.support_contact(force_n) == pytest.approx(0.5)
    assert rewards.support_contact(force_n, 0.1) == pytest.approx(0.75)


def test_touched_keys_are_counted():
    assert rewards.keys_touched(jnp.array([True, False, True])) == 2.0


def test_drift_is_a_mean_distance_in_any_direction():
    start = jnp.zeros((4, 2))
    turned = jnp.array([[0.01, 0.0], [0.0, -0.01], [-0.01, 0.0], [0.0, 0.01]])
    assert rewards.support_drift(start + turned, start) == pytest.approx(0.01)
    assert rewards.support_drift(start, start) == 0.0
    assert np.isfinite(jax.grad(rewards.support_drift)(start, start)).all()


def test_a_wrong_key_costs_more_than_waiting_and_more_in_the_end():
    weights = rewards.table_weights(rewards.KEYBOARD)
    early, late = (rewards.weights_at(weights, steps) for steps in (0, 10**6))
    wait = -early["approach"] * 1.5  # the whole time-out, as far away as can be
    per_event = 0.02
    assert -late["wrong"] * per_event > wait > 0
    assert late["wrong"] < early["wrong"] and late["wrong"] == late["stray"]
    assert early["hit"] * per_event > -early["wrong"] * per_event
