"""A run directory and a bundle as the commands write them, without any training."""

import dataclasses
import os
from pathlib import Path

import jax
import numpy as np

from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
from fingers_deploy.manifest import Normalizer, Provenance
from fingers_mjx.export.bundle import encode_bundle, write_bundle
from fingers_mjx.export.onnx_graph import PolicyWeights
from fingers_mjx.policy.interface import identity, interface_of
from fingers_mjx.ppo.config import PpoConfig, TrainConfig
from fingers_mjx.ppo.state import init_train_state, make_learner
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.directory import open_run, record_run
from fingers_mjx.runs.setup import (
    Setup,
    config_digest,
    make_env,
    new_setup,
)
from fingers_mjx.training.session import bound

ROOT = Path(__file__).parents[2]
os.environ.setdefault("FINGERS_COMPILE_CACHE", str(ROOT / ".jax_cache"))

TRAIN = TrainConfig(
    preset="cpu",
    num_envs=4,
    iterations=2,
    log_every=1,
    checkpoint_every=1,
    ppo=PpoConfig(
        unroll_length=4,
        epochs=1,
        minibatches=2,
        actor_layers=(16,),
        critic_layers=(16,),
    ),
)


def make_setup(**env_changes) -> Setup:
    setup = new_setup(TRAIN, None)
    return dataclasses.replace(setup, env=dataclasses.replace(setup.env, **env_changes))


def random_weights(seed=3, clip=1.0, gain=0.3, inputs=392) -> PolicyWeights:
    """A policy that moves all joints without throwing the hand over at once."""
    rng = np.random.default_rng(seed)
    sizes = ((inputs, 16), (16, 20))
    layers = tuple(
        (gain * rng.normal(size=size) / size[0] ** 0.5, 0.1 * rng.normal(size=size[1]))
        for size in sizes
    )
    mean, std = rng.normal(0, 0.1, inputs), rng.uniform(0.5, 1.5, inputs)
    return PolicyWeights(layers, mean, std, clip)


def make_bundle(path: Path, setup: Setup, weights=None, interface=None) -> Path:
    """Writes the four files of an exported bundle."""
    path.mkdir(parents=True)
    with open_run(path / "run", resume=False) as run:
        record_run(run, {"train": setup.train, "env": setup.env}, {}, setup.hand)
        for name in ("config.yaml", "hand.yaml"):
            (run / name).rename(path / name)
        for left in sorted(run.rglob("*"), reverse=True):
            left.rmdir() if left.is_dir() else left.unlink()
        run.rmdir()
    weights = weights or random_weights(clip=setup.env.action_clip)
    size = (4, len(weights.mean))
    obs = np.random.default_rng(5).normal(size=size).astype(np.float32)
    provenance = Provenance(config_digest(path), Normalizer(1000, 1000), None, {})
    interface = interface or interface_of(make_env(setup, 1, "cpu"))
    action = forward(weights, obs)
    parity = (obs, action)
    bundle = encode_bundle(weights, setup.train.task, interface, provenance, parity)
    write_bundle(path, bundle)
    return path


def forward(weights: PolicyWeights, obs: np.ndarray) -> np.ndarray:
    """The policy in double precision."""
    x = (obs - weights.mean) / weights.std
    for kernel, bias in weights.layers[:-1]:
        x = x @ kernel + bias
        x = np.where(x > 0, x, np.expm1(np.minimum(x, 0)))
    kernel, bias = weights.layers[-1]
    return np.clip(x @ kernel + bias, -weights.action_clip, weights.action_clip)


def make_run(path: Path, setup: Setup) -> Path:
    """Writes a run directory with one checkpoint of untrained networks."""
    env = make_env(setup, setup.train.num_envs, "cpu")
    shared = bound(env, setup, identity(env))
    with open_run(path, resume=False) as run:
        record_run(run, {"train": setup.train, "env": setup.env}, shared, setup.hand)
        learner = make_learner(env, setup.train.ppo)
        train = init_train_state(learner, env, jax.random.key(0))
        meta = {"env_steps": 16, "trained_s": 1.0, "bound": shared}
        checkpoint.save(run / "checkpoints", 1, {"train": train}, meta, keep=1)
    return path


def default_hand():
    return load_hand_file(DEFAULT_HAND_FILE)


def contents(path: Path) -> dict[str, bytes]:
    """Every file under a directory, by name."""
    files = (p for p in sorted(path.rglob("*")) if p.is_file())
    return {str(p.relative_to(path)): p.read_bytes() for p in files}
