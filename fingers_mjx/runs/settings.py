"""Settings of learner and task: where they come from, and how they are changed.

They are known before JAX is loaded, so that a command can refuse them at once.
"""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from envs.config.strict_yaml import MAX_YAML_BYTES
from envs.config.typed import dump_yaml, load_yaml, override
from envs.errors import InputError
from envs.registry import get_task
from fingers_deploy.files import read_regular
from fingers_mjx.ppo.config import TrainConfig, check_config, free_fields
from fingers_mjx.runs.directory import CONFIG_FILE, RUN_FILE, saved_bound

ENV_PREFIX = "env."


@dataclass(frozen=True)
class Settings:
    """Settings of a run, as they stand in its `config.yaml`.

    Attributes:
        train: settings of the run and the learner.
        env: settings of the task, an instance of the task's configuration class.
    """

    train: TrainConfig
    env: Any


S = TypeVar("S", bound=Settings)


def new_settings(train: TrainConfig) -> Settings:
    """Returns settings of a run with the defaults of its task.

    Raises:
        InputError: there is no such task.
    """
    return Settings(train, get_task(train.task).config())


def load_settings(config_file: Path, task: str) -> Settings:
    """Reads a `config.yaml`.

    Args:
        config_file: of a run or beside a bundle.
        task: registered name; decides what the part `env` of the file may hold.

    Raises:
        InputError: unknown task, or a file that is missing, malformed or of another
            version.
    """
    config: Any = load_yaml(_config_class(task), config_file)
    _check_whole(config_file)
    if config.train.task != task:
        raise InputError(config_file, "train.task", config.train.task, task)
    check_config(config.train, config_file)
    return Settings(config.train, config.env)


def _check_whole(config_file: Path) -> None:
    """Refuses half a file: what is left may be YAML, and the rest has defaults."""
    content = read_regular(config_file, MAX_YAML_BYTES)
    if not content.endswith(b"\n"):
        found = f"no end of line after {content.splitlines()[-1].decode()!r}"
        raise InputError(config_file, "", found, "a whole file; this one is cut off")


def run_settings(run_dir: Path) -> Settings:
    """Reads the settings of a run directory.

    Raises:
        InputError: no run directory, one of another version, or an unknown task.
    """
    return load_settings(run_dir / CONFIG_FILE, run_task(run_dir))


def run_task(run_dir: Path) -> str:
    """Returns the task that a run trains.

    Raises:
        InputError: no run directory, or one of another version.
    """
    train = saved_bound(run_dir).get("train")
    task = train.get("task") if isinstance(train, dict) else None
    if not isinstance(task, str):
        raise InputError(run_dir / RUN_FILE, "bound.train.task", task, "a task")
    return task


def free_settings(settings: Settings) -> set[str]:
    """Returns, by dotted name, the settings that a resumed run may change."""
    of_task = {f"{ENV_PREFIX}{name}" for name in free_fields(settings.env)}
    return free_fields(settings.train) | of_task


def settings_yaml(settings: Settings) -> str:
    """Returns the text of a `config.yaml`, which `load_settings` reads back."""
    return dump_yaml({"train": settings.train, "env": settings.env})


def overridden(settings: S, assignments: Iterable[str]) -> S:
    """Returns `settings` with the values of `--set` put in.

    Args:
        settings: what is changed.
        assignments: "field=value", where a field of the task starts with "env.".

    Raises:
        InputError: naming the field, the value and what would be valid.
    """
    given = list(assignments)
    task = [text for text in given if text.startswith(ENV_PREFIX)]
    rest = [text for text in given if not text.startswith(ENV_PREFIX)]
    train = _override_train(settings.train, rest)
    return dataclasses.replace(settings, train=train, env=_override_env(settings, task))


def _config_class(task: str) -> Any:
    """Returns the class of a `config.yaml` whose run trains `task`."""
    kind = type(get_task(task).config())
    fields = [("train", TrainConfig), ("env", kind)]
    return dataclasses.make_dataclass("RunConfig", fields, frozen=True)


def _override_train(train: TrainConfig, assignments: list[str]) -> TrainConfig:
    changed = override(train, assignments)
    check_config(changed, "--set" if assignments else "configuration")
    return changed


def _override_env(settings: Settings, assignments: list[str]) -> Any:
    bare = [text.removeprefix(ENV_PREFIX) for text in assignments]
    try:
        return override(settings.env, bare)
    except InputError as error:
        raise InputError(
            error.source, f"{ENV_PREFIX}{error.field}", error.found, error.valid
        ) from error
