"""The guard: when it acts, when it does not, and who learns of it."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

from fingers_robot.runtime import guard_link, guard_process
from fingers_robot.runtime.guard_link import WatchedEnd
from fingers_robot.runtime.guard_process import Guard
from fingers_robot.runtime.link import make_link
from fingers_robot.runtime.systemd import notify

NOBODY = 2**22 + 1  # no process has this number


@pytest.fixture
def run(monkeypatch):
    """A guard in a thread; the ends of supervisor and console; what it did."""
    monkeypatch.setattr(guard_process, "TRY_S", 0.3)
    monkeypatch.setattr(guard_process, "_TAKEN_S", 0.2)
    mine, supervisor = make_link()
    with_console, console = make_link()
    done, answers = [], [(True, "off")]

    def make_safe():
        done.append(time.monotonic())
        return answers[min(len(done), len(answers)) - 1]

    guard = Guard(mine, with_console, make_safe)
    ended = []
    thread = threading.Thread(target=lambda: ended.append(guard.run()), daemon=True)
    thread.start()
    yield WatchedEnd(supervisor), WatchedEnd(console), answers, done, thread, ended
    for end in (supervisor, console):
        end.close()
    thread.join(timeout=5)


def _until(condition):
    deadline = time.monotonic() + 5
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.005)
    return condition()


def _ready(end):
    end.poll()
    return end.ready


def test_it_says_that_it_watches(run):
    supervisor, console, *_ = run
    assert _until(lambda: _ready(supervisor)) and _until(lambda: _ready(console))


def test_a_supervisor_that_takes_leave_leaves_it_nothing_to_do(run):
    supervisor, _, _, done, thread, ended = run
    supervisor.beat(time.monotonic(), NOBODY)
    supervisor.farewell()
    supervisor._socket.close()
    thread.join(timeout=5)
    assert ended == [0] and done == []


def test_a_supervisor_that_took_leave_before_the_guard_began_is_believed():
    mine, supervisor = make_link()
    with_console, console = make_link()
    WatchedEnd(supervisor).farewell()
    supervisor.close()
    done = []
    guard = Guard(mine, with_console, lambda: done.append(1) or (True, ""))
    assert guard.run() == 0 and done == []
    console.close()


@pytest.mark.parametrize("console_there", [True, False])
def test_a_supervisor_that_dies_is_replaced_at_once(run, console_there, capfd):
    supervisor, console, _, done, thread, ended = run
    supervisor.beat(time.monotonic(), NOBODY)
    if not console_there:
        console._socket.close()
    died_s = time.monotonic()
    supervisor._socket.close()
    assert _until(lambda: done) and done[0] - died_s < 2.0
    if console_there:
        _until(lambda: console.poll() or console.report)
        assert console.report == "guard: off"
    thread.join(timeout=5)
    assert ended == [0]
    assert ("guard: off" in capfd.readouterr().err) is not console_there


def test_a_console_that_takes_nothing_is_replaced_by_standard_error(run, capfd):
    supervisor, _, _, _, thread, _ = run
    supervisor._socket.close()
    thread.join(timeout=5)
    assert "guard: off" in capfd.readouterr().err


def test_it_tries_again_until_the_hand_confirms(run):
    supervisor, _, answers, done, thread, ended = run
    answers[:] = [(False, "busy")] * 3 + [(True, "off")]
    supervisor._socket.close()
    thread.join(timeout=5)
    assert ended == [0] and len(done) == 4


def test_it_does_not_try_for_ever(run):
    supervisor, _, answers, done, thread, ended = run
    answers[:] = [(False, "gone: CUT THE BATTERY")]
    supervisor._socket.close()
    thread.join(timeout=5)
    assert ended == [5] and len(done) > 1


def test_a_silent_supervisor_is_killed_and_replaced(run, monkeypatch):
    supervisor, _, _, done, _, _ = run
    monkeypatch.setattr(guard_link, "SILENCE_S", 0.3)
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"]) as p:
        os.kill(p.pid, signal.SIGSTOP)  # as one that hangs
        supervisor.beat(time.monotonic(), p.pid)
        assert p.wait(timeout=5) == -signal.SIGKILL
        assert _until(lambda: done)


def test_silence_counts_from_the_first_beat(run, monkeypatch):
    supervisor, _, _, done, thread, _ = run
    monkeypatch.setattr(guard_link, "SILENCE_S", 0.05)
    time.sleep(0.3)
    assert thread.is_alive() and done == []
    supervisor.farewell()
    supervisor._socket.close()


def test_the_manager_is_notified_only_while_all_are_there(tmp_path, monkeypatch):
    path = str(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(path)
        manager.settimeout(0.5)
        mine, supervisor = make_link()
        with_console, console = make_link()
        guard = Guard(mine, with_console, lambda: (True, ""))
        threading.Thread(target=guard.run, daemon=True).start()
        watched, other = WatchedEnd(supervisor), WatchedEnd(console)
        watched.beat(0.0, NOBODY)
        with pytest.raises(TimeoutError):
            manager.recv(100)  # there is no console yet
        for k in range(1, 10):
            for end in (watched, other):
                end.beat(float(k), NOBODY)
            time.sleep(0.03)
        assert manager.recv(100) == b"READY=1\nWATCHDOG=1"
        watched.farewell()
        supervisor.close()


def test_systemd_is_found(tmp_path):
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(path)
        notify(path, "WATCHDOG=1")
        assert end.recv(100) == b"WATCHDOG=1"
    notify(str(tmp_path / "nobody"), "WATCHDOG=1")
