import jax.numpy as jnp
import pytest

import rewards

SHARED = {
    "track_planar_velocity": 1.0,
    "undesired_contact": -1.0,
    "vertical_velocity": -2.0,
    "roll_pitch_rate": -0.05,
    "action_rate": -0.01,
    "torque": -2.5e-5,
    "joint_acceleration": -2.5e-7,
}
CRAWL = SHARED | {"footprint": -30.0, "direction": -0.5}
STOCK = SHARED | {"track_yaw_rate": 0.5, "feet_air_time": 0.5, "flat_orientation": -5.0}
ROWS = rewards.CRAWL + rewards.STOCK


@pytest.mark.parametrize(
    ("steps", "yaw", "lift"),
    [(0, 0.0, 6.25), (17_999, 0.0, 6.25), (18_000, 0.5, 6.25), (54_000, 0.5, 0.625)],
)
def test_crawl_weights_are_the_papers(steps, yaw, lift):
    weights = rewards.weights_at(rewards.table_weights(rewards.CRAWL), steps)
    assert weights == pytest.approx(
        CRAWL | {"track_yaw_rate": yaw, "lift": lift}, rel=1e-6
    )


@pytest.mark.parametrize("steps", [0, 100_000])
def test_stock_weights_are_isaac_labs(steps):
    weights = rewards.weights_at(rewards.table_weights(rewards.STOCK), steps)
    assert weights == pytest.approx(STOCK, rel=1e-6)


def test_a_hand_at_rest_in_its_stance_is_paid_for_tracking_alone():
    shapes = {"tip_pos_v": (5, 3), "footprint_target_v": (5, 3), "tip_vel_v": (5, 3)}
    scalars = dict.fromkeys(("lift_magnitude", "air_time_magnitude"), ())
    names = {name for row in ROWS for name in row.signals}
    signals = {n: jnp.zeros((shapes | scalars).get(n, 3)) for n in names}
    signals["tip_force_n"] = jnp.ones(5)
    signals["gravity_v"] = jnp.array([0.0, 0.0, -1.0])
    for table in (rewards.CRAWL, rewards.STOCK):
        weights = rewards.weights_at(rewards.table_weights(table), 18_000)
        total, terms = rewards.evaluate(table, signals, weights, 0.02)
        paid = {name for name, term in terms.items() if term != 0.0}
        assert paid == {"track_planar_velocity", "track_yaw_rate"}
        assert total == pytest.approx(0.02 * 1.5, rel=1e-6)
