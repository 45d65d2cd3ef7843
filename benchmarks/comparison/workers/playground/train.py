"""Brax PPO as Playground calls it, with the settings that all are given."""

# pyright: reportMissingImports=false
import functools

import jax
import numpy as np
from brax.training.agents.ppo import networks
from brax.training.agents.ppo import train as ppo
from mujoco_playground import wrapper

from benchmarks.comparison.workers.ppo_settings import SETTINGS


def replicated(tree, devices):
    """Puts a copy of each leaf on each device, as JAX's own function did.

    Source:
        The replacement in "Migrating to the new jax.pmap" of JAX's documentation;
        JAX 0.11 has the function no more, and Brax 0.14.2 calls it.
    """
    mesh = jax.sharding.Mesh(np.array(devices), ("copies",))
    spec = jax.sharding.PartitionSpec("copies")
    sharding = jax.sharding.NamedSharding(mesh, spec)
    copies = len(devices)
    return jax.tree.map(
        lambda x: jax.device_put(np.stack([np.asarray(x)] * copies), sharding), tree
    )


if not hasattr(jax, "device_put_replicated"):
    jax.device_put_replicated = replicated


def train(env, worlds: int, seed: int, iterations: int, **more):
    """Trains and returns what `brax.training.agents.ppo.train` returns.

    Args:
        env: an environment of Playground.
        worlds: stepped side by side.
        seed: of everything.
        iterations: of PPO.
        more: arguments of Brax's function, in place of those here too.
    """
    parts = SETTINGS["minibatches"]
    own = {
        "wrap_env_fn": wrapper.wrap_for_brax_training,
        "network_factory": networks_of(SETTINGS["layers"]),
    }
    return ppo.train(
        environment=env,
        num_timesteps=iterations * worlds * SETTINGS["unroll"],
        num_envs=worlds,
        unroll_length=SETTINGS["unroll"],
        num_minibatches=parts,
        batch_size=worlds // parts,
        num_updates_per_batch=SETTINGS["epochs"],
        episode_length=1000,
        normalize_observations=True,
        learning_rate=3e-4,
        entropy_cost=1e-2,
        discounting=0.97,
        max_grad_norm=1.0,
        seed=seed,
        run_evals=False,
        **(own | more),
    )


def networks_of(layers):
    """Returns what makes Brax's networks, both of these hidden sizes."""
    return functools.partial(
        networks.make_ppo_networks,
        policy_hidden_layer_sizes=tuple(layers),
        value_hidden_layer_sizes=tuple(layers),
    )
