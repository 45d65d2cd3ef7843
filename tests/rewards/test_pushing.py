from itertools import pairwise

import jax
import jax.numpy as jnp
import pytest

import rewards


def test_progress_and_regress_are_the_change_of_a_potential():
    """Their sum over any path depends on its ends alone."""
    weights = rewards.weights_at(rewards.table_weights(rewards.PUSH), 0)
    distances = jnp.array([0.30, 0.25, 0.28, 0.10, 0.02, 0.15])
    paid = 0.0
    for before, after in pairwise(distances):
        speed = (before - after) / 0.02
        for name in ("object_progress", "object_regress"):
            paid += weights[name] * getattr(rewards, name)(speed) * 0.02
    assert paid == pytest.approx(20.0 * (0.30 - 0.15), rel=1e-5)


def test_arrival_pays_inside_two_centimetres_only():
    inside, outside = map(
        rewards.object_delivered, (jnp.array(0.0199), jnp.array(0.02))
    )
    assert (inside, outside) == (1.0, 0.0)


@pytest.mark.parametrize("name", ["object_reached", "object_at_target"])
def test_nearer_pays_more_and_nothing_is_not_a_number(name):
    kernel, shape = getattr(rewards, name), (2,) if name == "object_reached" else ()
    values = [kernel(jnp.full(shape, d)) for d in (0.0, 0.01, 0.05, 1.0)]
    assert values[0] == 1.0
    assert values == sorted(values, reverse=True) and values[-1] >= 0
    slope = jax.grad(lambda x: kernel(x))(jnp.zeros(shape))
    assert jnp.all(slope == 0)


def test_the_gait_is_paid_as_in_crawling():
    crawl = {row.name: row for row in rewards.CRAWL}
    shared = [row for row in rewards.PUSH if row.name in crawl]
    assert len(shared) == len(crawl)
    for row in shared:
        assert row == crawl[row.name] or row.name == "track_yaw_rate"
