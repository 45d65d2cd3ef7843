from dataclasses import dataclass
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.base import State
from envs.errors import InputError
from envs.memory import Memory, PerWorldState
from envs.randomize import Variation
from envs.signals import Signals
from fingers_mjx.evaluation.evaluate import Episodes, Measuring, evaluate
from fingers_mjx.evaluation.files import summary_document
from fingers_mjx.evaluation.record import record

DT, LIMIT = 0.02, 120
FIELDS = ("joint_pos", "joint_vel", "joint_acc", "torque_nm", "action")


def signals(time, speed, command):
    """Hands that glide along their command and tap each tip every 20 steps."""
    batch = len(speed)
    joints = {name: jnp.full((batch, 20), 0.5) for name in FIELDS}
    vectors = jnp.zeros((batch, 3))
    tap = jnp.where(time % 20 < 5, 1.0, 0.0)[:, None] * jnp.ones((1, 5))
    velocity = vectors.at[:, 0].set(speed)
    return Signals(
        **joints,
        previous_action=joints["action"],
        palm_pos_w=velocity * (time * DT)[:, None],
        palm_quat_w=jnp.tile(jnp.array([1.0, 0, 0, 0]), (batch, 1)),
        gravity_b=vectors,
        angvel_b=vectors,
        vel_v=velocity,
        angvel_v=vectors.at[:, 2].set(0.1),
        tip_pos_v=jnp.zeros((batch, 5, 3)),
        tip_vel_v=jnp.zeros((batch, 5, 3)),
        tip_vel_w=jnp.zeros((batch, 5, 3)),
        tip_force_n=tap,
        tip_shear_n=0.1 * tap,
        pad_tilt_rad=jnp.full((batch, 5), 0.4),
        link_contact=jnp.zeros((batch, 14)),
        palm_contact=jnp.zeros(batch),
        tilt_rad=jnp.zeros((batch, 2)),
        command=jnp.broadcast_to(command, (batch, 3)),
    )


@dataclass(frozen=True)
class GlidingHands:
    """World i falls after `falls_at[i]` steps; 0 never. Speed is the action."""

    falls_at: tuple[int, ...]
    auto_reset: bool
    dt: float = DT

    def reset(self, key):
        batch = len(self.falls_at)
        start = jax.random.uniform(key, (batch,))
        return self._state(jnp.zeros(batch), jnp.zeros(batch), start)

    def step(self, state, action):
        time = state.data["time"] + 1
        after = self._state(time, action[:, 0], state.data["start"])
        if not self.auto_reset:
            return after
        clock = jnp.where(after.done > 0, 0, time)
        return after.replace(data=after.data | {"time": clock})

    def _state(self, time, speed, start):
        fall = (time == jnp.array(self.falls_at)) & (time > 0)
        late = time >= LIMIT
        command = jnp.array([0.1, 0.0, 0.2])
        return State(
            data={"time": time, "start": start},
            obs={"state": start[:, None]},
            reward=0 * time,
            done=(fall | late).astype(jnp.float32),
            metrics={},
            info={"truncation": (late & ~fall).astype(jnp.float32)},
            signals=signals(time, speed, command),
            memory=None,
        )


@dataclass(frozen=True)
class DrawnHands(GlidingHands):
    """Each draws the number that it observes, as the friction of its tips."""

    def _state(self, time, speed, start):
        state, zero = super()._state(time, speed, start), 0 * start
        wide, vector = jnp.zeros((len(start), 20)), jnp.zeros((len(start), 3))
        drawn = Variation(
            tip_friction=start,
            stiffness_scale=wide.at[:, 7].set(start),
            damping_scale=wide,
            effort_scale=zero,
            payload_com_m=vector,
            payload_mass_scale=zero,
            palm_mass_scale=zero,
            palm_com_m=vector.at[:, 2].set(start),
            imu_rotation_rad=vector,
            gyro_bias_rps=vector,
        )
        world = PerWorldState(None, drawn, {}, zero, zero)
        return state.replace(memory=Memory(world, zero, None, wide, wide, None, vector))


def constant_speed(obs):
    return jnp.full((len(obs["state"]), 1), 0.08)


@cache
def run(auto_reset=False, episodes=3, steps=100, falls_at=(0, 40, 0), policy=None):
    env = GlidingHands(falls_at, auto_reset)
    policy = policy or constant_speed
    wanted = Episodes(episodes, steps, jax.random.key(5))
    return evaluate(env, policy, wanted, Measuring(mass_kg=1.0))


def test_measures_of_a_gliding_hand_are_known():
    columns = run().columns
    np.testing.assert_allclose(columns["task_speed_mps"], 0.08, rtol=1e-5)
    np.testing.assert_allclose(columns["path_speed_mps"][[0, 2]], 0.08, rtol=1e-3)
    np.testing.assert_array_equal(columns["survival"], [1, 0, 1])
    np.testing.assert_array_equal(columns["five_finger_participation"], [1, 0, 1])
    np.testing.assert_allclose(columns["mean_contact_tilt_deg"], np.degrees(0.4))
    np.testing.assert_allclose(columns["duration_s"], [2.0, 0.78, 2.0], rtol=1e-5)
    np.testing.assert_allclose(columns["energy_j"], [10.0, 3.9, 10.0], rtol=1e-5)
    cost = 10.0 / (9.81 * 0.08 * 2.0)
    np.testing.assert_allclose(columns["cost_of_transport"][0], cost, rtol=1e-3)
    np.testing.assert_allclose(columns["turn_rate_error_rad_s"][0], 0.1, rtol=1e-4)
    error = columns["planar_velocity_error_mps"][0]  # 0.08 of 0.1 m/s
    np.testing.assert_allclose(error, 0.02, rtol=1e-4)


