"""How a stage of a member begins or goes on, and how its end is evaluated."""

from types import SimpleNamespace

import pytest
from support.sweep_setup import TINY, sweep

from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.directory import CONFIG_FILE, END_FILE
from fingers_mjx.studies.sweep import member
from fingers_mjx.studies.sweep.divergence import ASIDE
from fingers_mjx.studies.sweep.member import evaluate_members, start_of, train_members
from fingers_mjx.studies.sweep.plan import Key, trainings
from fingers_mjx.studies.sweep.spec import NAME
from fingers_mjx.training.start import Start


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


@pytest.mark.parametrize("backend", ["warp", "cpu"])
def test_a_stage_that_diverged_begins_again_on_warp(tmp_path, monkeypatch, backend):
    """Not what was before it; negative control: on the CPU it goes on as it was."""
    stages = [{"name": "walk"}, {"name": "adapt", "schedules": "keep"}]
    spec, key = sweep(backend=backend, stages=stages), Key("plain", 0)
    walk, adapt = trainings(spec, tmp_path, key)
    for stage, iteration in ((walk, walk.setup.train.iterations), (adapt, 1)):
        (stage.path / "checkpoints").mkdir(parents=True)
        saved(stage, iteration)
    (adapt.path / END_FILE).touch()
    begun = []

    def train(group, on_progress):
        begun.extend((one.run_dir, one.start) for one in group.values())
        return {}

    monkeypatch.setattr(member, "_train", train)
    train_members(spec, tmp_path, [key], lambda event: None)
    afresh = Start(warm_start=walk.path, keep_schedules=True)
    [(path, start)] = begun
    assert path == adapt.path
    assert start == (afresh if backend == "warp" else Start(resume=True))
    aside = adapt.path.with_name("adapt" + ASIDE)
    assert (aside / END_FILE).exists() == (backend == "warp")
    assert adapt.path.exists() == (backend == "cpu")
    assert not NAME.fullmatch(aside.name)  # no stage is called that


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
