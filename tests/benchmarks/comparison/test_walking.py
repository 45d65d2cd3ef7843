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
from benchmarks.comparison.workers.walking import FELL, SINCE, SPEED, Walking
from fingers_mjx.ppo.config import preset

STEPS = 25
"""Of an iteration; forty of them are a window."""
FALLS, WALKS, STANDS = (0.5, 0.0), (0.0, 0.08), (0.0, 0.0)
"""Falls of a world in an iteration, and its speed."""


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(walking, "age_s", lambda: now[0])
    return now


def reported(clock, capsys, *phases):
    """What is said of iterations of a second each: how many of which kind."""
    watched = Walking(float(sum(number for number, _ in phases)), "1.0", "hand")
    clock[0], over = 0.0, False
    for number, (falls, speed_mps) in phases:
        for _ in range(number):
            assert not over and capsys.readouterr().out == ""
            clock[0] += 1.0
            over = watched.over(STEPS, speed_mps, falls)
    assert over
    lines = capsys.readouterr().out.splitlines()
    assert watched.over(STEPS, 0.0, 0.0) and capsys.readouterr().out == ""
    *rows, done = (json.loads(line.removeprefix(MARK)) for line in lines)
    assert done == {"done": True}
    assert [row["quantity"] for row in rows] == [SINCE, SPEED, FELL]
    return [row["value"] for row in rows], rows[0]["note"]


def test_a_hand_walks_once_the_means_of_a_whole_window_say_so(clock, capsys):
    figures, note = reported(clock, capsys, (50, FALLS), (50, WALKS))
    # Of the window's forty iterations, at most two with half a fall each may be left.
    assert figures == [88.0, pytest.approx(0.08), 0.0]
    assert "2,500 control steps a world" in note and "walk" not in note


def test_a_hand_that_walks_from_the_start_does_so_once_a_window_is_full(clock, capsys):
    assert reported(clock, capsys, (60, WALKS))[0][0] == 40.0
    figures, note = reported(clock, capsys, (39, WALKS))
    assert figures == [None, pytest.approx(0.08), 0.0] and "does not walk" in note


@pytest.mark.parametrize("worse", [FALLS, STANDS])
def test_a_hand_that_crosses_once_and_relapses_does_not_walk(clock, capsys, worse):
    figures, note = reported(clock, capsys, (60, WALKS), (60, worse))
    assert figures[0] is None and "first at 40 s and relapsed" in note
    again = ((60, WALKS), (60, worse), (60, WALKS))
    assert reported(clock, capsys, *again)[0][0] > 120.0


@pytest.mark.parametrize("other", [FALLS, STANDS])
def test_a_short_crossing_is_not_even_a_first(clock, capsys, other):
    figures, note = reported(clock, capsys, (60, other), (3, WALKS), (60, other))
    assert figures[0] is None and "relapsed" not in note


@pytest.mark.parametrize("falls, walks", [(0.024, True), (0.026, False)])
def test_one_fall_in_a_window_may_be(clock, capsys, falls, walks):
    figures, _ = reported(clock, capsys, (60, (falls, 0.06)))
    assert (figures[0] is not None) == walks
    assert figures[2] == pytest.approx(falls * walking.WINDOW / STEPS)


def test_falls_in_a_longer_window_are_those_of_a_thousand_steps(clock, capsys):
    watched = Walking(100.0, "1.0", "hand")
    for now in range(101):
        clock[0] = float(now)
        watched.over(24, 0.07, 0.012)
    rows = capsys.readouterr().out.splitlines()
    assert json.loads(rows[2].removeprefix(MARK))["value"] == pytest.approx(0.5)


def test_the_age_counts_from_the_start_of_the_process():
    program = "import time; time.sleep(0.5)\n"
    program += "from benchmarks.comparison.workers.walking import age_s\nprint(age_s())"
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert 0.5 <= float(done.stdout) <= time.perf_counter() - began + 0.02


def test_rows_say_what_was_found_even_if_the_hand_does_not_walk(tmp_path, monkeypatch):
    program = "from benchmarks.comparison.workers.walking import Walking\n"
    program += "Walking(0.0, '1.0', 'hand').over(24, 0.02, 0.24)"
    monkeypatch.setattr(process, "python_of", lambda peer, folder: sys.executable)
    monkeypatch.setattr(process, "words", lambda *_: ["-c", program])
    job = Job("walk", "learn", "to walk", (Worker("peer", "peer", "peer"),), 1)
    found = measure.measure(job, Place(tmp_path, "gpu"))
    rows = measure.rows(job, found, command="c", seed=0, device="d", commit="e")
    assert [row.value for row in rows] == [None, 0.02, pytest.approx(10.0)]
    assert {row.peer for row in rows} == {"peer"}


def test_peers_have_the_networks_of_our_preset():
    ppo = preset("fast", "crawl").ppo
    assert ppo.actor_layers == ppo.critic_layers == walking.LAYERS


def test_only_gpus_are_asked_for_a_gait():
    kinds = {device: {job.kind for job in jobs(device)} for device in ("cpu", "gpu")}
    assert "learn" in kinds["gpu"] and "learn" not in kinds["cpu"]
