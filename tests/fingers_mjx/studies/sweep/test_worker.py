"""A worker: what it does with members, how it ends, and with whom."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.processes import alive
from support.sweep_setup import sweep

from envs.errors import InputError
from fingers_mjx.runs.directory import locked
from fingers_mjx.studies.sweep import worker
from fingers_mjx.studies.sweep.outcome import outcome
from fingers_mjx.studies.sweep.plan import Key
from fingers_mjx.studies.sweep.resolve import keep_sweep
from fingers_mjx.training.errors import Diverged, Interrupted

ONE, TWO = Key("plain", 0), Key("lift", 1)
DIVERGED = Diverged("loss/value", 7, 4, Path("dump.npz"), None)


@pytest.fixture
def root(tmp_path):
    keep_sweep(sweep(), tmp_path / "spec.yaml", tmp_path)
    return tmp_path


def run(root, error=None, lost=(), keys=(ONE,), evaluated=None, unmeasured=()):
    """Runs a worker whose training raises `error`, or loses members."""

    def train(spec, root, keys, on_progress):
        if error is not None:
            raise error
        on_progress({"event": "note", "text": "trained"})
        return dict(lost)

    def evaluate(spec, root, keys):
        (evaluated if evaluated is not None else []).extend(keys)
        return dict(unmeasured)

    words = [word for key in keys for word in map(str, key)]
    return worker.main([str(root), *words], train, evaluate)


def verdict(root, key, status):
    return outcome(root, key, key.directory(root) / "train", status)


@pytest.mark.parametrize(
    ("error", "status", "said", "words"),
    [
        (DIVERGED, 3, "diverged", "diverged at iteration 7: loss/value"),
        (InputError("x.yaml", "env.y", 1, "2"), 2, "failed", "x.yaml: env.y: found 1"),
        (OSError(28, "No space left on device"), 4, "full", "No space left"),
        (Interrupted(Path("c"), 5), 75, "again", "stopped after iteration 5"),
        (ValueError("no such\nthing"), 1, "again", "ValueError: no such thing"),
        (RuntimeError("RESOURCE_EXHAUSTED: 1 GiB"), 1, "again", "RESOURCE_EXHAUSTED"),
    ],
)
def test_an_error_becomes_status_and_reason(root, error, status, said, words):
    assert run(root, error) == status
    found = verdict(root, ONE, status)
    assert found.verdict == said and words in found.reason


def test_what_ends_a_program_is_the_reason_of_all_its_members(root):
    """As when Warp's room for contacts, which they share, was too small."""
    source = "iteration 2: contacts dropped in 1 of 8 worlds"
    error = InputError(source, "env.contacts_per_world", 48, "about 96")
    status = run(root, error, keys=(ONE, TWO))
    for key in (ONE, TWO):
        found = verdict(root, key, status)
        assert found.verdict == "failed"
        assert "env.contacts_per_world: found 48; valid: about 96" in found.reason


def test_members_are_trained_and_evaluated(root, capsys):
    evaluated = []
    assert run(root, keys=(ONE, TWO), evaluated=evaluated) == 0
    assert evaluated == [ONE, TWO]
    assert '"trained"' in capsys.readouterr().out


def test_a_member_that_is_lost_does_not_take_others_with_it(root):
    evaluated = []
    status = run(root, lost={TWO: DIVERGED}, keys=(ONE, TWO), evaluated=evaluated)
    assert (status, evaluated) == (3, [ONE])
    assert verdict(root, TWO, status).verdict == "diverged"


def test_an_evaluation_that_fails_does_not_take_others_with_it(root):
    error = InputError("evaluation", "contacts_per_world", 48, "about 96")
    status = run(root, unmeasured={TWO: error}, keys=(ONE, TWO))
    assert status == 2
    assert "contacts_per_world" in verdict(root, TWO, status).reason
    # The other has no reason beside it: nothing of it went wrong.
    assert verdict(root, ONE, 0).reason != verdict(root, TWO, status).reason


def test_rows_of_the_curve_stay_out_of_the_log(capsys):
    worker.say({"event": "progress", "iteration": 1})
    assert capsys.readouterr().out == ""


def test_a_member_has_one_worker(root, monkeypatch):
    monkeypatch.setattr(worker, "LOCK_WAIT_S", 0.3)
    directory = ONE.directory(root)
    directory.mkdir(parents=True)
    with locked(directory / worker.LOCK_FILE, ""), pytest.raises(InputError):
        run(root)
    assert run(root) == 0


PARENT = """
import subprocess, sys, time
child = "from fingers_mjx.studies.sweep.worker import end_with_parent as e; e();"
child += "import time; print('ready', flush=True); time.sleep(60)"
process = subprocess.Popen([sys.executable, "-c", child], stdin=subprocess.PIPE)
print(process.pid, flush=True)
time.sleep(60)
"""


def test_a_worker_ends_with_the_process_that_started_it():
    words = [sys.executable, "-c", PARENT]
    parent = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    assert parent.stdout.readline() == "ready\n"
    parent.kill()
    parent.wait()
    for _ in range(200):
        if not alive(child):
            return
        time.sleep(0.05)
    os.kill(child, 9)
    raise AssertionError("the worker is still there")
