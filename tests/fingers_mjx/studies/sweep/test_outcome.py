"""What became of a member, from the exit status and what its worker left behind."""

import json

import pytest

from fingers_mjx.runs.directory import END_FILE
from fingers_mjx.studies.sweep.divergence import ASIDE
from fingers_mjx.studies.sweep.outcome import (
    Outcome,
    forget_outcome,
    last_lines,
    note_outcome,
    outcome,
)
from fingers_mjx.studies.sweep.plan import LOG_FILE, Key

KEY = Key("lift", 3)


@pytest.fixture
def run(tmp_path):
    path = KEY.directory(tmp_path) / "train"
    (path / "eval").mkdir(parents=True)
    return path


@pytest.mark.parametrize(
    ("status", "said", "verdict", "words"),
    [
        (3, "diverged at iteration 7", "diverged", "same seed would diverge again"),
        (2, "env.x: found 1; valid: 2", "failed", "env.x"),
        (4, "no room for x", "full", "no room"),
        (1, "XlaRuntimeError: RESOURCE_EXHAUSTED", "again", "RESOURCE_EXHAUSTED"),
        (-9, "", "again", "killed by SIGKILL, as when memory runs out"),
        (-11, "", "again", "killed by SIGSEGV"),
        (75, "", "again", "stopped by a signal"),
        (1, "", "again", "status 1"),
        (0, "", "again", "status 0"),
    ],
)
def test_how_a_worker_ended_decides(tmp_path, run, status, said, verdict, words):
    log = KEY.directory(tmp_path) / LOG_FILE
    log.write_text("compiling\namid iteration 3\n\n", "utf-8")
    if said:
        note_outcome(tmp_path, KEY, status, said)
    found = outcome(tmp_path, KEY, run, status)
    assert found.verdict == verdict
    assert words in found.reason
    assert said or "amid iteration 3" in found.reason


def test_a_divergence_may_not_come_again_where_trainings_differ(tmp_path, run):
    """Negative control: other failures are what they are everywhere."""
    note_outcome(tmp_path, KEY, 3, "diverged at iteration 7")
    (run / END_FILE).write_text("{}", "utf-8")
    found = outcome(tmp_path, KEY, run, 3, repeatable=False)
    assert found == Outcome("anew", "diverged at iteration 7")
    aside = run.with_name(run.name + ASIDE)
    aside.mkdir()
    found = outcome(tmp_path, KEY, run, 3, repeatable=False)
    assert found == Outcome("diverged", "diverged at iteration 7")
    for status, verdict in ((1, "again"), (2, "failed"), (4, "full")):
        note_outcome(tmp_path, KEY, status, "for a reason")
        both = [outcome(tmp_path, KEY, run, status, same) for same in (True, False)]
        assert both == [Outcome(verdict, "for a reason")] * 2


def test_a_hang_differs_from_a_signal_by_the_watchdog(tmp_path, run):
    log = KEY.directory(tmp_path) / LOG_FILE
    log.write_text("no progress for 300 s; stacks in hang.txt\nFile …\n", "utf-8")
    found = outcome(tmp_path, KEY, run, 75)
    assert (found.verdict, found.reason[:20]) == ("again", "hung: no progress fo")


def test_an_evaluation_counts_whatever_the_status(tmp_path, run):
    (run / "eval" / "summary.json").write_text(json.dumps({}), "utf-8")
    assert outcome(tmp_path, KEY, run, -9).verdict == "done"


def test_what_an_earlier_attempt_said_is_forgotten(tmp_path, run):
    note_outcome(tmp_path, KEY, 3, "diverged")
    forget_outcome(tmp_path, KEY)
    forget_outcome(tmp_path, KEY)
    assert outcome(tmp_path, KEY, run, 1).verdict == "again"


def test_only_the_last_lines_of_a_long_log_are_read(tmp_path, run):
    assert last_lines(tmp_path, KEY, 2) == []
    log = KEY.directory(tmp_path) / LOG_FILE
    log.write_text("x\n" * 10**6 + "one\n\ntwo\n", "utf-8")
    assert last_lines(tmp_path, KEY, 2) == ["one", "two"]
