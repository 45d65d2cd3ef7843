"""What an evaluation changes of the training, and which episode it shows."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.cli_setup import make_setup

from envs.errors import InputError
from fingers_mjx.evaluation import source as module
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.record import Trace
from fingers_mjx.evaluation.source import evaluate_source, typical_episode
from fingers_mjx.policy.place import check_policy_settings
from fingers_mjx.policy.source import PolicySource

NETWORK = SimpleNamespace(mean=np.zeros(1), std=np.ones(1), layers=())


def table(duration, speed):
    columns = {"duration_s": duration, "task_speed_mps": speed}
    return SimpleNamespace(columns={k: np.array(v) for k, v in columns.items()})


@pytest.mark.parametrize(
    ("duration", "speed", "shown"),
    [
        ([20, 20, 20], [0.3, 0.1, 0.2], 2),
        ([20, 3, 20, 20], [0.3, 0.2, 0.1, 0.4], 0),  # the short one does not count
        ([20, 20], [np.nan, 0.1], 1),
        ([20, 20], [np.nan, np.nan], 0),
    ],
)
def test_the_episode_shown_is_the_median_of_the_longest(duration, speed, shown):
    assert typical_episode(table(duration, speed)) == shown


def test_settings_of_the_learner_are_refused():
    check_policy_settings(["env.episode_s=3"])
    with pytest.raises(InputError, match=r"seed=1.*env\.FIELD"):
        check_policy_settings(["env.episode_s=3", "seed=1"])


@pytest.mark.parametrize(
    ("column", "setting"),
    [
        (0, r"contacts_per_world: found 48; valid: about 96"),
        (1, r"constraints_per_world: found 128; valid: about 256"),
    ],
)
def test_an_evaluation_without_all_contacts_has_no_result(monkeypatch, column, setting):
    """T9: one step of one episode is enough; what comes after its end is not."""
    shape = (4, 3)
    done = np.zeros(shape, bool)
    done[2, 1] = True
    dropped = np.zeros((*shape, 2), bool)
    fields = {f.name: np.zeros(shape) for f in dataclasses.fields(Trace)}
    fields |= {"done": done, "failed": done, "overflow": dropped, "extra": {}}
    table = EpisodeTable({}, Trace(**fields), 0.02)
    monkeypatch.setattr(module, "evaluate", lambda *args: table)
    source = PolicySource(Path("run"), make_setup(), NETWORK, 0)
    dropped[3, 1, column] = True
    assert evaluate_source(source, 3) is table
    dropped[1, 1, column] = True
    with pytest.raises(InputError, match=rf"in 1 of 3 episodes: env\.{setting}"):
        evaluate_source(source, 3)


@pytest.mark.parametrize(
    ("path", "name"),
    [("/home/me/run", "run"), ("/home/me/run/policy.onnx", "run/policy.onnx")],
)
def test_a_policy_is_named_without_the_way_to_it(path, name):
    setup = make_setup()
    assert PolicySource(Path(path), setup, None, 0).name == name
