"""What is held by one is nobody else's."""

import os
import subprocess

import pytest

from fingers_mjx.studies.sweep.engines import held
from fingers_mjx.studies.sweep.engines.held import CORES, GPUS, Held, cores, gpus


@pytest.fixture(autouse=True)
def place_of_the_test(tmp_path, monkeypatch):
    """Files of what is held are the test's own."""
    monkeypatch.setattr(held.tempfile, "gettempdir", lambda: str(tmp_path))


def test_nothing_is_held_twice_and_each_is_free_again():
    names = ["0", "1", "7"]
    one, other = Held(CORES, names, 1), Held(CORES, names, 3)
    assert one.names == ["0"]
    assert other.names == []  # fewer are left than it asked for
    assert Held(GPUS, names, 1).names == ["0"]  # of another kind
    one.free()
    one.free()
    again = Held(CORES, names, 3)
    assert again.names == names
    assert Held(CORES, names, None).names == []
    again.free()


def test_cores_are_those_on_which_this_process_may_run():
    assert cores() == [str(core) for core in sorted(os.sched_getaffinity(0))]


def test_gpus_are_those_that_the_user_lets_see(monkeypatch):
    class Done:
        stdout = "0\n1\n2\n"

    monkeypatch.setattr(held.subprocess, "run", lambda *words, **how: Done)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert gpus() == ["0", "1", "2"]
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "1, 2")
    assert gpus() == ["1", "2"]
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
    assert gpus() == []


@pytest.mark.parametrize(
    "error", [FileNotFoundError("x"), subprocess.CalledProcessError(9, "x")]
)
def test_a_machine_without_the_driver_has_no_gpu(monkeypatch, error):
    def missing(*words, **how):
        raise error

    monkeypatch.setattr(held.subprocess, "run", missing)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert gpus() == []
