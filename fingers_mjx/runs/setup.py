"""What a run is made of: settings of learner and task, and the hand.

They come from the command line or from a run directory, and go on to the environment;
JAX loads only where one is made.
"""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from envs import registry
from envs.config.strict_yaml import MAX_YAML_BYTES
from envs.hand.hand_file import DEFAULT_HAND_FILE, HandFile, load_hand_file
from fingers_deploy.files import read_regular
from fingers_mjx.ppo.config import TrainConfig
from fingers_mjx.runs.directory import CONFIG_FILE, HAND_FILE
from fingers_mjx.runs.settings import ENV_PREFIX as ENV_PREFIX
from fingers_mjx.runs.settings import Settings, load_settings, new_settings, run_task
from fingers_mjx.runs.settings import overridden as overridden

if TYPE_CHECKING:
    from envs.batch import BatchEnv


@dataclass(frozen=True)
class Setup(Settings):
    """Everything that a run, or an evaluation of its policy, is made from.

    Attributes:
        hand: the hand.
    """

    hand: HandFile


def run_setup(run_dir: Path) -> Setup:
    """Reads the settings and the hand of a run directory.

    Raises:
        InputError: no run directory, one of another version, or an unknown task.
    """
    task = run_task(run_dir)
    return load_setup(run_dir / CONFIG_FILE, run_dir / HAND_FILE, task)


def load_setup(config_file: Path, hand_file: Path, task: str) -> Setup:
    """Reads the two files from which anything can be rebuilt.

    Args:
        config_file: `config.yaml` of a run or beside a bundle.
        hand_file: `hand.yaml` beside it.
        task: registered name; decides what the part `env` of the file may hold.

    Raises:
        InputError: unknown task, or a file that is missing, malformed or of another
            version.
    """
    return with_hand(load_settings(config_file, task), load_hand_file(hand_file))


def with_seed(setup: Setup, seed: int) -> Setup:
    """Returns the same settings for a run of another seed."""
    train = dataclasses.replace(setup.train, seed=seed)
    return dataclasses.replace(setup, train=train)


def make_env(
    setup: Setup, num_envs: int, backend: str, auto_reset: bool = True
) -> BatchEnv:
    """Makes worlds of the task with the hand and its stance.

    Raises:
        InputError: settings, a hand or a backend with which there is no environment.
    """
    return registry.make_batch(
        setup.train.task,
        num_envs,
        setup.env,
        backend,
        auto_reset,
        hand=setup.hand,
    )


def training_env(setup: Setup, members: int = 1) -> BatchEnv:
    """Makes the worlds in which one or more members of these settings are trained.

    Raises:
        InputError: settings, a hand or a backend with which there is no environment.
    """
    from envs.batch import BatchEnv

    train = setup.train
    worlds = members * train.num_envs
    env = registry.make_env(
        train.task, setup.env, train.backend, worlds, hand=setup.hand
    )
    return BatchEnv(env, worlds, spread_ends=train.spread_ends)


def config_digest(directory: Path) -> str:
    """Returns the SHA-256 of `config.yaml` followed by `hand.yaml`.

    Raises:
        InputError: one of them is missing.
    """
    digest = hashlib.sha256()
    for name in (CONFIG_FILE, HAND_FILE):
        digest.update(read_regular(directory / name, MAX_YAML_BYTES))
    return digest.hexdigest()


def new_setup(train: TrainConfig, hand_file: Path | None) -> Setup:
    """Returns the defaults of a task with a hand file, the default hand if None.

    Examples:
        The settings of `fingers train crawl --preset cpu --set num_envs=512`, with the
        default hand:

        >>> from fingers_mjx.ppo.config import preset
        >>> setup = overridden(new_setup(preset("cpu"), None), ["num_envs=512"])
        >>> setup.train.num_envs, setup.train.iterations, setup.hand.nominal.fingers[0]
        (512, 150, 'thumb')
    """
    hand = load_hand_file(hand_file or DEFAULT_HAND_FILE)
    return with_hand(new_settings(train), hand)


def with_hand(settings: Settings, hand: HandFile) -> Setup:
    """Returns what a run with these settings and this hand is made of."""
    return Setup(settings.train, settings.env, hand)
