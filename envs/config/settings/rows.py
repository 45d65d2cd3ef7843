"""Reward rows that settings name: checked against the tables, which need JAX."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from envs.errors import InputError, one_of

if TYPE_CHECKING:
    from envs.config.settings.hand import HandSettings
    from rewards import RewardTable

TABLE_NAMES: Mapping[str, tuple[str, ...]] = {
    "crawl": ("footprint", "stock", "steering"),
}
"""Names of `rewards.TABLES`, for lists that are not to wait for JAX."""


def table_of(task: str, name: str) -> RewardTable:
    """Returns the reward table of a task that has this name.

    Args:
        task: a task of `rewards.TABLES`.
        name: of the table.

    Raises:
        InputError: the task has no table of that name.
    """
    from rewards import TABLES

    tables = TABLES[task]
    if name not in tables:
        raise InputError("configuration", "rewards", name, one_of(tables, name))
    return tables[name]


def check_weights(settings: HandSettings, table: Callable[[], RewardTable]) -> None:
    """Checks the rows that the settings of a task name.

    Args:
        settings: of the task.
        table: returns its reward table; called only where there is a name to look up,
            so that the defaults need neither kernels nor JAX.

    Raises:
        InputError: there is no row of that name.
    """
    if settings.weights or settings.schedule_scale:
        check_rows(table(), settings.weights, settings.schedule_scale)


def check_rows(
    table: RewardTable,
    values: Mapping[str, float],
    schedule_scale: Mapping[str, float],
) -> None:
    """Checks that weights and factors are those of rows.

    Raises:
        InputError: there is no row of that name.
    """
    rows = [row.name for row in table]
    given = {"weights": values, "schedule_scale": schedule_scale}
    for field, names in given.items():
        for name in names:
            if name not in rows:
                valid = one_of(rows, name)
                raise InputError("configuration", f"{field}.{name}", name, valid)
