"""Reward tables by name: those that a task can be paid by."""

from rewards.compose import RewardTable
from rewards.tables.crawl import CRAWL, STEERING, STOCK

TABLES: dict[str, dict[str, RewardTable]] = {
    "crawl": {"footprint": CRAWL, "stock": STOCK, "steering": STEERING},
}
"""Tables by task and name; the first is the default, tasks not in it have one table.

Another table joins by being put in: `TABLES["crawl"]["mine"] = (...)`, with rows that
bind attributes of `envs.signals.Signals` and what the task adds to them.
"""