def test_auto_reset_changes_nothing():
    plain, resetting = run(False), run(True)
    later = [x.traces.palm_pos_w[-1, 1, 0] for x in (plain, resetting)]
    assert later[0] > 1.5 * later[1] > 0  # the second one glides a second time
    for name, values in plain.columns.items():
        np.testing.assert_array_equal(resetting.columns[name], values, err_msg=name)


def test_the_time_limit_is_not_a_failure():
    columns = run(True, steps=200).columns
    np.testing.assert_array_equal(columns["survival"], [1, 0, 1])
    np.testing.assert_allclose(columns["duration_s"][0], LIMIT * DT, rtol=1e-5)


def test_a_fall_after_the_first_episode_does_not_count():
    columns = run(True, steps=200, falls_at=(0, 0, 0)).columns
    np.testing.assert_array_equal(columns["survival"], [1, 1, 1])


def test_worlds_that_blow_up_spoil_nothing():
    def exploding(obs):
        action = constant_speed(obs)
        return action.at[1].set(jnp.nan)

    env = GlidingHands((0, 1, 0), auto_reset=False)
    table = evaluate(env, exploding, Episodes(3, 100, jax.random.key(0)))
    assert np.isnan(table.traces.vel_v[:, 1]).any()
    assert table.columns["survival"][1] == 0
    assert np.isnan(table.columns["task_speed_mps"][1])
    np.testing.assert_allclose(table.columns["task_speed_mps"][[0, 2]], 0.08, rtol=1e-5)
    measures = summary_document(table.columns, "crawl", "p", 0, 1)["measures"]
    assert measures["task_speed_mps"]["n"] == 2
    assert measures["survival"]["n"] == 3


def test_batches_are_run_until_there_are_enough_episodes():
    def own_speed(obs):
        return obs["state"]

    reported = []
    env = GlidingHands((0, 0, 0), auto_reset=True)
    wanted = Episodes(7, 100, jax.random.key(1))
    table = evaluate(env, own_speed, wanted, progress=lambda *a: reported.append(a))
    speeds = table.columns["task_speed_mps"]
    assert speeds.shape == (7,)
    assert len(np.unique(speeds)) == 7, "batches must not repeat each other"
    assert reported[-1] == (300, 300)
    assert reported == sorted(reported)


@pytest.mark.parametrize("auto_reset", [False, True])
def test_what_was_drawn_stands_in_the_row_of_its_episode(auto_reset):
    wanted = Episodes(5, 100, jax.random.key(5))
    table = evaluate(
        DrawnHands((0, 40, 0), auto_reset), lambda obs: obs["state"], wanted
    )
    speed, drawn = table.columns["task_speed_mps"], table.worlds
    assert len(np.unique(speed)) == 5
    for name in ("tip_friction", "stiffness_scale_7", "palm_com_m_z"):
        np.testing.assert_allclose(drawn[f"world/{name}"], speed, rtol=1e-5)
    assert not drawn["world/stiffness_scale_6"].any()
    assert not drawn["world/palm_com_m_x"].any()
    assert not run().worlds


def test_the_key_decides_the_episodes():
    env = GlidingHands((0, 0, 0), auto_reset=True)

    def speeds(seed):
        wanted = Episodes(3, 4, jax.random.key(seed))
        table = evaluate(env, lambda obs: obs["state"], wanted)
        return table.columns["task_speed_mps"]

    np.testing.assert_array_equal(speeds(1), speeds(1))
    assert (speeds(1) != speeds(2)).all()


def test_an_episode_of_the_table_ends_where_it_ended():
    table = run(True)
    assert table.episode(0).vel_v.shape == (100, 2)
    assert table.episode(1).tip_pos_v.shape == (39, 5, 3)
    assert table.episode(1).vel_v.max() < 1


def test_the_step_compiles_once():
    traced = []

    def policy(obs):
        traced.append(1)
        return constant_speed(obs)

    run(episodes=6, steps=4, policy=policy)
    assert len(traced) == 1


def test_record_marks_undesired_contact_power_and_what_was_dropped():
    state = GlidingHands((0, 0), auto_reset=False).reset(jax.random.key(0))
    touching = state.signals.replace(
        link_contact=state.signals.link_contact.at[0, 3].set(1.0),
        palm_contact=jnp.array([0.0, 0.0]),
        torque_nm=state.signals.torque_nm.at[:, 0].set(-1.0),
    )
    dropped = {"constraint_overflow": jnp.array([0.0, 1.0])}
    found = record(state.replace(signals=touching, metrics=dropped))
    np.testing.assert_array_equal(found.overflow, [[False, False], [False, True]])
    np.testing.assert_array_equal(found.undesired, [True, False])
    np.testing.assert_allclose(found.power_w, 19 * 0.25 + 0.5)


@pytest.mark.parametrize(("field", "value"), [("episodes", 0), ("steps", -1)])
def test_counts_must_be_positive(field, value):
    with pytest.raises(InputError, match=f"{field}: found {value}"):
        run(**{field: value})
