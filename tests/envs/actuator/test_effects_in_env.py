"""Every effect of a hand file shows in the environment that trains on it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_hand as rig

from envs.actuator.catalogue import CATALOGUE
from envs.env import HandEnv
from envs.errors import InputError
from envs.hand.drive.chain import ChainState, chain_drive, in_chain
from envs.hand.drive.servo import CommandState, ServoDrive
from envs.hand.hand_file import load_hand_file
from envs.hand.model import PHYSICS_DT_S, build_model, build_spec
from envs.hand.stance import load_stance, stance_of
from envs.randomize import model_fields
from envs.tasks.crawl import Crawl
from envs.tasks.recovery.falls import falls_of

STEPS = 25
# Sizes at which an effect shows within half a second of motion in the air and on tips.
SIZES = {
    "slew_limit": {"speed_rad_s": 0.2},
    "directional_slew": {"up_rad_s": 0.2, "down_rad_s": 0.4},
    "acceleration_limit": {"acceleration_rad_s2": 2.0},
    "torque_limit": {"limit_nm": 0.03},
    "thermal_derating": {"loss_per_nm2": 1000.0, "time_constant_s": 1.0},
    "clock_drift": {"drift_ppm": 2000.0},
    "tip_friction": {"scale": 0.2},
}
TELLS = {"sensor_latency", "clock_drift", "imu_bias", "imu_misalignment"}


def size_of(name):
    shown = {}
    for key, p in CATALOGUE[name].parameters.items():
        grown = p.prior.kind == "lognormal" and p.prior.center == p.identity
        moved = p.prior.center * p.prior.spread if grown else p.prior.center
        shown[key] = p.prior.spread if p.prior.kind == "normal" else moved
    return SIZES.get(name, shown)


def motion():
    """Targets that every finger follows, offsets to the stance [rad]."""
    t = np.arange(STEPS) * 0.02
    signs = np.sign(np.sin(np.arange(20.0) + 1.0))
    return 0.15 * np.sin(2.0 * np.pi * 2.0 * t)[:, None] * signs


@pytest.fixture(scope="module")
def worlds():
    """What happens without effects, and with one effect at a time."""
    env = rig.full_env()
    shown = [{}] + [{name: size_of(name)} for name in rig.IN_HAND]
    output, read, imu, _, invalid = rig.run(env, rig.candidates(env, shown), motion())
    assert not invalid.any()
    return output.state.qpos, read, imu


@pytest.mark.parametrize("name", rig.IN_HAND)
def test_the_effect_shows(worlds, name):
    """In the motion, or in what the sensors measure of the same motion."""
    qpos, read, imu = worlds
    i = 1 + rig.IN_HAND.index(name)
    moved = np.max(np.abs(qpos[i] - qpos[0])[:, 7:])
    if name not in TELLS:
        assert moved > 2e-3
        return
    assert moved == 0.0
    pairs = ((read, 1e-4), (imu.gravity, 1e-3), (imu.angvel, 1e-3))
    assert any(np.max(np.abs(x[i] - x[0])) > size for x, size in pairs)


def test_a_hand_whose_effects_vanish_moves_as_one_without(worlds):
    env = rig.env_with()
    limits = np.asarray(env.plant.joint_range)
    target = np.clip(motion() + np.array(env.stance.target_rad), *limits.T)
    world = env.reset(jax.random.key(0)).memory.world
    fields, start = env.fields(world), env.plant.rest.state

    def step(carry, target):
        drive, data = carry
        drive, output, _ = env.plant.step(fields, data, drive, target)
        return (drive, output.state), output.state.qpos

    target = jnp.asarray(target, jnp.float32)
    first = (env.plant.drive.begin(target[0], start.qpos[7:]), start)
    qpos = jax.jit(lambda: jax.lax.scan(step, first, target)[1])()
    # Constraint rows for friction of 1 µN·m are all that is left of the effects.
    assert np.max(np.abs(qpos - worlds[0][0])) < 2e-3


def test_the_default_hand_keeps_the_servo_of_the_physics():
    env = rig.env_with()
    state = env.reset(jax.random.key(1))
    assert isinstance(env.plant.drive, ServoDrive)
    assert isinstance(state.memory.drive, CommandState)
    assert env.physics.n_substeps == env.plant.n_substeps == 4
    assert not env.mj_model.dof_frictionloss.any() and env.mj_model.npair == 0
    world = state.memory.world
    given = model_fields(env.mj_model, env.spec, world.variation)
    fields = env.fields(world)
    assert set(fields) == set(given)
    assert all(np.array_equal(fields[k], given[k]) for k in given)
    imu = env.plant.effects
    np.testing.assert_array_equal(imu.down_w, [0.0, 0.0, -1.0])


def test_effects_of_the_model_alone_keep_it_too():
    names = [n for n in rig.IN_HAND if not in_chain(CATALOGUE[n])]
    assert len(names) == 8
    hand = rig.hand_with(*map(rig.entry, names))
    assert chain_drive(hand, build_model(hand), 4, PHYSICS_DT_S) is None


def test_the_chain_is_that_of_identification():
    """The same kinds in the order of the catalogue, the command path among them."""
    hand = rig.hand_with(rig.entry("backlash", ("index",)), rig.entry("deadband"))
    chain = chain_drive(hand, build_model(hand), 4, PHYSICS_DT_S)
    names = [kind.name for kind in chain.kinds]
    assert names == [
        "transport_delay",
        "lowpass_cutoff",
        "slew_limit",
        "deadband",
        "torque_limit",
        "backlash",
    ]
    assert all(kind is CATALOGUE[kind.name] for kind in chain.kinds)
    gap = np.asarray(chain.params[-1]["gap_rad"])
    np.testing.assert_array_equal(gap > 0.0, (np.arange(20) // 4) == 1)


def test_stance_and_falls_are_those_of_the_description():
    hand = rig.hand_with(rig.entry("payload_mass", mass_kg=0.05))
    assert stance_of(hand) == load_stance()
    default = load_hand_file()
    assert falls_of(hand, load_stance()) == falls_of(default, load_stance())
    assert hand.sha256 != default.sha256
    assert hand.without_effects == default


def test_effects_that_this_hand_cannot_have_are_refused():
    for effect, field in (
        (rig.entry("mount_tilt"), "effects"),
        (rig.entry("payload_mass", mass_kg=-0.07), "payload_mass.mass_kg"),
    ):
        hand = rig.hand_with(effect)
        light = dataclasses.replace(
            hand, payload_mass=dataclasses.replace(hand.payload_mass, value=0.05)
        )
        with pytest.raises(InputError, match=field):
            HandEnv(Crawl(rig.CALM), hand=light, stance=load_stance())


def test_the_scene_gets_what_effects_need_and_no_more():
    plain = build_spec(load_hand_file()).compile()
    for name, pairs, friction, sensors in (
        ("tip_friction", 0, False, 0),
        ("coulomb_friction", 0, True, 0),
        ("load_friction", 0, True, 60),
        ("friction_anisotropy", 5, False, 0),
    ):
        model = build_spec(rig.hand_with(rig.entry(name))).compile()
        assert model.npair == pairs
        assert bool(model.dof_frictionloss[6:].all()) == friction
        assert model.nsensordata == plain.nsensordata + sensors


def test_an_environment_with_effects_resets_steps_and_forgets():
    """All of the environment around the plant, through two episodes."""
    env = rig.env_with(
        rig.entry("backlash", ("index", "thumb")),
        rig.entry("encoder_offset", ("pip",), offset_rad=0.1),
        rig.entry("imu_bias", x_rad_s=0.3),
    )
    reset, step = jax.jit(env.reset), jax.jit(env.step)
    first = reset(jax.random.key(2))
    assert isinstance(first.memory.drive, ChainState)
    offset = first.memory.drive.reading - first.data.qpos[7:]
    np.testing.assert_allclose(offset, 0.1 * (np.arange(20) % 4 == 2), atol=1e-6)
    state = first
    for _ in range(5):
        state = step(state, 0.5 * jnp.ones(20))
    assert not state.info["invalid"]
    assert np.isfinite(state.obs["state"]).all()
    assert np.max(np.abs(state.memory.drive.reading - state.data.qpos[7:])) > 0.05
    again = jax.jit(env.restart)(state).memory.drive
    fresh = jax.tree.map(jnp.shape, first.memory.drive)
    assert jax.tree.map(jnp.shape, again) == fresh
    np.testing.assert_array_equal(again.effort, 0.0)
