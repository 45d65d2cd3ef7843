"""Worker processes: their cores, their variables, how they end."""

import os
import signal
import sys
import time

import pytest

from fingers_mjx.studies.sweep import process
from fingers_mjx.studies.sweep.process import Cores, Process, worker_environment

PROGRAM = "import os, time; print(sorted(os.sched_getaffinity(0)), os.environ['X'])"


@pytest.fixture(autouse=True)
def cores_of_the_test(tmp_path, monkeypatch):
    """Cores are held in a place of the test's own."""
    monkeypatch.setattr(process.tempfile, "gettempdir", lambda: str(tmp_path))


def held(cores):
    return set(cores._held)


def ended(worker):
    for _ in range(1200):
        if (status := worker.poll()) is not None:
            return status
        time.sleep(0.05)
    raise AssertionError("the process does not end")


def test_no_core_is_held_twice_and_each_is_free_again():
    usable = os.sched_getaffinity(0)
    one = Cores(1)
    other = Cores(len(usable))
    assert len(held(one)) == 1
    assert held(other) == set()  # fewer are left than it asked for
    one.free()
    one.free()
    again = Cores(len(usable))
    assert held(again) == usable
    again.free()
    assert held(Cores(None)) == set()


def test_a_process_runs_on_its_core_and_says_where_it_should(tmp_path):
    program = f"import time; time.sleep(0.5); {PROGRAM}"
    log = tmp_path / "deep" / "log.txt"
    worker = Process([sys.executable, "-c", program], log, {"X": "seen"}, threads=1)
    (core,) = held(worker._cores)
    assert worker.poll() is None
    assert ended(worker) == 0
    assert log.read_text("utf-8").split("\n")[0] == f"[{core}] seen"
    assert held(worker._cores) == set()


def test_stop_is_a_signal_and_the_status_says_so(tmp_path):
    sleeps = [sys.executable, "-c", "import time; time.sleep(60)"]
    worker = Process(sleeps, tmp_path / "log.txt", {})
    worker.stop()
    assert ended(worker) == -signal.SIGTERM
    worker.stop()


def test_ctrl_c_on_the_terminal_does_not_reach_a_worker(tmp_path):
    program = "import os; print(os.getpid() == os.getsid(0))"
    worker = Process([sys.executable, "-c", program], tmp_path / "log.txt", {})
    assert ended(worker) == 0
    assert (tmp_path / "log.txt").read_text("utf-8") == "True\n"


def test_threads_are_fixed_wherever_a_worker_runs():
    one = worker_environment(1, "cpu")
    assert (one["PJRT_NPROC"], one["OMP_NUM_THREADS"]) == ("1", "1")
    assert one["JAX_PLATFORMS"] == "cpu"
    gpu = worker_environment(None, "warp")
    assert not {"PJRT_NPROC", "OMP_NUM_THREADS", "JAX_PLATFORMS"} & gpu.keys()
