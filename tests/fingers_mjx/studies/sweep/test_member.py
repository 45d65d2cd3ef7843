"""How a stage of a member begins or goes on, and how its end is evaluated."""

from types import SimpleNamespace

import pytest
from support.sweep_setup import TINY, sweep

from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.directory import CONFIG_FILE
from fingers_mjx.studies.sweep import member
from fingers_mjx.studies.sweep.member import evaluate_members, start_of
from fingers_mjx.studies.sweep.plan import Key, trainings


@pytest.fixture
def stage(tmp_path):
    """A stage whose directory exists."""
    [one] = trainings(sweep(), tmp_path, Key("plain", 0))
    (one.path / "checkpoints").mkdir(parents=True)
    return one


def saved(stage, iteration, recorded=True):
    """Leaves a checkpoint, and the settings, which a run writes later."""
    (stage.path / "checkpoints" / f"{iteration:08d}").mkdir()
    if recorded:
        (stage.path / CONFIG_FILE).touch()


def test_a_stage_with_a_checkpoint_goes_on(stage):
    saved(stage, 1)
    assert start_of(stage, None).resume


def test_a_finished_stage_is_left_alone(stage):
    saved(stage, stage.setup.train.iterations)
    assert start_of(stage, None) is None


def test_killed_before_its_settings_were_written_it_begins_again(stage, tmp_path):
    """A warm start is saved before the run is recorded: nothing can resume that."""
    saved(stage, 0, recorded=False)
    start = start_of(stage, tmp_path / "before")
    assert not start.resume and start.warm_start == tmp_path / "before"
    assert not stage.path.exists()


def test_an_evaluation_has_the_room_that_the_sweep_has_now(tmp_path, monkeypatch):
    """The run may have been trained with less; all else stays as it was trained."""
    key = Key("plain", 0)
    trained = sweep(set=TINY | {"env.contacts_per_world": 48, "env.action_clip": 2.0})
    now = sweep(set=TINY | {"env.contacts_per_world": 96, "env.action_clip": 3.0})
    [one] = trainings(trained, tmp_path, key)
    loaded = PolicySource(tmp_path, one.setup, SimpleNamespace(), 0)

    class Evaluated(Exception):
        pass

    def tables(sources, *rest):
        raise Evaluated(*[source.setup.env for source in sources])

    monkeypatch.setattr(member, "load_source", lambda run: loaded)
    monkeypatch.setattr(member, "_tables", tables)
    with pytest.raises(Evaluated) as evaluated:
        evaluate_members(now, tmp_path, [key])
    [env] = evaluated.value.args
    assert (env.contacts_per_world, env.action_clip) == (96, 2.0)
