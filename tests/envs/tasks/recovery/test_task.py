import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_model
from envs.hand.stance import stance_of
from envs.randomize import no_randomization
from envs.registry import make_batch, make_env
from envs.rotations import multiply
from envs.tasks.recovery.falls import (
    HELD_OUT_PER_SIDE,
    SIDES,
    TRAINING_PER_SIDE,
    falls_of,
    load_falls,
    settle_falls,
)
from envs.tasks.recovery.lying import clearance_m, down_b
from envs.tasks.recovery.task import RecoveryConfig
from rewards import RECOVERY


@pytest.fixture(scope="module")
def recovery(make_compiled):
    return make_compiled("recovery")


def in_stance(state, stance):
    qpos = jnp.tile(jnp.array(stance.qpos, jnp.float32), (len(state.reward), 1))
    target = jnp.tile(jnp.array(stance.target_rad), (len(state.reward), 1))
    drive = state.memory.drive
    line = jnp.broadcast_to(target[:, None], drive.targets.shape)
    held = drive.replace(targets=line, filtered=target, command=target)
    data = state.data.replace(qpos=qpos, qvel=jnp.zeros_like(state.data.qvel))
    memory = state.memory.replace(target=target, drive=held)
    return state.replace(data=data, memory=memory)


def test_sizes_are_those_of_the_crawl_policy(recovery):
    assert recovery.batch.observation_size == {"state": 392, "privileged_state": 427}
    logged = {k.removeprefix("reward/") for k in recovery.first.metrics if "/" in k}
    assert logged == {row.name for row in RECOVERY}
    env = make_env("recovery")
    assert (env.dt, env.episode_length) == (0.02, 1000)
    assert env.config.action_scale_rad == 0.060


def test_the_policy_is_asked_to_stand(recovery):
    np.testing.assert_array_equal(recovery.first.obs["state"][:, -24:], 0)


@pytest.mark.parametrize("held_out", [False, True])
def test_stored_falls_rest_on_their_side_and_not_in_the_floor(held_out):
    falls, model = load_falls(held_out), build_model(load_hand_file())
    for qpos, target, side in zip(
        np.array(falls.qpos), np.array(falls.target_rad), falls.side, strict=True
    ):
        assert -1.5e-3 < clearance_m(model, qpos) < 0
        others = [name for name in SIDES if name != side]
        along = {name: down_b(qpos) @ SIDES[name] for name in SIDES}
        assert all(along[side] > along[other] for other in others)
        assert along[side] > 0.25
        # The fingers are curled: far from the stance, toward their upper limits.
        assert np.mean(target.reshape(5, 4)[1:, 2:]) > 0.6


def test_clearance_sees_a_hand_in_the_floor():
    """Negative control."""
    qpos = np.array(load_falls().qpos[0])
    qpos[2] -= 0.01
    assert clearance_m(build_model(load_hand_file()), qpos) < -0.009


def test_falls_hold_both_sides_and_differ():
    training, held_out = load_falls(), load_falls(held_out=True)
    for falls, number in (
        (training, TRAINING_PER_SIDE),
        (held_out, HELD_OUT_PER_SIDE),
    ):
        assert [falls.side.count(side) for side in SIDES] == [number] * 2
        assert len(set(falls.qpos)) == len(set(falls.target_rad)) == 2 * number
    assert len(training.side) + len(held_out.side) >= 500
    assert len(held_out.side) * 3 >= len(training.side) + len(held_out.side)


def test_training_never_sees_what_is_held_out():
    """Not even nearly: no held-out pose is as near a training pose as rounding."""
    training, held_out = (np.array(load_falls(k).qpos)[:, 7:] for k in (False, True))
    apart = np.abs(held_out[:, None] - training[None]).max(axis=-1).min(axis=1)
    assert apart.min() > 0.05  # of the joint that differs most [rad]


