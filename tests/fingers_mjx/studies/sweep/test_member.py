"""How a stage of a member begins or goes on."""

import pytest
from support.sweep_setup import sweep

from fingers_mjx.runs.directory import CONFIG_FILE
from fingers_mjx.studies.sweep.member import start_of
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
