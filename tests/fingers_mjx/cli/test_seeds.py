"""`fingers train --seeds`: which learners it trains, where, and what it refuses."""

import json

import pytest

from fingers_mjx.cli.main import main
from fingers_mjx.training import train as module
from fingers_mjx.training.errors import Diverged
from fingers_mjx.training.train import Result

SMALL = ("--set", "num_envs=4", "iterations=1", "ppo.minibatches=2")


@pytest.fixture
def trained(monkeypatch):
    """What the command would train, instead of training it."""
    found = {}

    def fake(env, members, **_):
        found.update(worlds=env.num_envs, members=members)
        lost = Diverged("kl", 1, 4, members[-1].run_dir / "dump.npz", None)
        return [
            Result(m.run_dir, None, 1, {}, lost if len(members) == i == 3 else None)
            for i, m in enumerate(members, 1)
        ]

    monkeypatch.setattr(module, "train_population", fake)
    return found


def test_seeds_follow_each_other_in_directories_of_their_own(trained, tmp_path):
    path = tmp_path / "pop"
    words = ("train", "crawl", "--preset", "cpu", "--seed", "5", "--seeds", "2")
    assert main([*words, "--out", str(path), *SMALL]) == 0
    assert trained["worlds"] == 8
    seeds = [m.setup.train.seed for m in trained["members"]]
    places = [str(m.run_dir.relative_to(path)) for m in trained["members"]]
    assert (seeds, places) == ([5, 6], ["members/00", "members/01"])


def test_a_member_that_diverged_is_named_and_gives_status_3(trained, tmp_path, capsys):
    words = ("train", "crawl", "--preset", "cpu", "--seeds", "3")
    assert main([*words, "--out", str(tmp_path / "pop"), *SMALL]) == 3
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert last["text"].startswith("done after 1 iterations; diverged: 02; next:")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("crawl", "--seeds", "0"), "--seeds"),
        (("--resume", "runs/x", "--seeds", "2"), "--seeds: found 2; valid: only with"),
    ],
)
def test_what_does_not_fit_is_refused(words, sentence, capsys):
    assert main(["train", *words]) == 2
    assert sentence in capsys.readouterr().err
