"""Runs that are killed, hang or are asked to stop go on as if nothing had happened.

T1 (SIGKILL at random times), T3 (resumed = straight, for many seeds), T7 (SIGINT and
SIGTERM), T11 (a run that hangs).
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support import train_setup
from support.train_setup import assert_same_end, curve, leaves, run

from fingers_mjx.runs import checkpoint
from fingers_mjx.training.errors import Interrupted

SUPPORT = Path(train_setup.__file__).parents[1]


def start(path, *words):
    settings = {"JAX_PLATFORMS": "cpu", "TF_CPP_MIN_LOG_LEVEL": "3"}
    environment = (
        os.environ
        | settings
        | {"PYTHONPATH": f"{train_setup.ROOT}{os.pathsep}{SUPPORT}"}
    )
    command = [sys.executable, "-m", "support.train_setup", str(path), *words]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
    )


def read_until(process, event):
    """Reads the events of a child until the first of a kind."""
    for line in process.stdout:
        if line.startswith(b"{") and json.loads(line)["event"] == event:
            return json.loads(line)
    raise AssertionError(process.stderr.read().decode()[-2000:])


def test_killed_run_goes_on_bit_equal(tmp_path):
    """SIGKILL at random times; the last checkpoint that was reported is not lost."""
    seed = random.randrange(10**6)
    print(f"seed {seed}")
    kill_and_compare(tmp_path, random.Random(seed), kills=2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_killed_run_goes_on_bit_equal_many_times(tmp_path, seed):
    kill_and_compare(tmp_path, random.Random(seed), kills=10)


def reported_checkpoints(output):
    """Returns the iterations of the saves reported in whole lines of `output`."""
    lines = [x for x in output.split(b"\n")[:-1] if x.startswith(b"{")]
    events = [json.loads(line) for line in lines]
    return [e["iteration"] for e in events if e["event"] == "checkpoint"]


def kill_and_compare(tmp_path, rng, kills):
    settings = {"iterations": 12 * kills, "checkpoint_every": 1}
    words = [f"{k}={v}" for k, v in settings.items()]
    path, reported = tmp_path / "run", 0
    for _ in range(kills):
        resume = ["--resume"] if (path / "config.yaml").exists() else []
        child = start(path, *resume, *words)
        reported = max(reported, read_until(child, "checkpoint")["iteration"])
        time.sleep(rng.uniform(0.0, 1.0))
        child.send_signal(signal.SIGKILL)
        reported = max([reported, *reported_checkpoints(child.stdout.read())])
        child.wait()
        newest = checkpoint.newest(path / "checkpoints", print)
        assert int(newest.name) >= reported
    run(path, resume=True, **settings)
    assert not list((path / "checkpoints").glob(".*"))
    run(tmp_path / "straight", iterations=12 * kills)
    assert_same_end(tmp_path / "straight", path)
    assert curve(path, "kl") == curve(tmp_path / "straight", "kl")


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_signal_saves_and_stops_with_75(tmp_path, number):
    child = start(tmp_path / "run", "iterations=100000", "checkpoint_every=100")
    read_until(child, "progress")
    child.send_signal(number)
    assert child.wait(60.0) == 75
    at, _ = leaves(tmp_path / "run")
    run(tmp_path / "run", resume=True, iterations=at + 2)
    run(tmp_path / "other", iterations=at + 2, checkpoint_every=at + 2)
    assert_same_end(tmp_path / "run", tmp_path / "other")


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seed", range(50))
def test_signal_at_any_time_saves_and_stops(tmp_path, number, seed):
    """From the start of compilation on, whatever the run is doing."""
    path = tmp_path / "run"
    child = start(path, "iterations=100000", "checkpoint_every=3")
    read_until(child, "compiling")
    time.sleep(random.Random(seed).uniform(0.0, 6.0))
    child.send_signal(number)
    output, _ = child.communicate(timeout=60.0)
    assert child.returncode == 75
    at, _ = leaves(path)
    assert at == reported_checkpoints(output)[-1]
    run(path, resume=True, iterations=at + 1)
    assert leaves(path)[0] == at + 1


def test_second_signal_ends_at_once_and_loses_nothing_saved(tmp_path):
    path = tmp_path / "run"
    child = start(path, "iterations=100000", "checkpoint_every=2", "sleep_at=5")
    reported = read_until(child, "checkpoint")["iteration"]
    read_until(child, "note")  # asleep between two iterations
    child.send_signal(signal.SIGINT)
    read_until(child, "note")
    child.send_signal(signal.SIGINT)
    assert child.wait(60.0) == 128 + signal.SIGINT
    assert leaves(path)[0] >= reported
    run(path, resume=True, iterations=10)


def test_run_that_hangs_is_ended_and_goes_on(tmp_path):
    path = tmp_path / "run"
    child = start(path, "iterations=10", "sleep_at=7", "hang_limit_s=2")
    _, errors = child.communicate(timeout=120.0)
    assert child.returncode == 75
    assert b"no progress for" in errors
    assert "in report" in (path / "hang.txt").read_text(encoding="utf-8")
    assert leaves(path)[0] == 6
    run(path, resume=True, hang_limit_s=300)
    run(tmp_path / "straight")
    assert_same_end(tmp_path / "straight", path)


def test_signal_inside_is_reported_with_the_checkpoint(tmp_path):
    def interrupt(event):
        if event["event"] == "progress" and event["iteration"] == 3:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.2)

    with pytest.raises(Interrupted, match="--resume") as error:
        run(tmp_path / "run", on_progress=interrupt)
    assert error.value.iteration == 3
    assert leaves(tmp_path / "run")[0] == 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_resume_is_bit_equal_for_many_seeds(tmp_path, seed):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run(whole, iterations=20, seed=seed)
    run(parts, iterations=10, seed=seed)
    child = start(parts, "--resume", "iterations=20", f"seed={seed}")
    child.communicate(timeout=300)
    assert child.returncode == 0
    assert_same_end(whole, parts)
