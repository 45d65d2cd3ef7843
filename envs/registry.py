"""Tasks by name: what the command line and the contract tests iterate over."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from envs.batch import BatchEnv, Env
from envs.errors import InputError, one_of
from envs.tasks.crawl import CrawlConfig, CrawlEnv
from envs.tasks.keyboard.task import KeyboardConfig, KeyboardEnv
from envs.tasks.push.task import PushConfig, PushEnv
from envs.tasks.recovery.task import RecoveryConfig, RecoveryEnv


@dataclass(frozen=True)
class Task:
    """A registered task.

    Attributes:
        config: makes a fresh configuration with the task's defaults.
        make: makes one world from a configuration; takes `backend`, `num_worlds` and
            `hand` by keyword.
    """

    config: Callable[[], Any]
    make: Callable[..., Env]


_TASKS: dict[str, Task] = {}


def register(name: str, task: Task) -> None:
    """Adds a task, also from outside this package.

    Raises:
        ValueError: the name is taken.
    """
    if name in _TASKS:
        raise ValueError(f"task {name!r} is registered already")
    _TASKS[name] = task


def task_names() -> tuple[str, ...]:
    """Names of all registered tasks."""
    return tuple(_TASKS)


def get_task(name: str) -> Task:
    """Returns a registered task.

    Raises:
        InputError: there is no task of that name.
    """
    if name not in _TASKS:
        raise InputError("task", "", name, one_of(_TASKS, name))
    return _TASKS[name]


def make_batch(
    name: str,
    num_envs: int,
    config: Any = None,
    backend: str = "cpu",
    auto_reset: bool = True,
    **options: Any,
) -> BatchEnv:
    """Makes `num_envs` worlds of a task; options go to the task's `make`."""
    task = get_task(name)
    config = task.config() if config is None else config
    env = task.make(config, backend=backend, num_worlds=num_envs, **options)
    return BatchEnv(env, num_envs, auto_reset)


register("crawl", Task(CrawlConfig, CrawlEnv))
register("recovery", Task(RecoveryConfig, RecoveryEnv))
register("push", Task(PushConfig, PushEnv))
register("keyboard", Task(KeyboardConfig, KeyboardEnv))
