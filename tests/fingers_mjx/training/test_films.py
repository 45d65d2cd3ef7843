"""Videos while training: they appear, they change nothing, and a failure is a note."""

from pathlib import Path

import pytest
from support.train_setup import assert_same_end, run
from tensorboardX.proto.event_pb2 import Event

from envs.errors import InputError
from fingers_mjx.ppo.config import TrainConfig, check_config
from fingers_mjx.runs.videos import video_files
from fingers_mjx.training import films

TESTS = Path(__file__).parents[2]


@pytest.fixture
def drawn(monkeypatch):
    """A quick stand-in for the process that draws."""
    monkeypatch.setenv("PYTHONPATH", str(TESTS))
    monkeypatch.setattr(films, "DRAWER", "support.fake_drawer")


def events(path):
    """Videos in the event file, whose records are length, crc, data, crc."""
    content = (path / "events.out.tfevents.0").read_bytes()
    found = []
    while content:
        size = int.from_bytes(content[:8], "little")
        event = Event.FromString(content[12 : 12 + size])
        content = content[16 + size :]
        images = [v.image for v in event.summary.value if v.tag == "policy"]
        found += [(event.step, image.width, image.height) for image in images]
    return found


def test_videos_appear_and_change_nothing(tmp_path, drawn):
    run(tmp_path / "plain", iterations=6)
    run(tmp_path / "filmed", iterations=6, video_every=6)
    assert_same_end(tmp_path / "plain", tmp_path / "filmed")
    assert list(video_files(tmp_path / "filmed")) == [6]
    assert events(tmp_path / "filmed") == [(6, 6, 4)]
    assert events(tmp_path / "plain") == []


def test_a_resumed_run_keeps_its_videos(tmp_path, drawn):
    run(tmp_path / "run", iterations=4, video_every=4)
    run(tmp_path / "run", resume=True, iterations=8, video_every=8)
    assert [at for at, *_ in events(tmp_path / "run")] == [4, 8]


def test_a_video_that_fails_is_a_note_and_the_run_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(films, "DRAWER", "support.there_is_no_such_module")
    said = []
    run(tmp_path / "run", on_progress=said.append, iterations=4, video_every=2)
    notes = [event["text"] for event in said if event["event"] == "note"]
    assert any("no video of iteration" in text for text in notes), notes
    assert video_files(tmp_path / "run") == {}


def test_what_draws_is_looked_for_before_training(tmp_path, monkeypatch):
    monkeypatch.setattr(films, "NEEDED", ("there_is_no_such_module",))
    with pytest.raises(ModuleNotFoundError, match="there_is_no_such_module"):
        run(tmp_path / "run", video_every=2)
    assert not (tmp_path / "run").exists()


def test_videos_come_after_whole_calls():
    with pytest.raises(InputError, match="video_every"):
        check_config(
            TrainConfig(
                iterations_per_call=4,
                iterations=8,
                log_every=4,
                checkpoint_every=4,
                video_every=6,
            )
        )
