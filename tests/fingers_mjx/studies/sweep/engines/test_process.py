"""Worker processes: their cores, their variables, how they end."""

import signal
import sys
import time

import pytest

from fingers_mjx.studies.sweep.engines import held
from fingers_mjx.studies.sweep.engines.process import Process, worker_environment

PROGRAM = "import os, time; print(sorted(os.sched_getaffinity(0)), os.environ['X'])"


@pytest.fixture(autouse=True)
def cores_of_the_test(tmp_path, monkeypatch):
    """Cores and GPUs are held in a place of the test's own."""
    monkeypatch.setattr(held.tempfile, "gettempdir", lambda: str(tmp_path))


def ended(worker):
    for _ in range(1200):
        if (status := worker.poll()) is not None:
            return status
        time.sleep(0.05)
    raise AssertionError("the process does not end")


def test_a_process_runs_on_its_core_and_says_where_it_should(tmp_path):
    program = f"import time; time.sleep(0.5); {PROGRAM}"
    log = tmp_path / "deep" / "log.txt"
    worker = Process([sys.executable, "-c", program], log, {"X": "seen"}, threads=1)
    [core] = worker._cores.names
    assert worker.poll() is None
    assert ended(worker) == 0
    assert log.read_text("utf-8").split("\n")[0] == f"[{core}] seen"
    assert worker._cores.names == []


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


def test_workers_on_one_machine_have_a_gpu_each(tmp_path, monkeypatch):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "2,5")
    program = (
        "import os, time; time.sleep(0.5); print(os.environ['CUDA_VISIBLE_DEVICES'])"
    )
    logs = [tmp_path / f"{index}.txt" for index in range(3)]
    words = [sys.executable, "-c", program]
    workers = [Process(words, log, {}, own_gpu=True) for log in logs]
    assert [ended(worker) for worker in workers] == [0, 0, 0]
    # The third finds none left, and takes its chance with what all see.
    assert [log.read_text("utf-8").strip() for log in logs] == ["2", "5", "2,5"]
    later = Process(words, tmp_path / "later.txt", {}, own_gpu=True)
    assert ended(later) == 0
    assert (tmp_path / "later.txt").read_text("utf-8").strip() == "2"
