"""Requests for keys while a policy runs, and key events from the kernel's device."""

import contextlib
import os
import struct

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.keyboard.events import Keyboard
from fingers_robot.behaviour.keyboard.keys import ARROWS
from fingers_robot.behaviour.keyboard.runner import KeyRunner

DT = 0.02


class Typed:
    """A keyboard on which the requested key goes down some time after the request."""

    def __init__(self):
        self.lost, self.next = False, ()

    def poll(self):
        pressed, self.next = self.next, ()
        return pressed


def play(runner, typed, steps, may_ask=lambda k: True, wrong=False):
    asked = []
    for k in range(steps):
        request = runner.step(5.0 + k * DT, may_ask(k))
        asked.append(ARROWS[int(request.argmax())] if request.any() else "")
        if asked[-20:] == [asked[-1]] * 20 and asked[-1]:
            typed.next = ("key 30",) if wrong else (asked[-1],)
    return asked


def names(asked):
    return [a for a, b in zip(asked, ["", *asked], strict=False) if a and a != b]


def test_a_list_is_asked_for_one_key_after_another():
    typed = Typed()
    runner = KeyRunner(("left", "up"), typed)
    assert names(play(runner, typed, 200)) == ["left", "up"]
    assert runner.story() == "keys: 2 of 2 correct, median latency 0.40 s"


def test_another_key_is_a_miss():
    typed = Typed()
    runner = KeyRunner(("left",), typed)
    play(runner, typed, 200, wrong=True)
    assert runner.story() == "keys: 0 of 1 correct"


def test_without_a_keyboard_requests_end_by_their_time_out():
    runner = KeyRunner(("left", "down"))
    assert names(play(runner, Typed(), 400)) == ["left", "down"]
    assert runner.story() == "keys: 2 asked for; no --keyboard reported which came"


def test_while_it_may_not_ask_nothing_is_asked_and_nothing_is_lost():
    typed = Typed()
    runner = KeyRunner(("left", "up"), typed)
    asked = play(runner, typed, 300, may_ask=lambda k: not 40 <= k < 100)
    assert asked[39] and not any(asked[40:100])
    # What was under way then is asked for again, after a gap.
    assert names(asked) == ["left", "left", "up"]
    assert runner.story().startswith("keys: 2 of 2")


def test_the_operator_adds_keys_and_nonsense_adds_none():
    typed = Typed()
    runner = KeyRunner((), typed)
    assert not any(play(runner, typed, 50)) and runner.story() == ""
    for key in (ARROWS.index("right"), 99, -1):
        runner.ask(key)
    assert names(play(runner, typed, 100)) == ["right"]


def test_unknown_keys_are_refused():
    with pytest.raises(InputError, match="enter"):
        KeyRunner(("enter",))


@pytest.fixture
def device(tmp_path):
    path = tmp_path / "event0"
    os.mkfifo(path)
    keyboard = Keyboard(str(path))
    end = os.open(path, os.O_WRONLY)
    yield keyboard, end
    with contextlib.suppress(OSError):  # a test has closed it
        os.close(end)


def event(end, kind, code, value):
    os.write(end, struct.pack("<qqHHi", 1, 2, kind, code, value))


def test_key_events_of_the_kernel(device):
    keyboard, end = device
    assert keyboard.poll() == ()
    for kind, code, value in (
        (4, 4, 458832),  # scan code
        (1, 105, 1),
        (0, 0, 0),
        (1, 105, 2),  # repeats by itself
        (1, 105, 0),
        (1, 103, 1),
        (1, 30, 1),
    ):
        event(end, kind, code, value)
    assert keyboard.poll() == ("left", "up", "key 30")
    assert not keyboard.lost


def test_a_keyboard_that_is_unplugged_is_lost(device):
    keyboard, end = device
    os.close(end)
    assert keyboard.poll() == () and keyboard.lost
    assert keyboard.poll() == ()


def test_a_missing_keyboard_is_refused(tmp_path):
    with pytest.raises(InputError, match="a keyboard"):
        Keyboard(str(tmp_path / "none"))


def test_a_request_is_a_one_hot_vector_in_the_order_of_training():
    runner = KeyRunner(("up",))
    runner.step(0.0, True)
    request = runner.step(1.0, True)
    np.testing.assert_array_equal(request, [0.0, 0.0, 0.0, 1.0])
