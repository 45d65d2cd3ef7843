"""What the supervisor would stop: how hard joints press, and for how long."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.registry import make_env
from envs.tasks.push.load import LAG_S, STALL_S, load_signals, stopped
from fingers_robot.safety.limits import Limits

DT_S, STEPS = 0.02, 200


def judged(share=0.0, lag_rad=0.0, steps=STEPS, first=20, counted=STEPS):
    """Whether a hand is stopped that presses with one joint for so many steps."""
    loads = []
    for value in (share, lag_rad):
        load = np.zeros((STEPS, 20))
        load[first : first + steps, 7] = value
        loads.append(jnp.asarray(load))
    return float(stopped(*loads, jnp.arange(STEPS) < counted, DT_S))


def test_thresholds_are_those_of_the_supervisor():
    defaults = {f.name: f.default for f in Limits.__dataclass_fields__.values()}
    assert defaults["stall_effort"] == 0.9 and defaults["stall_s"] == STALL_S
    assert defaults["tracking_rad"] == 0.5 and defaults["tracking_s"] == LAG_S


@pytest.mark.parametrize(
    ("load", "seconds"), [({"share": 0.95}, STALL_S), ({"lag_rad": 0.6}, LAG_S)]
)
def test_only_what_lasts_stops_the_hand(load, seconds):
    enough = round(seconds / DT_S) + 1
    assert judged(**load, steps=enough) == 1.0
    assert judged(**load, steps=enough - 1) == 0.0
    assert judged(**load, steps=enough, first=STEPS - enough) == 1.0
    assert judged(**load, steps=enough, counted=enough) == 0.0  # after the end


def test_less_than_the_threshold_stops_nothing():
    assert judged(share=0.89, lag_rad=0.49) == 0.0


def test_two_joints_in_turn_are_not_one():
    share = np.zeros((STEPS, 20))
    share[:40, 3], share[40:80, 4] = 1.0, 1.0
    lag = jnp.zeros((STEPS, 20))
    assert stopped(jnp.asarray(share), lag, jnp.ones(STEPS, bool), DT_S) == 0.0


def test_load_is_relative_to_the_limit_of_the_world():
    env = make_env("push")
    limit_nm = env.mj_model.actuator_forcerange[:, 1]
    signals = SimpleNamespace(
        torque_nm=jnp.asarray(-0.6 * limit_nm),
        joint_pos=jnp.asarray(env.stance.target_rad) - 0.1,
        action=jnp.zeros(20).at[2].set(1.5),
    )
    world = SimpleNamespace(variation=SimpleNamespace(effort_scale=jnp.float32(1.5)))
    carried = {"world": world, "target": jnp.asarray(env.stance.target_rad)}
    found = load_signals(env.plant, carried, signals, 0.04)
    np.testing.assert_allclose(found["effort_share"], 0.4, rtol=1e-5)
    moved = 0.04 * jnp.tanh(1.5) * (jnp.arange(20) == 2)
    np.testing.assert_allclose(found["joint_lag_rad"], 0.1 + moved, atol=1e-5)
    assert jax.tree.all(jax.tree.map(lambda x: bool((x >= 0).all()), found))
