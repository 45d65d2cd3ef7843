"""Measurements survive peers that fail; intervals are those of the logarithms."""

import dataclasses
import sys

import pytest

from benchmarks.comparison import figures, measure, process
from benchmarks.comparison.peers import OURS
from benchmarks.comparison.plan import Job, Worker, jobs
from benchmarks.comparison.process import Place
from benchmarks.comparison.turns import by_turns
from benchmarks.comparison.workers.report import MARK

SAYS = f"""
import json, sys
print("noise of the peer")
print({MARK!r} + json.dumps(dict(ready=True, version="1", note="n")), flush=True)
for _ in sys.stdin:
    print({MARK!r} + json.dumps(dict(rate=50.0)), flush=True)
"""
FAILS = """
import sys
try:
    raise ImportError(f"needs CUDA in {sys.argv[1]}")
except ImportError:
    raise OSError(9, "hides it")
"""
PROGRAMS = {"says": SAYS, "fails": FAILS}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "python_of", lambda peer, folder: sys.executable)
    monkeypatch.setattr(
        process,
        "words",
        lambda worker, job, place: ["-c", PROGRAMS[worker.module], str(place.out)],
    )
    return Place(tmp_path, "cpu")


def job(kind):
    workers = tuple(Worker(name, name, name) for name in PROGRAMS)
    return Job("job", kind, "quantity", workers, 1)


@pytest.mark.parametrize("kind", ["turns", "start"])
def test_a_failing_peer_leaves_its_reason_and_the_others_their_figures(place, kind):
    (_, says), (_, fails) = measure.measure(job(kind), place)
    assert says.value and says.value > 0.0
    assert fails.value is None
    said = "ImportError: needs CUDA in DIR, after it OSError: [Errno 9] hides it"
    assert said in fails.note


def test_intervals_hold_the_mean_and_widen_with_the_spread():
    middle, low, high = figures.interval([1.0, 2.0, 4.0])
    assert middle == pytest.approx(2.0)
    assert low < 1.0 and high > 4.0
    assert figures.interval([2.0, 2.0, 2.0]) == pytest.approx((2.0, 2.0, 2.0))


def test_rates_of_several_jobs_are_taken_after_all_are_ready(place):
    jobs = [dataclasses.replace(job("turns"), name=name) for name in ("a", "b")]
    found = {one.name: figures for one, figures in by_turns(jobs, place)}
    assert list(found) == ["a", "b"]
    for (_, says), (_, fails) in found.values():
        assert says.value and says.value > 0.0
        assert fails.value is None


def test_peers_can_be_taken_from_this_environment(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        process, "python_of", lambda peer, folder: asked.append(peer) or sys.executable
    )
    worker = Worker("peer", "playground", "report")
    for here in (False, True):
        where = Place(tmp_path, "cpu", here)
        with process.speaking(worker, job("start"), where):
            pass
    assert asked == ["playground", OURS]


@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_names_of_measurements_are_unique(device):
    names = [job.name for job in jobs(device)]
    assert len(names) == len(set(names)) > 5
