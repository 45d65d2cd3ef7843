import pytest

from envs import registry
from envs.errors import InputError
from envs.registry import Task, get_task, make_batch, register, task_names
from envs.tasks.crawl import Crawl, CrawlConfig


def test_unknown_task_is_named_with_the_nearest():
    with pytest.raises(InputError, match=r"task: found crwl; .*crawl.*mean crawl\?"):
        get_task("crwl")
    with pytest.raises(InputError, match="task"):
        make_batch("", 2)


def test_a_task_from_outside_joins_and_cannot_replace_another(monkeypatch):
    monkeypatch.setattr(registry, "_TASKS", dict(registry._TASKS))
    register("creep", Task(lambda: CrawlConfig(action_scale_rad=0.01), Crawl.on))
    assert task_names()[-1] == "creep"
    env = make_batch("creep", 3, auto_reset=False)
    assert (env.num_envs, env.config.action_scale_rad) == (3, 0.01)
    with pytest.raises(ValueError, match="'creep' is registered already"):
        register("creep", Task(CrawlConfig, Crawl.on))


def test_configurations_are_fresh():
    one, other = get_task("crawl").config(), get_task("crawl").config()
    assert one == other and one.weights is not other.weights


def test_unknown_backend_is_named():
    with pytest.raises(InputError, match=r"backend: found cuda; valid: one of cpu"):
        make_batch("crawl", 2, backend="cuda")
