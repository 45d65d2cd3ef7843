"""Stops, with real processes in real time; `fault_matrix.py` has a hundred of each."""

import subprocess
import sys
import time

import pytest
from faults.channels import CHANNELS, fail_channel, stop_hand
from faults.console_run import ConsoleRun, energize
from faults.watched_hand import WatchedHand

QUICK = (
    "S13 console and supervisor killed",
    "S13 console stopped, supervisor killed",
    "OP standard input closed",
    "OP standard output unread",
)
_MORE_S = 2.0  # for a machine that is busy with other tests; the matrix allows nothing


@pytest.mark.parametrize("name", QUICK)
def test_whoever_dies_or_is_not_there_the_hand_is_off(hand_model, marching_dir, name):
    channel = next(c for c in CHANNELS if c.name == name)
    off = fail_channel(hand_model, marching_dir, channel, 0)
    assert off.safe and off.off_s <= channel.within_s + _MORE_S, off


def test_a_hand_that_is_stopped_for_ever_is_no_hand_that_is_off(
    hand_model, marching_dir
):
    assert stop_hand(hand_model, marching_dir, 0).safe


def test_a_flood_is_answered_now_and_then_and_stopped_at_once(
    hand_model, marching_dir, marching
):
    """Words of all kinds, of which none ends a process, and a stop behind them."""
    words = "arm\nclear\npolicy 2147483648\npolicy ²\nárm\n\x00\n" + "a" * 3000 + "\n"
    with (
        WatchedHand(hand_model, marching.manifest.interface) as hand,
        ConsoleRun(marching_dir, hand.path, ["--no-record"]) as run,
    ):
        energize(run)
        before = len(run.lines)
        for _ in range(100):
            run.type(words)
        typed_s = run.type("off\n")
        deadline = time.monotonic() + 10
        while hand.energized and time.monotonic() < deadline:
            time.sleep(0.01)
        assert hand.off_after(typed_s) < 1.0
        run.wait_for("de-energized, confirmed", 10.0)
        assert len(run.lines) - before < 30
        run.type("quit\n")
        assert run.process.wait(timeout=30) in (0, 5)
        assert not any("Traceback" in line for _, line in run.lines)


@pytest.mark.parametrize("closed", ["stdin=subprocess.DEVNULL", "preexec_fn=close"])
def test_a_run_without_an_operator_is_refused(marching_dir, closed):
    program = (
        "import os, subprocess, sys\n"
        "def close(): os.close(0)\n"
        "done = subprocess.run([sys.executable, '-m', 'fingers_robot', 'run', "
        f"sys.argv[1], '--driver', 'sim', '--model', 'x', '--arm'], {closed}, "
        "capture_output=True, text=True)\n"
        "print(done.returncode, done.stderr, end='')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(marching_dir)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == (
        "2 fingers-deploy: standard input: found closed; valid: a terminal or a pipe "
        "for the operator, or --unattended\n"
    )


@pytest.mark.slow
@pytest.mark.parametrize("channel", CHANNELS, ids=[c.name for c in CHANNELS])
def test_every_channel(hand_model, marching_dir, channel):
    for seed in range(3):
        off = fail_channel(hand_model, marching_dir, channel, seed)
        assert off.safe and off.off_s <= channel.within_s, (seed, off)
