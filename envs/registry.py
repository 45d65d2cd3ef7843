"""Tasks by name: what the command line and the contract tests iterate over.

Names and settings are known without JAX and MuJoCo; a task is imported when it is made.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from envs.config import plugins
from envs.config.settings.crawl import CrawlConfig
from envs.config.settings.keyboard import KeyboardConfig
from envs.config.settings.push import PushConfig
from envs.config.settings.recovery import RecoveryConfig
from envs.errors import InputError, one_of

if TYPE_CHECKING:
    from envs.batch import BatchEnv
    from envs.env import HandEnv
    from envs.hand.hand_file import HandFile
    from envs.hand.stance import Stance
    from envs.task import HandTask


def deferred(name: str) -> Callable[..., Any]:
    """Returns a function that is imported when it is called.

    Args:
        name: module and function, as `"envs.tasks.crawl:Crawl.on"`.
    """

    def call(*args: Any) -> Any:
        return pkgutil.resolve_name(name)(*args)

    return call


_STANCE = deferred("envs.hand.stance:stance_of")


@dataclass(frozen=True)
class Task:
    """A registered task.

    Attributes:
        config: makes a fresh configuration with the task's defaults.
        make: makes the task from a configuration, a hand and its stance, such as
            `HandTask.on`; `deferred`, if the command line is to know the settings
            without importing the task.
        stance: settled stance of a hand, in which it does the task.
        summary: what the hand is to do, in a few words.
    """

    config: Callable[[], Any]
    make: Callable[[Any, HandFile, Stance], HandTask]
    stance: Callable[[HandFile], Stance] = _STANCE
    summary: str = ""


TASKS = "fingers.tasks"
"""Entry points by which other installed packages bring tasks."""

_TASKS: dict[str, Task] = {}


def register(name: str, task: Task) -> None:
    """Adds a task, also from outside this package.

    An installed package needs no call: an entry point of the group `fingers.tasks`
    that names a `Task` makes it known to every command.

    Raises:
        ValueError: the name is taken.
    """
    if name in _TASKS:
        raise ValueError(f"task {name!r} is registered already")
    _TASKS[name] = task


def task_names() -> tuple[str, ...]:
    """Names of all tasks: the registered, then those of other installed packages."""
    brought = (name for name in plugins.found(TASKS) if name not in _TASKS)
    return (*_TASKS, *brought)


def get_task(name: str) -> Task:
    """Returns a task; a registered one goes before one of another package.

    Raises:
        InputError: there is no task of that name, or the package that brings it is
            broken.

    Examples:
        >>> task_names()[:4]
        ('crawl', 'recovery', 'push', 'keyboard')
        >>> get_task("push").summary
        'walk to a cube and push it to a target'
        >>> get_task("push").config().episode_s
        20.0
        >>> get_task("pusch")
        Traceback (most recent call last):
        fingers_deploy.errors.InputError: task: found pusch; valid: one of crawl,
        recovery, push, keyboard (did you mean push?)
    """
    if name in _TASKS:
        return _TASKS[name]
    if name not in plugins.found(TASKS):
        raise InputError("task", "", name, one_of(task_names(), name))
    return plugins.load(TASKS, name, Task)


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
    from envs.env import HandEnv
    from envs.hand.hand_file import load_hand_file

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
    from envs.batch import BatchEnv

    return BatchEnv(
        make_env(name, config, backend, num_envs, hand), num_envs, auto_reset
    )


register(
    "crawl",
    Task(
        CrawlConfig,
        deferred("envs.tasks.crawl:Crawl.on"),
        summary="walk on the fingertips after commands of velocity and yaw rate",
    ),
)
register(
    "recovery",
    Task(
        RecoveryConfig,
        deferred("envs.tasks.recovery.task:Recovery.on"),
        summary="get up after a fall, into the stance of crawling",
    ),
)
register(
    "push",
    Task(
        PushConfig,
        deferred("envs.tasks.push.task:Push.on"),
        summary="walk to a cube and push it to a target",
    ),
)
register(
    "keyboard",
    Task(
        KeyboardConfig,
        deferred("envs.tasks.keyboard.task:Keyboard.on"),
        deferred("envs.tasks.keyboard.stance:keyboard_stance"),
        summary="press the arrow key that is asked for, standing on the other fingers",
    ),
)
