"""Which tables there are; `tests/envs/test_contract.py` steps all of them."""

import rewards
from envs.config.settings.rows import TABLE_NAMES
from envs.registry import task_names


def test_the_papers_crawl_reward_is_the_default_and_others_follow():
    assert [*rewards.TABLES["crawl"].items()] == [
        ("footprint", rewards.CRAWL),
        ("stock", rewards.STOCK),
        ("steering", rewards.STEERING),
    ]


def test_the_names_that_are_known_without_jax_are_those_of_the_tables():
    names = {task: tuple(tables) for task, tables in rewards.TABLES.items()}
    assert names == TABLE_NAMES


def test_tables_are_those_of_tasks_that_have_a_choice():
    assert set(rewards.TABLES) <= set(task_names())
    assert all(len(tables) > 1 for tables in rewards.TABLES.values())
