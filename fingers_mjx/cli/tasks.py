"""`fingers tasks`: what can be trained, with which presets and rewards."""

import argparse
import inspect

from fingers_mjx.cli.arguments import options


def add(commands) -> None:
    """Adds the command."""
    parser = options.command(
        commands,
        "tasks",
        run,
        "list tasks, presets and reward tables",
        "List the tasks that can be trained, those of other installed packages too, "
        "the presets of `fingers train` and the reward tables of env.rewards.",
        computes=False,
    )
    parser.set_defaults(needs_jax=False)


def run(args: argparse.Namespace) -> int:
    """Prints the lists."""
    from envs.config.settings.rows import TABLE_NAMES
    from fingers_mjx.ppo.config import PRESETS

    del args
    presets = {name: _first_line(make) for name, make in PRESETS.items()}
    tables = {name: ", ".join(one) for name, one in TABLE_NAMES.items()}
    _print("tasks (fingers train TASK --help shows the settings)", _tasks())
    _print("presets (--preset)", presets)
    _print("reward tables (--env.rewards), of tasks with more than one", tables)
    return 0


def _tasks() -> dict[str, str]:
    """What each task asks of the hand, or why it cannot be used."""
    from envs.config.plugins import found, origin
    from envs.errors import InputError
    from envs.registry import TASKS, get_task, task_names

    said = {}
    for name in task_names():
        try:
            said[name] = get_task(name).summary
        except InputError as error:
            said[name] = f"cannot be used: {error}"
    for name, points in found(TASKS).items():
        said[name] += f" ({', '.join(map(origin, points))})"
    return said


def _first_line(function) -> str:
    """Returns the summary of a function, without its first word, "Returns"."""
    line = (inspect.getdoc(function) or "").splitlines()[0]
    return line.removeprefix("Returns ").rstrip(".")


def _print(title: str, lines: dict[str, str]) -> None:
    print(f"{title}:")
    width = max(map(len, lines))
    for name, text in lines.items():
        print(f"  {name:{width}}  {text}")
