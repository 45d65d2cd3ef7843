"""Hands with effects, and many candidates of them in one program; for tests."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from envs.actuator.catalogue import CATALOGUE
from envs.hand.hand_file import Effect, load_hand_file
from envs.hand.quantity import Quantity
from envs.randomize import model_fields, no_randomization
from envs.registry import make_env
from envs.sensing import imu_of
from envs.tasks.crawl import CrawlConfig

CALM = CrawlConfig(randomize=no_randomization(0.88))
IN_HAND = tuple(name for name in CATALOGUE if name != "mount_tilt")


def entry(name, where=("all",), other="", **values):
    """An effect of a hand file; at the prior's center where no value is given."""
    parameters = {
        key: Quantity(float(values.get(key, p.prior.center)), p.unit, "user")
        for key, p in CATALOGUE[name].parameters.items()
    }
    return Effect(name, parameters, where, other)


def hand_with(*effects):
    return dataclasses.replace(load_hand_file(), effects=effects)


def env_with(*effects, config=CALM, backend="cpu"):
    return make_env(
        "crawl", config, backend, hand=hand_with(*effects) if effects else None
    )


def full_env(backend="cpu"):
    """The crawl environment of a hand that has every effect, whatever its size."""
    entries = [
        entry(n) if n != "joint_coupling" else entry(n, ("finger2_joint4",), PARTNER)
        for n in IN_HAND
    ]
    return env_with(*entries, backend=backend)


PARTNER = "finger2_joint3"


def candidates(env, shown):
    """Parameters of one world per entry of `shown`, by effect name; absent: identity.

    Args:
        env: a `full_env`.
        shown: for each world, parameters by effect name.
    """

    def values(kind, world):
        return kind.identity() | shown[world].get(kind.name, {})

    def stacked(kind, like):
        rows = [values(kind, w) for w in range(len(shown))]
        return {
            k: jnp.stack([jnp.full(v.shape, row[k], jnp.float32) for row in rows])
            for k, v in like.items()
        }

    plant = env.plant
    base = ("transport_delay", "lowpass_cutoff", "slew_limit", "torque_limit")
    seen, chain = set(), []
    for kind, like in zip(plant.drive.kinds, plant.drive.params, strict=True):
        first = kind.name in base and kind.name not in seen
        seen.add(kind.name)
        same = {k: jnp.stack([v] * len(shown)) for k, v in like.items()}
        chain.append(same if first else stacked(kind, like))
    scene = {n: stacked(CATALOGUE[n], like) for n, like in plant.effects.params.items()}
    return tuple(chain), scene


def run(env, params, targets):
    """Steps the plant of every candidate from the stance.

    Args:
        env: a `full_env`.
        params: from `candidates`.
        targets: offsets to the stance's targets per control step [rad], [T, 20].

    Returns:
        Physics states, readings of the joints and of the IMU, sensors: [worlds, T, …].
    """
    world = env.reset(jax.random.key(0)).memory.world
    low, high = env.plant.joint_range.T
    targets = jnp.asarray(targets, jnp.float32) + jnp.array(env.stance.target_rad)
    targets = jnp.clip(targets, low, high)

    def one(params):
        chain, scene = params
        plant = dataclasses.replace(
            env.plant,
            drive=dataclasses.replace(env.plant.drive, params=chain),
            effects=dataclasses.replace(env.plant.effects, params=scene),
        )
        fields = model_fields(plant.mj_model, plant.spec, world.variation)
        fields = plant.effects.change(fields)
        start = plant.rest.state

        def step(carry, target):
            drive, data = carry
            drive, output, invalid = plant.step(fields, data, drive, target)
            imu = plant.effects.sense(imu_of(output.state, plant.effects.down_w))
            read = plant.drive.reading(drive, output.state.qpos[7:])
            return (drive, output.state), (output, read, imu, drive.effort, invalid)

        first = (plant.drive.begin(targets[0], start.qpos[7:]), start)
        return jax.lax.scan(step, first, targets)[1]

    return jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(params))
