"""Measurements survive peers that fail; intervals are those of the logarithms."""

import dataclasses
import os
import sys
import time

import pytest

from benchmarks.comparison import figures, measure, process
from benchmarks.comparison.peers import OURS
from benchmarks.comparison.place import Place
from benchmarks.comparison.plan import Job, Worker, jobs
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
HANGS = "import time; time.sleep(600)"
PROGRAMS = {"says": SAYS, "fails": FAILS, "hangs": HANGS}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "python_of", lambda peer, folder: sys.executable)
    monkeypatch.setattr(
        process,
        "words",
        lambda worker, job, place: ["-c", PROGRAMS[worker.module], str(place.out)],
    )
    return Place(tmp_path, "cpu")


def job(kind, *names):
    workers = tuple(Worker(name, name, name) for name in names or ("says", "fails"))
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
    for here in (None, {}):
        where = Place(tmp_path, "cpu", here)
        with process.speaking(worker, job("start"), where):
            pass
    assert asked == ["playground", OURS]


@pytest.mark.parametrize("kind", ["turns", "start"])
def test_a_hanging_peer_is_ended_and_the_others_keep_their_figures(place, kind):
    limited = dataclasses.replace(place, limit_s=2.0)
    found = measure.measure(job(kind, "hangs", "says"), limited)
    (_, hangs), (_, says) = found
    assert hangs.note == "not measured: no answer in 2 s"
    assert says.value and says.value > 0.0


def test_the_limit_of_an_answer_counts_from_the_question(place):
    limited = dataclasses.replace(place, limit_s=1.0)
    with process.speaking(job("turns").workers[0], job("turns"), limited) as speaker:
        speaker.hear()
        time.sleep(1.5)
        assert speaker.ask("go")["rate"] == 50.0


def test_a_peers_own_packages_come_first(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "shared")
    where = Place(tmp_path, "gpu", {"mjlab": "own"})
    paths = [
        where.environment(Worker("peer", name, "report"))["PYTHONPATH"]
        for name in ("mjlab", "playground")
    ]
    assert paths == [f"own{os.pathsep}shared", "shared"]


def test_only_a_start_finds_nothing_compiled(place, monkeypatch):
    monkeypatch.setenv("WARP_CACHE_PATH", "kept")
    say = "import json, os; x = os.environ['WARP_CACHE_PATH']"
    say += f"; print({MARK!r} + json.dumps(dict(cache=x)))"
    monkeypatch.setitem(PROGRAMS, "caches", say)
    found = []
    for kind in ("turns", "start", "start"):
        one = job(kind, "caches")
        with process.speaking(one.workers[0], one, place) as speaker:
            found.append(speaker.hear()["cache"])
    assert found[0] == "kept"
    assert len(set(found)) == 3


@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_names_of_measurements_are_unique(device):
    names = [job.name for job in jobs(device)]
    assert len(names) == len(set(names)) > 5
