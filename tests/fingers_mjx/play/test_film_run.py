"""The film of a run's policy, and the page that shows it."""

import shutil

import pytest
from PIL import Image
from support.cli_setup import make_run, make_setup

from fingers_mjx.play import film_run as module
from fingers_mjx.play.film_run import film_run
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.videos import policies_folder
from fingers_mjx.training.run_page import write_run_page


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = make_run(tmp_path_factory.mktemp("film") / "run", make_setup())
    saved = checkpoint.checkpoints(path / "checkpoints")[-1]
    shutil.copytree(saved, policies_folder(path) / saved.name)
    return path


def test_the_policy_is_filmed_and_shown(run, monkeypatch):
    monkeypatch.setattr(module, "SECONDS", 0.3)
    monkeypatch.setattr(module, "WIDTH", 64)
    path = film_run(run, 1)
    with Image.open(path) as film:
        assert film.size == (64, 36)
        assert film.n_frames >= 2
    page = write_run_page(run).read_text()
    assert "data:image/gif" in page
    assert "iteration 1" in page
    assert "No row of metrics yet." in page
