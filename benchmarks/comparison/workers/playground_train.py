"""Brax PPO as Playground calls it, with the settings that all are given."""

# pyright: reportMissingImports=false
import functools

from brax.training.agents.ppo import networks
from brax.training.agents.ppo import train as ppo
from mujoco_playground import wrapper

from benchmarks.comparison.workers.ppo_settings import SETTINGS


def train(env, worlds: int, seed: int, iterations: int, **more):
    """Trains and returns what `brax.training.agents.ppo.train` returns.

    Args:
        env: an environment of Playground.
        worlds: stepped side by side.
        seed: of everything.
        iterations: of PPO.
        more: arguments of Brax's function.
    """
    parts = SETTINGS["minibatches"]
    sizes = tuple(SETTINGS["layers"])
    factory = functools.partial(
        networks.make_ppo_networks,
        policy_hidden_layer_sizes=sizes,
        value_hidden_layer_sizes=sizes,
    )
    return ppo.train(
        environment=env,
        wrap_env_fn=wrapper.wrap_for_brax_training,
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
        network_factory=factory,
        seed=seed,
        run_evals=False,
        **more,
    )