@pytest.mark.parametrize("held_out", [False, True])
def test_stored_falls_are_those_of_the_default_hand(held_out):
    hand, stored = load_hand_file(), load_falls(held_out)
    assert falls_of(hand, stance_of(hand), held_out) is stored
    settled = settle_falls(hand, stance_of(hand), 3, held_out)
    first = [stored.side.index(side) + k for side in SIDES for k in range(3)]
    assert settled.side == tuple(stored.side[k] for k in first)
    target, qpos = np.array(stored.target_rad)[first], np.array(stored.qpos)[first]
    np.testing.assert_allclose(settled.target_rad, target, atol=1e-6)
    np.testing.assert_allclose(settled.qpos, qpos, atol=1e-4)


def test_another_hand_falls_anew(monkeypatch):
    hand = load_hand_file()
    mass = dataclasses.replace(hand.payload_mass, value=0.04)
    light = dataclasses.replace(hand, payload_mass=mass)
    falls = falls_of(light, stance_of(light))
    assert falls.hand_sha256 == light.sha256 != hand.sha256
    assert falls.qpos[:3] != load_falls().qpos[:3]
    assert falls_of(light, stance_of(light), held_out=True).qpos != falls.qpos
    monkeypatch.setattr("envs.tasks.recovery.falls._TRIES_A_POSE", 1)
    with pytest.raises(InputError, match=r"falls: wrist side: found \d of 3 falls"):
        settle_falls(light, stance_of(light), 3)


def test_starts_draw_every_fall_at_every_heading(recovery):
    env = recovery.batch.env
    print("seed 20260122")
    keys = jax.random.split(jax.random.key(20260122), 4000)
    states, targets = jax.vmap(lambda key: env.task.start(key, env.plant, None))(keys)
    joints = np.asarray(env.task.falls.qpos, np.float32)[:, 7:]
    drawn = np.abs(states.qpos[:, None, 7:] - joints).max(axis=2).argmin(axis=1)
    assert len(np.unique(drawn)) == len(joints)
    # The motors are energized where the joints are.
    limits = np.asarray(env.plant.joint_range)
    np.testing.assert_array_equal(targets, np.clip(joints[drawn], *limits.T))
    assert not np.asarray(states.qvel).any()
    pose = np.asarray(env.task.falls.qpos)[drawn, 3:7] * [1, -1, -1, -1]
    turn = jax.vmap(multiply)(states.qpos[:, 3:7], jnp.asarray(pose))
    np.testing.assert_allclose(turn[:, 1:3], 0, atol=1e-5)
    heading = np.mod(2 * np.arctan2(turn[:, 3], turn[:, 0]), 2 * np.pi)
    assert np.histogram(heading, 4, (0, 2 * np.pi))[0].min() > 900


def test_a_fallen_hand_stays_down_and_its_episode_goes_on(recovery):
    still = np.zeros((recovery.batch.episode_length, 8, 20), np.float32)
    states = recovery.roll(recovery.first, still)
    assert not any(np.asarray(state.done).any() for state in states[:-1])
    np.testing.assert_array_equal(states[-1].info["truncation"], 1)
    for state in states:
        assert (np.asarray(state.metrics["tilt_deg"]) > 45).all()
        np.testing.assert_array_equal(state.metrics["upright"], 0)
    # It was at rest: nothing pushes it out of the floor or makes it roll.
    moved = np.abs(states[-2].data.qpos[:, :3] - recovery.first.data.qpos[:, :3])
    assert moved.max() < 0.02


def test_the_stance_is_upright_and_pays_most(recovery):
    zero = np.zeros((8, 20), np.float32)
    fallen = recovery.step(recovery.first, zero)
    stood = recovery.step(in_stance(recovery.first, recovery.batch.stance), zero)
    np.testing.assert_array_equal(stood.metrics["upright"], 1)
    assert (np.asarray(stood.metrics["joint_error_rad"]) < 0.03).all()
    assert (np.asarray(stood.reward) > np.asarray(fallen.reward) + 0.02).all()
    assert (np.asarray(stood.reward) > 0.9 * 6 * 0.02).all()


