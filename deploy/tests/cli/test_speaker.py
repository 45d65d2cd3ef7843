import fcntl
import os
import time

from fingers_robot.cli import speaker as module
from fingers_robot.cli.speaker import Speaker


def _until(condition):
    deadline = time.monotonic() + 10
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


def test_lines_arrive_in_order():
    read, write = os.pipe()
    say = Speaker(write)
    for line in ("active -> stopping", "grüße", "\ud800 of no encoding"):
        say(line)
    say.finish()
    assert say.read
    said = os.read(read, 1000).decode().splitlines()
    assert said == ["active -> stopping", "grüße", "? of no encoding"]


def test_a_reader_who_does_not_read_holds_up_nothing_and_is_noticed(monkeypatch):
    monkeypatch.setattr(module, "BLOCKED_S", 0.2)
    read, write = os.pipe()
    fcntl.fcntl(write, fcntl.F_SETPIPE_SZ, 4096)
    say = Speaker(write)
    for _ in range(5000):
        say("a" * 100)
    assert _until(lambda: not say.read)
    say.finish()
    os.close(read)


def test_a_reader_who_has_gone_is_noticed_before_anything_is_said():
    read, write = os.pipe()
    say = Speaker(write)
    assert say.read
    os.close(read)
    assert not say.read
    say("nobody is there")
    say.finish()
