"""What a run is made of: settings of learner and task, and the hand.

They come from the command line or from a run directory, and go on to the environment.
"""

import dataclasses
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.batch import BatchEnv
from envs.config.strict_yaml import MAX_YAML_BYTES
from envs.config.typed import load_yaml, override
from envs.errors import InputError
from envs.hand.hand_file import DEFAULT_HAND_FILE, HandFile, load_hand_file
from envs.registry import get_task, make_batch
from fingers_deploy.files import read_regular
from fingers_mjx.ppo.config import TrainConfig, check_config
from fingers_mjx.runs.directory import CONFIG_FILE, HAND_FILE, RUN_FILE, saved_bound

ENV_PREFIX = "env."


@dataclass(frozen=True)
class Setup:
    """Everything that a run, or an evaluation of its policy, is made from.

    Attributes:
        train: settings of the run and the learner.
        env: settings of the task, an instance of the task's configuration class.
        hand: the hand.
    """

    train: TrainConfig
    env: Any
    hand: HandFile


def run_setup(run_dir: Path) -> Setup:
    """Reads the settings and the hand of a run directory.

    Raises:
        InputError: no run directory, one of another version, or an unknown task.
    """
    train = saved_bound(run_dir).get("train")
    task = train.get("task") if isinstance(train, dict) else None
    if not isinstance(task, str):
        raise InputError(run_dir / RUN_FILE, "bound.train.task", task, "a task")
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
    config = load_yaml(_config_class(task), config_file)
    if config.train.task != task:
        raise InputError(config_file, "train.task", config.train.task, task)
    check_config(config.train, config_file)
    return Setup(config.train, config.env, load_hand_file(hand_file))


def with_seed(setup: Setup, seed: int) -> Setup:
    """Returns the same settings for a run of another seed."""
    train = dataclasses.replace(setup.train, seed=seed)
    return dataclasses.replace(setup, train=train)


def overridden(setup: Setup, assignments: Iterable[str]) -> Setup:
    """Returns `setup` with the values of `--set` put in.

    Args:
        setup: settings.
        assignments: "field=value", where a field of the task starts with "env.".

    Raises:
        InputError: naming the field, the value and what would be valid.
    """
    given = list(assignments)
    task = [text for text in given if text.startswith(ENV_PREFIX)]
    rest = [text for text in given if not text.startswith(ENV_PREFIX)]
    return dataclasses.replace(
        setup, train=_override_train(setup.train, rest), env=_override_env(setup, task)
    )


def make_env(
    setup: Setup, num_envs: int, backend: str, auto_reset: bool = True
) -> BatchEnv:
    """Makes worlds of the task with the hand and its stance.

    Raises:
        InputError: settings, a hand or a backend with which there is no environment.
    """
    return make_batch(
        setup.train.task,
        num_envs,
        setup.env,
        backend,
        auto_reset,
        hand=setup.hand,
    )


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
    """Returns the defaults of a task with a hand file, the default hand if None."""
    env = get_task(train.task).config()
    return Setup(train, env, load_hand_file(hand_file or DEFAULT_HAND_FILE))


def _config_class(task: str) -> Any:
    """Returns the class of a `config.yaml` whose run trains `task`."""
    kind = type(get_task(task).config())
    fields = [("train", TrainConfig), ("env", kind)]
    return dataclasses.make_dataclass("RunConfig", fields, frozen=True)


def _override_train(train: TrainConfig, assignments: list[str]) -> TrainConfig:
    changed = override(train, assignments)
    check_config(changed, "--set" if assignments else "configuration")
    return changed


def _override_env(setup: Setup, assignments: list[str]) -> Any:
    bare = [text.removeprefix(ENV_PREFIX) for text in assignments]
    try:
        return override(setup.env, bare)
    except InputError as error:
        raise InputError(
            error.source, f"{ENV_PREFIX}{error.field}", error.found, error.valid
        ) from error
