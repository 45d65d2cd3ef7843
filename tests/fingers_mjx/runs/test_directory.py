"""Run directory: one writer, never over something else, curves without a seam."""

import fcntl
import json
import os
import struct
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from tensorboardX.proto.event_pb2 import Event

from envs.config.atomic_file import PARTIAL
from envs.config.typed import load_yaml
from envs.errors import InputError
from fingers_mjx.ppo.config import TrainConfig
from fingers_mjx.runs import directory
from fingers_mjx.runs.directory import (
    check_bound,
    is_locked,
    locked,
    open_run,
    record_run,
)
from fingers_mjx.runs.files import OutOfSpace, write_whole
from fingers_mjx.runs.metrics import MetricsLog, read_metrics


@dataclass(frozen=True)
class Env:
    speed_mps: float = 0.16


@dataclass(frozen=True)
class Run:
    train: TrainConfig
    env: Env


RUN = {"train": TrainConfig(num_envs=8), "env": Env(0.1)}
BOUND = {"train": {"num_envs": 8}, "layout": ["a", "b"]}


def make(path):
    with open_run(path, resume=False) as run:
        record_run(run, RUN, BOUND)
    return path


def row(iteration, **numbers):
    return {"iteration": iteration, "time_s": 1e9 + iteration, **numbers}


def events(path):
    data, found = (path / "events.out.tfevents.0").read_bytes(), []
    while data:
        (size,) = struct.unpack("Q", data[:8])
        found.append(Event.FromString(data[12 : 12 + size]))
        data = data[16 + size :]
    assert found[0].file_version == "brain.Event:2"
    return {e.step: {v.tag: v.simple_value for v in e.summary.value} for e in found[1:]}


def test_configuration_comes_back_typed(tmp_path):
    path = make(tmp_path / "run")
    assert load_yaml(Run, path / "config.yaml") == Run(**RUN)


def test_what_is_written_names_nobody_and_is_readable(tmp_path):
    path = make(tmp_path / "run")
    files = [p for p in path.rglob("*") if p.is_file()]
    assert {p.name for p in files} == {
        "config.yaml",
        "run.json",
        "versions.json",
        "run.lock",
    }
    assert {p.stat().st_mode & 0o777 for p in files} == {0o644}
    versions = json.loads((path / "versions.json").read_text(encoding="utf-8"))
    assert set(versions) == {"packages", "python", "platform", "machine", "commit"}
    assert versions["packages"]["jax"]


@pytest.mark.parametrize("content", ["notes.txt", "config.yaml", "metrics.jsonl"])
def test_new_run_never_goes_over_something_else(tmp_path, content):
    (tmp_path / content).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="new or empty"), open_run(tmp_path, False):
        pass
    assert [p.name for p in tmp_path.iterdir()] == [content]
    with pytest.raises(InputError, match="a file"):
        open_run(tmp_path / content, False).__enter__()


def test_new_run_may_take_over_what_died_before_it_began(tmp_path):
    with open_run(tmp_path / "run", resume=False) as run:
        (run / f"{PARTIAL}half-run.json").touch()
    path = make(tmp_path / "run")
    assert load_yaml(Run, path / "config.yaml") == Run(**RUN)


