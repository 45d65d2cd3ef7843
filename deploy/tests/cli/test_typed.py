"""What is typed, however it arrives: a stop overtakes everything."""

import os
import threading
import time

import pytest

from fingers_robot.cli.typed import SPACING_S, Typed


@pytest.fixture
def typed():
    sent = []
    return Typed(2, sent.append), sent


def test_lines_that_come_together_all_count(typed):
    console, sent = typed
    console.feed(b"clear\n  policy   1\r\narm\nstatus\n")
    assert console.pass_on(0.0) == ("clear", "policy", "arm", "status")
    assert sent == ["clear", "policy 1", "arm"]


def test_half_a_line_waits_for_its_end(typed):
    console, sent = typed
    console.feed(b"st")
    console.feed(b"op\narm")
    assert sent == ["stop"] and console.pass_on(0.0) == ()
    console.feed(b"\n")
    assert console.pass_on(0.0) == ("arm",)


@pytest.mark.parametrize("word", ["stop", "off", "quit"])
def test_a_stop_leaves_at_once_and_drops_what_was_typed_before_it(typed, word):
    console, sent = typed
    console.feed(b"arm\nclear\n" * 20_000 + word.encode() + b"\nstatus\n")
    assert sent == [word] and console.stopped
    assert console.pass_on(0.0) == ("status",)


def test_nothing_is_armed_beforehand_after_a_stop(typed):
    console, sent = typed
    console.arm()
    console.feed(b"stop\n")
    console.arm()
    assert sent == ["arm", "stop"]


def test_a_flood_is_passed_on_only_so_often(typed):
    console, sent = typed
    for k in range(100):
        console.feed(b"arm\n" * 500)
        console.pass_on(0.01 * k)
    assert sent == ["arm"] * 4  # 1 s of it, every 0.25 s
    assert SPACING_S == 0.25


def test_of_a_kind_the_newest_counts_and_keys_add_up(typed):
    console, sent = typed
    console.feed(b"policy 1\nkeys left\npolicy 0\nkeys up\nkeys up\n")
    console.pass_on(0.0)
    assert sent == ["policy 0", "key left", "key up", "key up"]
    console.feed(b"keys left\n" * 900)
    console.pass_on(1.0)
    assert len(sent) == 4 + 64


def test_refused_lines_are_counted_and_the_last_one_is_named(typed):
    console, _ = typed
    assert console.refusal() == ""
    console.feed(b"policy 7\n\nnonsense\npolicy 8\n")
    said = console.refusal()
    assert said == "found policy 8; valid: 0 to 1 (and 2 before it)"
    assert console.refusal() == ""


def test_a_line_without_end_takes_no_memory(typed):
    console, sent = typed
    for _ in range(50):
        console.feed(b"a" * 65536)
    assert len(console._rest) <= 4096
    console.feed(b"\nstop\n")
    assert sent == ["stop"]


def test_the_thread_reads_until_the_end(typed):
    console, sent = typed
    read, write = os.pipe()
    console.follow(read)
    os.write(write, b"arm\n" * 15_000 + b"stop\n")
    deadline = time.monotonic() + 10
    while sent != ["stop"] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert sent == ["stop"] and not console.closed
    os.close(write)
    while not console.closed and time.monotonic() < deadline:
        time.sleep(0.01)
    assert console.closed
    os.close(read)


def test_a_handle_that_does_not_wait_is_not_taken_for_closed(typed):
    console, sent = typed
    read, write = os.pipe()
    os.set_blocking(read, False)
    console.follow(read)
    threading.Timer(0.2, os.write, (write, b"stop\n")).start()
    deadline = time.monotonic() + 10
    while not sent and time.monotonic() < deadline:
        time.sleep(0.01)
    assert sent == ["stop"] and not console.closed
    os.close(write)
