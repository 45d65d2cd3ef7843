"""Signals and watchdog: what ends a run, and how."""

import os
import signal
import threading
import time

import pytest

from fingers_mjx.training import signals as guard_signals
from fingers_mjx.training import watchdog as guard_watchdog
from fingers_mjx.training.signals import StopSignals
from fingers_mjx.training.watchdog import Watchdog


def wait_for(condition, limit_s=5.0):
    end_s = time.monotonic() + limit_s
    while not condition() and time.monotonic() < end_s:
        time.sleep(0.01)
    return condition()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_first_signal_asks_and_second_ends(monkeypatch, number):
    ended, said = [], []
    monkeypatch.setattr(guard_signals.os, "_exit", ended.append)
    before = signal.getsignal(number)
    with StopSignals(said.append) as stop:
        assert not stop.requested
        os.kill(os.getpid(), number)
        assert wait_for(lambda: stop.requested)
        assert len(said) == 1
        assert ended == []
        os.kill(os.getpid(), number)
        assert wait_for(lambda: ended)
    assert ended == [128 + number]
    assert signal.getsignal(number) == before


def test_other_signals_do_not_count():
    old = signal.signal(signal.SIGUSR1, lambda *_: None)
    try:
        with StopSignals(lambda text: None) as stop:
            os.kill(os.getpid(), signal.SIGUSR1)
            time.sleep(0.05)
            assert not stop.requested
    finally:
        signal.signal(signal.SIGUSR1, old)


def test_silence_ends_the_run_and_names_where(monkeypatch, tmp_path, capfd):
    ended = threading.Event()
    monkeypatch.setattr(guard_watchdog.os, "_exit", lambda code: ended.set())
    with Watchdog(tmp_path / "hang.txt", limit_s=0.2, first_limit_s=0.2):
        assert ended.wait(5.0)
    assert "test_guard.py" in (tmp_path / "hang.txt").read_text(encoding="utf-8")
    assert "no progress" in capfd.readouterr().err


def test_beats_keep_the_run_alive(monkeypatch, tmp_path):
    ended = []
    monkeypatch.setattr(guard_watchdog.os, "_exit", ended.append)
    with Watchdog(tmp_path / "hang.txt", limit_s=0.4, first_limit_s=0.4) as watchdog:
        for _ in range(12):
            time.sleep(0.05)
            watchdog.beat()
    assert ended == []


def test_limit_follows_the_usual_time_between_beats(monkeypatch, tmp_path):
    now_s = [0.0]
    monkeypatch.setattr(guard_watchdog.time, "monotonic", lambda: now_s[0])
    watchdog = Watchdog(tmp_path / "hang.txt", limit_s=300.0)
    assert watchdog.limit_s == guard_watchdog.FIRST_LIMIT_S
    for step_s in (900.0, 40.0, 50.0, 60.0, 50.0):
        now_s[0] += step_s
        watchdog.beat()
    assert watchdog.limit_s == 500.0  # ten times the median, not moved by one outlier