def test_settling_takes_an_upright_hand_to_the_stance_whatever_the_policy_does():
    config = RecoveryConfig(settle=True, randomize=no_randomization(0.8))
    batch = make_batch("recovery", 2, config, auto_reset=False)
    start = jax.jit(batch.reset)(jax.random.key(5))
    # Its sensors measure the stance from the second step on.
    states = [in_stance(start, batch.stance)]
    states[0] = states[0].replace(
        data=states[0].data.replace(
            qpos=states[0].data.qpos.at[1].set(start.data.qpos[1])
        )
    )
    step, nod = jax.jit(batch.step), np.zeros((2, 20), np.float32)
    nod[:, ::4] = -0.1  # slowly bends the fingers
    for _ in range(125):
        states.append(step(states[-1], nod))
    begun = np.array([state.signals.extra["settling"] for state in states[1:]])
    over = np.array([state.signals.extra["settled"] for state in states[1:]])
    assert begun[:, 0].argmax() == 26 and begun[26:, 0].all()
    assert over[:, 0].argmax() == 26 + 75
    assert not begun[:, 1].any() and not over[:, 1].any()  # it still lies there
    curled, settled = (np.asarray(states[k].memory.target)[0] for k in (27, -1))
    stance = np.asarray(batch.stance.target_rad)
    assert np.abs(curled - stance).max() > 0.1
    np.testing.assert_allclose(settled, stance, atol=1e-6)
    assert states[-1].signals.extra["joint_error_rad"][0] < 0.01


@pytest.mark.parametrize(("speed_rps", "upright"), [(2.0, 1), (6.0, 0)])
def test_a_fast_hand_is_not_upright(recovery, speed_rps, upright):
    state = in_stance(recovery.first, recovery.batch.stance)
    raised = state.data.qpos.at[:, 2].add(0.3)  # so that no finger brakes the turn
    spinning = state.data.qvel.at[:, 5].set(speed_rps)
    data = state.data.replace(qpos=raised, qvel=spinning)
    after = recovery.step(state.replace(data=data), np.zeros((8, 20), np.float32))
    assert (np.asarray(after.metrics["tilt_deg"]) < 10).all()
    np.testing.assert_array_equal(after.metrics["upright"], upright)


def test_fingers_collide_with_each_other():
    """The paper's failures are fingers caught on each other."""
    model = build_model(load_hand_file())
    for one in range(1, 6):
        for other in range(one + 1, 6):
            a, b = (model.geom(f"finger{n}_link4") for n in (one, other))
            assert a.contype[0] & b.conaffinity[0] or b.contype[0] & a.conaffinity[0]


def poses(backend, sign=1.0):
    """Generalized positions of three control steps of eight worlds."""
    batch = make_batch("recovery", 8, backend=backend, auto_reset=False)
    state = jax.jit(make_batch("recovery", 8).reset)(jax.random.key(20260123))
    step, rng = jax.jit(batch.step), np.random.default_rng(20260123)
    print("seed 20260123")
    for _ in range(3):
        action = sign * rng.normal(0, 0.6, (8, 20))
        state = step(state, action.astype(np.float32))
    assert not np.asarray(state.metrics["contact_overflow"]).any()
    return np.asarray(state.data.qpos)


@pytest.mark.parametrize(
    "backend",
    [
        pytest.param("jax", marks=pytest.mark.slow),
        pytest.param("warp", marks=pytest.mark.gpu),
    ],
)
def test_a_fallen_hand_moves_alike_on_every_backend(backend):
    """Boxes and capsules on the floor touch in other points, but nearly alike."""
    on_cpu = poses("cpu")
    assert np.abs(poses(backend) - on_cpu).max() < 1e-3
    assert np.abs(poses("cpu", -1.0) - on_cpu).max() > 5e-3  # negative control


def test_configuration_survives_a_file_and_names_wrong_weights():
    config = RecoveryConfig(weights={"palm_tilt": -3.0}, episode_s=10.0)
    assert from_dict(RecoveryConfig, to_dict(config), "file") == config
    with pytest.raises(InputError, match=r"weights\.lift"):
        RecoveryConfig(weights={"lift": 1.0})
    with pytest.raises(InputError, match="control_dt_s"):
        RecoveryConfig(control_dt_s=0.013)
