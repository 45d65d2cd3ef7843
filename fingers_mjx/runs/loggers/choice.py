"""The loggers by name, as the setting `loggers` chooses them."""

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from fingers_mjx.runs.loggers.base import About, Kept, Logger, Open
from fingers_mjx.runs.loggers.rerun_file import RerunFile
from fingers_mjx.runs.loggers.tensorboard import TensorBoard
from fingers_mjx.runs.loggers.wandb_run import WandbRun

OPTIONAL: Mapping[str, Callable[[About, Kept], Logger]] = {
    "wandb": WandbRun,
    "rerun": RerunFile,
}
"""By name, which is also that of the package and of the extra that brings it."""


def check_installed(names: Sequence[str]) -> None:
    """Looks for what the chosen loggers need, without importing it.

    Raises:
        ModuleNotFoundError: naming the package that is missing.
    """
    for name in names:
        found = importlib.util.find_spec(name)
        # A folder of that name, such as the one in which wandb keeps runs, is none.
        if found is None or found.origin is None:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def chosen(names: Sequence[str], about: About) -> list[Open]:
    """Returns what opens TensorBoard's events and the chosen loggers of a run."""
    return [TensorBoard, *(partial(OPTIONAL[name], about) for name in names)]
