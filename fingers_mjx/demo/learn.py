"""The learning part of the demonstration: before, the run, after, export."""

import sys
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import jax

from envs.batch import BatchEnv
from fingers_mjx.demo.explore import explore
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.export.export import ExportReport, brax_weights
from fingers_mjx.export.run import export_run
from fingers_mjx.policy.actor import Network, load_policy
from fingers_mjx.policy.interface import identity
from fingers_mjx.ppo.config import TrainConfig, preset
from fingers_mjx.ppo.state import init_train_state, make_learner
from fingers_mjx.runs.setup import Setup, make_env, new_setup, training_env
from fingers_mjx.training.counting import counting, timed
from fingers_mjx.training.progress import reporter
from fingers_mjx.training.train import train

SEED = 1
"""Of the worlds in which both policies are measured; training has seed 0."""


@dataclass(frozen=True)
class LearnSize:
    """How much is learned.

    Attributes:
        train: settings of the run; by default minutes on two cores.
        episodes, steps: of the evaluations before and after.
    """

    train: TrainConfig = field(default_factory=partial(preset, "cpu"))
    episodes: int = 64
    steps: int = 500


@dataclass(frozen=True)
class Learned:
    """What learning has changed.

    Attributes:
        run_dir: of the run.
        before, after: the same randomized worlds under the untrained policy and the
            one of the last checkpoint, both with their exploration noise.
        trained_s: time of training, with compilation [s].
        export: how far the exported policy is from JAX.
    """

    run_dir: Path
    before: EpisodeTable
    after: EpisodeTable
    trained_s: float
    export: ExportReport


def learn(out: Path, size: LearnSize) -> Learned:
    """Trains a policy, measures what it has learned and exports it.

    Args:
        out: directory in which a new run directory is made.
        size: how much of everything.
    """
    setup = new_setup(size.train, None)
    env = training_env(setup)
    run_dir = out / time.strftime("run-%Y%m%d-%H%M%S")
    start_s = time.monotonic()
    with timed("4/5 learning on this machine, from nothing"):
        _train(run_dir, setup, env)
    trained_s = time.monotonic() - start_s
    with timed("5/5 what it has learned, and its export"):
        trained = load_policy(run_dir)
        first, noise = untrained(setup, env), setup.train.ppo.init_noise_std
        before = _measure(setup, first, noise, size)
        after = _measure(setup, trained, trained.noise_std, size)
        report = export_run(run_dir, run_dir)
    return Learned(run_dir, before, after, trained_s, report)


def untrained(setup: Setup, env: BatchEnv) -> Network:
    """Returns the policy that a run starts from, up to its random numbers."""
    learner = make_learner(env, setup.train.ppo)
    state = init_train_state(learner, env, jax.random.key(setup.train.seed))
    clip = setup.env.action_clip
    return brax_weights(state.params.policy, state.normalizer, clip)


def _train(run_dir: Path, setup: Setup, env: BatchEnv) -> None:
    with reporter(sys.stdout) as show:
        train(env, setup, run_dir, identity=identity(env), on_progress=show)


def _measure(
    setup: Setup, network: Network, noise_std: Any, size: LearnSize
) -> EpisodeTable:
    env = make_env(setup, size.episodes, "cpu", auto_reset=False)
    with counting(sys.stdout, "evaluating", "steps") as count:
        return explore(env, network, noise_std, size.steps, SEED, count)
