"""Recordings of Rerun: every row once, whatever was there before; films too."""

import pytest
from support.logger_files import rerun_chunks, rerun_values

from fingers_mjx.runs.loggers.base import About, Kept
from fingers_mjx.runs.loggers.rerun_file import RERUN_FILE, RerunFile

pytest.importorskip("rerun", reason="the extra rerun is not installed")

ABOUT = About("00", "walk", {})


def row(iteration, **numbers):
    return {"iteration": iteration, "time_s": 1e9 + iteration, **numbers}


def film(path, frames):
    from PIL import Image

    pictures = [Image.new("RGB", (6, 4), (40 * k, 0, 0)) for k in range(frames)]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=50)
    return path


def test_the_file_has_the_rows_kept_and_those_after(tmp_path):
    for kept in ([], [row(1, kl=0.25)]):  # opened a second time, it is written anew
        recording = RerunFile(ABOUT, Kept(tmp_path, kept, {}))
        recording.append(row(len(kept) + 1, kl=0.25, note="text"))
        recording.close()
    chunks = rerun_chunks(tmp_path / RERUN_FILE, tmp_path)
    assert rerun_values(chunks["/kl"]) == {1: 0.25, 2: 0.25}
    assert "/note" not in chunks
    assert "walk/00" in chunks["/__properties"]


def test_frames_of_a_film_are_pictures_along_a_time_of_their_own(tmp_path):
    recording = RerunFile(ABOUT, Kept(tmp_path, [], {}))
    recording.append_video(100, film(tmp_path / "film.gif", 3))
    recording.append(row(101, kl=0.5))
    recording.close()
    chunks = rerun_chunks(tmp_path / RERUN_FILE, tmp_path)
    frames = chunks["/policy/00000100"]
    assert "image/jpeg" in frames
    assert all(time in frames for time in ("P0D", "PT0.05S", "PT0.1S"))
    assert "film" not in chunks["/kl"]