@pytest.mark.parametrize(
    ("text", "field"), [("{}", "format"), ('{"format": 99}', "format"), ("no", "")]
)
def test_only_a_run_of_this_format_is_resumed(tmp_path, text, field):
    path = make(tmp_path / "run")
    (path / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error, open_run(path, resume=True):
        pass
    assert error.value.field == field
    with pytest.raises(InputError, match="no run"), open_run(tmp_path / "x", True):
        pass
    assert not (tmp_path / "x").exists()


def test_one_writer_at_a_time(tmp_path):
    path = make(tmp_path / "run")
    second = open_run(path, resume=True)
    in_progress = pytest.raises(InputError, match="a run in progress")
    with open_run(path, resume=True), in_progress:
        second.__enter__()
    with open_run(path, resume=True):
        pass


@contextmanager
def looked_at(path, seconds):
    """Holds a lock file as `is_locked` does, but for as long as is said."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT)
    fcntl.flock(handle, fcntl.LOCK_SH)
    look = threading.Timer(seconds, os.close, [handle])
    look.start()
    yield
    look.join()


def test_a_look_at_a_lock_does_not_keep_others_from_it(tmp_path):
    path = tmp_path / "x.lock"
    with looked_at(path, 0.2), locked(path, "a lock"):
        assert is_locked(path)
    assert not is_locked(path)


def test_a_lock_that_stays_held_is_refused_soon(tmp_path, monkeypatch):
    """Negative control; the time is that of a look, many times over."""
    monkeypatch.setattr(directory, "LOCK_WAIT_S", 0.1)
    path, begun_s = tmp_path / "x.lock", time.monotonic()
    with locked(path, ""), pytest.raises(InputError, match="valid: a lock"):
        locked(path, "a lock").__enter__()
    assert time.monotonic() - begun_s < 5.0
    with looked_at(path, 0.5), pytest.raises(InputError, match="in progress"):
        locked(path, "a lock").__enter__()


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"train": {"num_envs": 16}}, "train.num_envs"),
        ({"layout": ["b", "a"]}, "layout"),
        ({"more": 1}, "more"),
    ],
)
def test_difference_is_named_with_both_values(tmp_path, change, field):
    path = make(tmp_path / "run")
    check_bound(path, BOUND)
    with pytest.raises(InputError) as error:
        check_bound(path, BOUND | change)
    assert error.value.field == field
    assert "as saved" in str(error.value)


def test_a_run_from_before_a_setting_goes_on_where_that_is_not_set(tmp_path):
    path = make(tmp_path / "run")
    newer = BOUND | {"train": {**BOUND["train"], "ppo": {"warm_up": 0}}}
    check_bound(path, newer, defaults={"train": {"ppo": {"warm_up": 0}}})
    newer["train"]["ppo"]["warm_up"] = 5
    with pytest.raises(InputError) as error:
        check_bound(path, newer, defaults={"train": {"ppo": {"warm_up": 0}}})
    assert error.value.field == "train.ppo.warm_up"


def test_curve_goes_on_from_the_restored_iteration(tmp_path):
    with MetricsLog(tmp_path, 0) as log:
        for iteration in (2, 4, 6):
            log.append(row(iteration, kl=iteration / 100))
    with MetricsLog(tmp_path, 4) as log:
        log.append(row(5, kl=0.5))
    rows = read_metrics(tmp_path / "metrics.jsonl")
    assert [(r["iteration"], r["kl"]) for r in rows] == [(2, 0.02), (4, 0.04), (5, 0.5)]
    curve = events(tmp_path)
    assert list(curve) == [2, 4, 5]
    assert curve[5] == {"kl": 0.5}


def test_line_cut_short_by_a_kill_is_dropped(tmp_path):
    with MetricsLog(tmp_path, 0) as log:
        log.append(row(1))
    with (tmp_path / "metrics.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"iteration": 2, "ti')
    with MetricsLog(tmp_path, 9) as log:
        log.append(row(3))
    kept = [r["iteration"] for r in read_metrics(tmp_path / "metrics.jsonl")]
    assert kept == [1, 3]


def test_figures_that_are_not_finite_become_null(tmp_path):
    with MetricsLog(tmp_path, 0) as log:
        log.append(row(1, kl=float("nan"), grad_norm=float("inf"), std=1.0))
    kept = read_metrics(tmp_path / "metrics.jsonl")[0]
    assert (kept["kl"], kept["grad_norm"], kept["std"]) == (None, None, 1.0)


def test_full_disk_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_whole(path, b"old")

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutOfSpace, match="needs 3 bytes"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
