"""Measurements survive peers that fail; intervals are those of the logarithms."""

import sys

import pytest

from benchmarks.comparison import measure, process
from benchmarks.comparison.plan import Job, Worker, jobs
from benchmarks.comparison.process import Place
from benchmarks.comparison.workers.report import MARK

SAYS = f"""
import json, sys
print("noise of the peer")
print({MARK!r} + json.dumps(dict(ready=True, version="1", note="n")), flush=True)
for _ in sys.stdin:
    print({MARK!r} + json.dumps(dict(rate=50.0)), flush=True)
"""
FAILS = "raise ImportError('needs CUDA')"
PROGRAMS = {"says": SAYS, "fails": FAILS}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "python_of", lambda peer, folder: sys.executable)
    monkeypatch.setattr(
        process, "words", lambda worker, job, place: ["-c", PROGRAMS[worker.module]]
    )
    return Place(tmp_path, "cpu")


def job(kind):
    workers = tuple(Worker(name, name, name) for name in PROGRAMS)
    return Job("job", kind, "quantity", workers, 1)


@pytest.mark.parametrize("kind", ["turns", "start"])
def test_a_failing_peer_leaves_its_reason_and_the_others_their_figures(place, kind):
    found = {
        worker.peer: figure for worker, figure in measure.measure(job(kind), place)
    }
    assert found["says"].value > 0.0
    assert found["fails"].value is None
    assert "ImportError: needs CUDA" in found["fails"].note


def test_intervals_hold_the_mean_and_widen_with_the_spread():
    middle, low, high = measure.interval([1.0, 2.0, 4.0])
    assert middle == pytest.approx(2.0)
    assert low < 1.0 and high > 4.0
    assert measure.interval([2.0, 2.0, 2.0]) == pytest.approx((2.0, 2.0, 2.0))


@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_names_of_measurements_are_unique(device):
    names = [job.name for job in jobs(device)]
    assert len(names) == len(set(names)) > 5
