"""Tasks by name: what the command line and the contract tests iterate over."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from envs.batch import BatchEnv
from envs.env import HandEnv
from envs.errors import InputError, one_of
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.stance import Stance, stance_of
from envs.task import HandTask
from envs.tasks.crawl import Crawl, CrawlConfig
from envs.tasks.keyboard.settings import KeyboardConfig
from envs.tasks.keyboard.stance import keyboard_stance
from envs.tasks.keyboard.task import Keyboard
from envs.tasks.push.settings import PushConfig
from envs.tasks.push.task import Push
from envs.tasks.recovery.task import Recovery, RecoveryConfig


@dataclass(frozen=True)
class Task:
    """A registered task.

    Attributes:
        config: makes a fresh configuration with the task's defaults.
        make: makes the task from a configuration, a hand and its stance, such as
            `HandTask.on`.
        stance: settled stance of a hand, in which it does the task.
    """

    config: Callable[[], Any]
    make: Callable[[Any, HandFile, Stance], HandTask]
    stance: Callable[[HandFile], Stance] = stance_of


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


def make_env(
    name: str,
    config: Any = None,
    backend: str = "cpu",
    num_worlds: int = 1,
    hand: HandFile | None = None,
) -> HandEnv:
    """Makes one world of a task, for the caller to vmap.

    Args:
        name: of the task.
        config: its settings; the defaults if not given.
        backend: physics backend, see `envs.physics`.
        num_worlds: most worlds that are stepped together.
        hand: hand file; the calibrated hand of the paper if not given.
    """
    task, hand = get_task(name), hand or load_hand_file()
    config, stance = task.config() if config is None else config, task.stance(hand)
    made = task.make(config, hand, stance)
    return HandEnv(made, backend, num_worlds, hand, stance)


def make_batch(
    name: str,
    num_envs: int,
    config: Any = None,
    backend: str = "cpu",
    auto_reset: bool = True,
    hand: HandFile | None = None,
) -> BatchEnv:
    """Makes `num_envs` worlds of a task; see `make_env`."""
    return BatchEnv(
        make_env(name, config, backend, num_envs, hand), num_envs, auto_reset
    )


register("crawl", Task(CrawlConfig, Crawl.on))
register("recovery", Task(RecoveryConfig, Recovery.on))
register("push", Task(PushConfig, Push.on))
register("keyboard", Task(KeyboardConfig, Keyboard.on, keyboard_stance))
