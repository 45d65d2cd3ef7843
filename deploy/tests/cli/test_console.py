"""The console's loop: what it passes on, answers, and ends by."""

import pytest

from fingers_robot.cli.console import Console
from fingers_robot.cli.typed import Typed


class FakePolicy:
    def poll(self):
        return None


class FakeLauncher:
    def __init__(self):
        self.sent, self.status, self.policy = [], {}, FakePolicy()

    def send(self, word):
        self.sent.append(word)


@pytest.fixture
def session():
    launcher, said = FakeLauncher(), []
    typed = Typed(1, launcher.send)
    return Console(launcher, typed, said.append, False, None), launcher, typed, said


def test_refused_lines_are_answered_once_in_a_second(session):
    console, launcher, typed, said = session
    for k in range(400):
        typed.feed(b"\xff\xfe\npolicy x\n" + b"a" * 3000 + b"\n")
        console.serve(0.01 * k)
    assert launcher.sent == [] and len(said) == 4
    assert all(len(line) < 250 for line in said) and "before it" in said[1]


def test_words_are_passed_on(session):
    console, launcher, typed, _ = session
    typed.feed(b"clear\narm\n")
    console.serve(0.0)
    assert launcher.sent == ["clear", "arm"]


@pytest.mark.parametrize("lost", ["types", "reads"])
def test_a_console_at_which_nobody_is_quits_and_says_why(session, lost):
    console, launcher, _, said = session
    there = {"types": True, "reads": True}
    console.attend(lambda: there["types"], lambda: there["reads"])
    console._step()
    assert launcher.sent == []
    there[lost] = False
    console._step()
    console._step()
    assert launcher.sent == ["quit"] and "--unattended" in said[0]


def test_an_unattended_one_goes_on(session):
    console, launcher, typed, _ = session
    typed.closed = True
    console._step()
    assert launcher.sent == []


def test_a_stop_ends_the_arming_that_was_asked_for_beforehand():
    launcher, said = FakeLauncher(), []
    typed = Typed(1, launcher.send)
    console = Console(launcher, typed, said.append, True, None)
    launcher.status = {"mode": "disabled"}
    console._asked_s = -1e9
    console._step()
    typed.feed(b"stop\n")
    console._asked_s = -1e9
    console._step()
    assert launcher.sent == ["arm", "stop", "quit"]
