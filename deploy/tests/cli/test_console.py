"""What an operator types, however it arrives."""

import os
import sys

import pytest

from fingers_robot.cli.console import Console


class FakeLauncher:
    def __init__(self):
        self.sent, self.status = [], {}

    def send(self, word):
        self.sent.append(word)


@pytest.fixture
def typed(monkeypatch):
    """A console whose standard input is a pipe."""
    read, write = os.pipe()
    with os.fdopen(read) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        launcher = FakeLauncher()
        yield Console(launcher, False, None), launcher.sent, write
    os.close(write)


def test_lines_that_come_together_all_count(typed):
    console, sent, write = typed
    os.write(write, b"arm\nclear\n  policy   1\nstop\n")
    console._read_input()
    assert sent == ["arm", "clear", "policy 1", "stop"]


def test_half_a_line_waits_without_holding_up_anything(typed):
    console, sent, write = typed
    os.write(write, b"st")
    console._read_input()
    console._read_input()
    assert sent == []
    os.write(write, b"op\narm")
    console._read_input()
    assert sent == ["stop"]


def test_noise_is_answered_by_what_may_be_typed(typed, capsys):
    console, sent, write = typed
    os.write(write, b"\xff\xfe\n\npolicy x\n" + b"a" * 3000 + b"\n")
    console._read_input()
    assert sent == []
    assert capsys.readouterr().out.count("type: arm") == 3
