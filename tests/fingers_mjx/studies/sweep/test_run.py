"""The parent of a sweep with pretended trainings: faults, kills, stops, promotion."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from support import sweep_setup
from support.sweep_setup import (
    ENGINES,
    journal,
    plan_faults,
    pretend_warp,
    run_fake,
    run_fake_on,
    states,
    summaries,
    sweep,
)

from envs.errors import InputError
from fingers_mjx.runs.directory import locked
from fingers_mjx.studies.sweep.manifest import read_manifest
from fingers_mjx.studies.sweep.outcome import is_evaluated
from fingers_mjx.studies.sweep.promote import choosing
from fingers_mjx.studies.sweep.report import report
from fingers_mjx.studies.sweep.resolve import saved_sweep
from fingers_mjx.studies.sweep.run import SweepFull, SweepStopped, sweep_lock

FAULTS = {
    "lift/1": ["nan"],
    "plain/2": ["exception", "exception"],
    "lift/0": ["killed"],
    "plain/1": ["memory"],
    "lift/2": ["hang", "killed"],
    "plain/3": ["input"],
}
"""T13: what goes wrong with which member, attempt after attempt."""


def test_members_that_fail_are_named_and_the_others_finish(tmp_path):
    plan_faults(tmp_path / "a", FAULTS)
    manifest = run_fake(tmp_path / "a", seeds=4)
    found = {str(m.key): m for m in manifest.members}
    assert Counter(states(manifest).values()) == {"done": 4, "failed": 3, "diverged": 1}
    assert found["lift/1"].state == "diverged" and found["lift/1"].attempts == 1
    assert "same seed would diverge" in found["lift/1"].reason
    assert found["plain/2"].attempts == found["lift/2"].attempts == 2
    assert "ValueError: no such thing" in found["plain/2"].reason
    assert "SIGKILL" in found["lift/2"].reason
    assert found["plain/3"].attempts == 1
    for member in ("lift/0", "plain/1"):
        assert (found[member].state, found[member].attempts) == ("done", 2)
    assert read_manifest(tmp_path / "a") == manifest
    run_fake(tmp_path / "b", seeds=4)
    faultless, ours = summaries(tmp_path / "b"), summaries(tmp_path / "a")
    assert len(faultless) == 8
    assert ours == {k: v for k, v in faultless.items() if k in ours}


def test_the_report_says_what_is_missing(tmp_path):
    plan_faults(tmp_path, FAULTS)
    manifest = run_fake(tmp_path, seeds=4)
    lines = report(tmp_path, manifest)
    assert lines[0] == "4 of 8 members done"
    missing = [line for line in lines if line.startswith("missing: ")]
    assert len(missing) == 4
    (killed,) = [line for line in missing if "lift/2" in line]
    assert "failed; train, iteration 2; attempts: 2" in killed
    assert "  | amid iteration 3" in lines
    assert f"  log: {tmp_path}/runs/lift/2/log.txt" in lines
    assert lines[-1] == f"next: fingers compare {tmp_path} --baseline plain"


def test_the_same_command_trains_what_is_missing_and_nothing_else(tmp_path):
    plan_faults(tmp_path, FAULTS)
    run_fake(tmp_path, seeds=4)
    before = Counter(journal(tmp_path))
    plan_faults(tmp_path, {})
    manifest = run_fake(tmp_path, seeds=4)
    again = Counter(journal(tmp_path)) - before
    assert {member for _, member in again} == {"plain/2", "lift/2", "plain/3"}
    assert Counter(states(manifest).values()) == {"done": 7, "diverged": 1}
    done = Counter(journal(tmp_path))
    run_fake(tmp_path, seeds=4)
    assert Counter(journal(tmp_path)) == done


@pytest.mark.parametrize(
    ("backend", "wrong", "state", "attempts"),
    [
        ("warp", ["nan"], "done", 2),
        ("warp", ["nan", "nan"], "diverged", 2),
        ("warp", ["killed", "nan"], "done", 3),
        ("warp", ["nan", "killed"], "done", 3),
        ("warp", ["nan", "killed", "nan"], "diverged", 3),
        ("jax", ["nan"], "done", 2),
        ("cpu", ["nan"], "diverged", 1),
    ],
)
def test_a_member_that_diverged_on_warp_is_tried_once_more(
    tmp_path, monkeypatch, backend, wrong, state, attempts
):
    """Negative control: on the CPU it would diverge again."""
    pretend_warp(monkeypatch)
    plan_faults(tmp_path, {"lift/0": wrong})
    for _ in range(2):  # the same command changes nothing
        manifest = run_fake(tmp_path, backend=backend)
        [member] = [m for m in manifest.members if str(m.key) == "lift/0"]
        assert (member.state, member.attempts) == (state, attempts)
        assert ("diverged at iteration 2" in member.reason) == (state == "diverged")
        assert Counter(states(manifest).values())["done"] == 3 + (state == "done")


def test_promotion_goes_on_without_a_member_that_diverged_on_warp(
    tmp_path, monkeypatch
):
    pretend_warp(monkeypatch)
    plan_faults(tmp_path, {"plain/0": ["nan", "nan"]})
    promote = {"top": 1, "seeds": 1, "by": "task_speed_mps"}
    manifest = run_fake(tmp_path, promote=promote, backend="warp")
    assert states(manifest)["plain/0"] == "diverged"
    assert states(manifest)["lift/2"] == "done"


def test_a_full_disk_stops_the_sweep_and_the_next_start_finishes_it(tmp_path):
    plan_faults(tmp_path, {"plain/0": ["full"], "lift/0": ["slow"]})
    with pytest.raises(SweepFull, match="no room") as full:
        run_fake(tmp_path)
    assert full.value.exit_code == 4
    manifest = read_manifest(tmp_path)
    assert set(states(manifest).values()) == {"waiting"}
    plan_faults(tmp_path, {})
    assert set(states(run_fake(tmp_path)).values()) == {"done"}


def test_seeds_are_added_without_repeating_any(tmp_path):
    run_fake(tmp_path, seeds=1)
    run_fake(tmp_path, seeds=2)
    ended = Counter(member for word, member in journal(tmp_path) if word == "end")
    assert ended == dict.fromkeys(["plain/0", "lift/0", "plain/1", "lift/1"], 1)


def test_a_sweep_has_one_parent(tmp_path):
    with sweep_lock(tmp_path), pytest.raises(InputError, match="no other process"):
        run_fake(tmp_path)


def test_the_best_configurations_are_trained_on_more_seeds(tmp_path):
    promote = {"top": 1, "seeds": 2, "by": "task_speed_mps"}
    manifest = run_fake(tmp_path, promote=promote)
    more = [str(m.key) for m in manifest.members if m.seed > 1]
    assert more == ["lift/2", "lift/3"]
    assert choosing(saved_sweep(tmp_path), manifest) == {"lift": (0, 1)}
    assert choosing(sweep(), manifest) == choosing(None, manifest) == {}
    assert set(states(manifest).values()) == {"done"}
    again = run_fake(tmp_path, promote=promote)
    assert again == manifest
    lowest = run_fake(tmp_path, promote=promote | {"better": "lower"})
    assert states(lowest) == states(manifest) | {"plain/2": "done", "plain/3": "done"}


def test_promotion_by_an_unknown_measure_is_refused(tmp_path):
    with pytest.raises(InputError, match="did you mean task_speed_mps"):
        run_fake(tmp_path, promote={"by": "task_speed"})
    assert journal(tmp_path) == []
    with pytest.raises(InputError, match="found path; valid: one of task_speed_mps"):
        run_fake(tmp_path, promote={"by": "path", "better": "higher"})


def test_promotion_waits_for_what_is_missing(tmp_path):
    plan_faults(tmp_path, {"plain/0": ["input"]})
    manifest = run_fake(tmp_path, promote={"by": "task_speed_mps"})
    assert len(manifest.members) == 4


def start(root, engine="local"):
    """Starts a sweep in a process of its own."""
    words = [sys.executable, str(Path(sweep_setup.__file__)), str(root), engine]
    here = Path(__file__).parents[4]
    path = os.pathsep.join(map(str, (here, here / "tests", here / "deploy")))
    environment = {**os.environ, "PYTHONPATH": path}
    return subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True)


def begun(root, number):
    """Waits until so many members have begun."""
    for _ in range(2400):
        if sum(word == "begin" for word, _ in journal(root)) >= number:
            return
        time.sleep(0.05)
    raise AssertionError("nothing begins")


def alone(root):
    """Waits until no worker is left."""
    for _ in range(200):
        if not workers(root):
            return
        time.sleep(0.05)
    raise AssertionError(f"workers are left: {workers(root)}")


def workers(root):
    return [p for p in workers_begun(root) if str(root).encode() in command(p)]


def workers_begun(root):
    """Returns the process of every line of the journal that says that one began."""
    lines = (root / "journal.txt").read_text("utf-8").splitlines()
    return [line.split()[2] for line in lines if line.startswith("begin ")]


def command(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def test_a_signal_stops_workers_and_the_next_start_goes_on(tmp_path):
    plan_faults(tmp_path, {"lift/0": ["slow"]})
    parent = start(tmp_path)
    begun(tmp_path, 2)
    parent.send_signal(signal.SIGINT)
    _, said = parent.communicate(timeout=60)
    assert parent.returncode != 0 and SweepStopped.__name__ in said
    alone(tmp_path)
    assert states(read_manifest(tmp_path))["lift/0"] == "waiting"
    plan_faults(tmp_path, {})
    assert set(states(run_fake(tmp_path)).values()) == {"done"}


def killed_often(root, kills, rng, engine):
    """Kills the parent of a sweep so often, each time a little later in its life."""
    for _ in range(kills):
        parent = start(root, engine)
        begun(root, len([x for x in journal(root) if x[0] == "begin"]) + 1)
        time.sleep(rng.uniform(0.0, 0.3))
        parent.kill()
        parent.wait()
        alone(root)


def check_kills(root, kills, seed, engine):
    """T14: nothing that had finished is repeated, nothing skipped, no two writers."""
    print(f"seed {seed}")
    members = [f"{c}/{s}" for s in range(2) for c in ("plain", "lift")]
    # Each member is at work for long in its first attempts, so that kills hit it.
    faults = {member: ["slow"] * kills for member in members}
    plan_faults(root, faults)
    killed_often(root, kills, random.Random(seed), engine)
    together = max(Counter(workers_begun(root)).values())
    assert together == {"local": 1, "population": 2}[engine]
    plan_faults(root, {})
    manifest = run_fake_on(root, engine)
    assert set(states(manifest).values()) == {"done"}
    ended = Counter(member for word, member in journal(root) if word == "end")
    assert ended == dict.fromkeys(members, 1)
    assert all(is_evaluated(root / m.run) for m in manifest.members)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_killed_parent_leaves_no_worker_and_the_next_finishes(tmp_path, engine):
    check_kills(tmp_path, kills=1, seed=0, engine=engine)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("seed", [1])
def test_twenty_kills_of_the_parent(tmp_path, seed, engine):
    check_kills(tmp_path, kills=20, seed=seed, engine=engine)


def test_the_lock_of_a_parent_ends_with_it(tmp_path):
    """Negative control of the lock: it is held, then it is not."""
    with sweep_lock(tmp_path), pytest.raises(InputError):
        locked(tmp_path / "sweep.lock", "").__enter__()
    with sweep_lock(tmp_path):
        pass
