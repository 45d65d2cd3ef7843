"""Progress: JSON lines where output is kept, a live picture on a terminal."""

import io
import json
import time

import pytest
from rich.console import Console

from fingers_mjx.training.progress import QUIET_S, Ticker, reporter
from fingers_mjx.training.progress_table import Board, clock

ROW = {
    "event": "progress",
    "iteration": 30,
    "iterations": 120,
    "env_steps": 1_234_567,
    "steps_per_s": 98_765.0,
    "eta_s": 3723.0,
    "episode/return": 4.5,
    "kl": 0.0123,
    "reward/lift": 0.25,
    "reward/track": 1.5,
}


def drawn(board):
    console = Console(file=io.StringIO(), width=120)
    console.print(board.render())
    return console.file.getvalue()


def test_lines_of_json_where_there_is_no_terminal():
    stream = io.StringIO()
    with reporter(stream) as show:
        show(ROW)
        show({"event": "note", "text": "a\nb"})
    lines = stream.getvalue().splitlines()
    assert [json.loads(line)["event"] for line in lines] == ["progress", "note"]


def test_compilation_is_reported_now_and_then():
    stream = io.StringIO()
    with reporter(stream) as show:
        for second in range(25):
            show({"event": "compiling", "elapsed_s": second})
    times = [json.loads(x)["elapsed_s"] for x in stream.getvalue().splitlines()]
    assert times == [0, QUIET_S, 2 * QUIET_S]


def test_terminal_gets_a_picture():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    with reporter(stream) as show:
        show(ROW)
        show({"event": "checkpoint", "path": "runs/x", "iteration": 30})
    assert "saved runs/x" in stream.getvalue()
    assert "{" not in stream.getvalue()


def test_picture_holds_the_figures():
    board = Board()
    assert "compiling… 0 s" in drawn(board)
    board.take({"event": "compiling", "elapsed_s": 12.3})
    assert "compiling… 12 s" in drawn(board)
    board.take(ROW)
    picture = drawn(board)
    for part in ("30/120", "1,234,567", "98,765 steps/s", "ETA 1:02:03", "0.0123"):
        assert part in picture
    assert picture.index("reward/lift") < picture.index("reward/track")
    assert picture.count("━") == 6  # a quarter of 24


def test_picture_of_a_population_has_a_line_for_each_member():
    board = Board()
    for name, iteration in (("01", 30), ("00", 10)):
        board.take(ROW | {"member": name, "iteration": iteration})
    lines = drawn(board).splitlines()
    for part in ("30/120", "2,469,134 steps", "197,530 steps/s"):  # of both together
        assert part in lines[0]
    assert [line.split()[:2] for line in lines[2:]] == [["00", "10"], ["01", "30"]]


def test_first_row_may_lack_speed_and_time_left():
    board = Board()
    row = {k: v for k, v in ROW.items() if k not in ("steps_per_s", "eta_s")}
    board.take(row)
    assert "ETA" not in drawn(board)


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00:00"), (36061.6, "10:01:02")])
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_ticker_counts_until_it_is_stopped():
    events = []
    with Ticker(events.append, 0.02) as ticker:
        time.sleep(0.2)
        ticker.stop()
        number = len(events)
        time.sleep(0.1)
    assert len(events) == number >= 3
    times_s = [e["elapsed_s"] for e in events]
    assert times_s[0] == 0.0
    assert times_s == sorted(times_s)
