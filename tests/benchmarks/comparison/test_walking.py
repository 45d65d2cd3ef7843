"""A training to walk is looked at until its time is over, and then reported once."""

import json
import subprocess
import sys
import time

import pytest

from benchmarks.comparison import measure, process
from benchmarks.comparison.place import Place
from benchmarks.comparison.plan import Job, Worker, jobs
from benchmarks.comparison.workers import walking
from benchmarks.comparison.workers.report import MARK
from benchmarks.comparison.workers.walking import SINCE, SPEED, Walking


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(walking, "age_s", lambda: now[0])
    return now


def said(capsys):
    lines = capsys.readouterr().out.splitlines()
    return [json.loads(line.removeprefix(MARK)) for line in lines]


def looked_at(clock, *iterations):
    watched = Walking(100.0, "1.0", "hand")
    for now, length, speed_mps in iterations:
        clock[0] = now
        over = watched.over(length, speed_mps)
    return over


def test_it_walks_since_both_hold_and_is_as_fast_as_in_the_end(clock, capsys):
    means = [(10, 40, 0.09), (20, 900, 0.01), (30, 900, 0.06), (99, 900, 0.07)]
    assert not looked_at(clock, *means)
    assert said(capsys) == []
    assert looked_at(clock, *means, (101, 950, 0.08))
    since, speed, done = said(capsys)
    assert (since["quantity"], since["value"]) == (SINCE, 30)
    assert (speed["quantity"], speed["value"]) == (SPEED, 0.08)
    assert "episodes of 950 steps" in speed["note"] and done == {"done": True}


@pytest.mark.parametrize("last", [(101, 40, 0.09), (101, 900, 0.04)])
def test_a_hand_that_falls_or_stands_does_not_walk(clock, capsys, last):
    assert looked_at(clock, last, last)
    since, speed, _ = said(capsys)
    assert since["value"] is None and "does not walk" in since["note"]
    assert speed["value"] == last[2]


def test_the_age_counts_from_the_start_of_the_process():
    program = "import time; time.sleep(0.5)\n"
    program += "from benchmarks.comparison.workers.walking import age_s\nprint(age_s())"
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert 0.5 <= float(done.stdout) <= time.perf_counter() - began + 0.02


def test_rows_say_what_was_found_even_if_the_hand_does_not_walk(tmp_path, monkeypatch):
    program = "from benchmarks.comparison.workers.walking import Walking\n"
    program += "Walking(0.0, '1.0', 'hand').over(30.0, 0.02)"
    monkeypatch.setattr(process, "python_of", lambda peer, folder: sys.executable)
    monkeypatch.setattr(process, "words", lambda *_: ["-c", program])
    job = Job("walk", "learn", "to walk", (Worker("peer", "peer", "peer"),), 1)
    found = measure.measure(job, Place(tmp_path, "gpu"))
    rows = measure.rows(job, found, command="c", seed=0, device="d", commit="e")
    assert [row.value for row in rows] == [None, 0.02]
    assert {row.peer for row in rows} == {"peer"}


def test_only_gpus_are_asked_for_a_gait():
    kinds = {device: {job.kind for job in jobs(device)} for device in ("cpu", "gpu")}
    assert "learn" in kinds["gpu"] and "learn" not in kinds["cpu"]
