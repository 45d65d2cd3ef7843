import dataclasses
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from fingers_robot.behaviour.exchange import Answer, Query, padded
from fingers_robot.drivers.open import _OPENERS
from fingers_robot.runtime.console import ALIVE, SILENCE_S, ConsoleLink
from fingers_robot.runtime.guard import guard_hand
from fingers_robot.runtime.link import (
    ANSWER,
    PolicyEnd,
    SupervisorEnd,
    decode_answer,
    encode_answer,
    make_link,
)
from fingers_robot.runtime.stats import LoopStats, Timing
from fingers_robot.runtime.ticker import Ticker
from fingers_robot.safety import Operator, PolicyFault, Proposal

QUERY = Query(
    tick=7,
    t_s=3.5,
    joint_pos=np.arange(20.0),
    quat_w=np.array([1.0, 0.0, 0.0, np.nan]),
    gyro_b=np.array([0.1, 0.2, 0.3]),
    target_rad=np.arange(20.0) / 7,
    runs=True,
    policy=1,
    key=3,
    turned_rad=-0.25,
    challenge=2**63 + 5,
)


def answered(proposal, inputs=(), policy=0):
    return Answer(proposal, padded(np.array(inputs, np.float32)), policy)


class Fake:
    """A clock that sleeping moves, by exactly what was asked and a little more."""

    def __init__(self, oversleep=0.0):
        self.t, self.oversleep = 50.0, oversleep

    def __call__(self):
        return self.t

    def sleep(self, seconds):
        assert seconds > 0
        self.t += seconds + self.oversleep


def test_deadlines_are_absolute_and_do_not_drift():
    clock = Fake(oversleep=0.0003)
    ticker = Ticker(0.02, clock, clock.sleep)
    for k in range(1, 2000):
        clock.t += 0.0037  # work
        tick = ticker.wait()
        assert (tick.number, tick.skipped) == (k, 0)
        assert tick.late_s == pytest.approx(0.0003, abs=1e-9)
        assert tick.t_s == pytest.approx(50.0 + 0.02 * k + 0.0003, abs=1e-9)


def test_missed_deadlines_are_skipped_never_caught_up():
    clock = Fake()
    ticker = Ticker(0.02, clock, clock.sleep)
    ticker.wait()
    clock.t += 0.107
    tick = ticker.wait()
    assert (tick.number, tick.skipped) == (6, 4)
    assert tick.late_s == pytest.approx(0.007)
    times = [ticker.wait() for _ in range(5)]
    assert [t.number for t in times] == [7, 8, 9, 10, 11]
    assert all(t.skipped == 0 for t in times)
    gaps = np.diff([t.t_s for t in times])
    np.testing.assert_allclose(gaps, 0.02, atol=1e-9)


def test_a_little_late_is_not_skipped():
    clock = Fake()
    ticker = Ticker(0.02, clock, clock.sleep)
    ticker.wait()
    clock.t += 0.0399
    tick = ticker.wait()
    assert (tick.number, tick.skipped) == (2, 0)
    assert tick.late_s == pytest.approx(0.0199)


def test_timing_quantiles_and_counts():
    timing, rng = Timing(), np.random.default_rng(4)
    values = rng.exponential(0.002, 5000)
    for value in values:
        timing.add(value)
    for share in (0.5, 0.99, 0.999):
        assert timing.quantile(share) == pytest.approx(
            np.quantile(values, share), abs=2e-4
        )
    assert timing.quantile(1.0) == values.max()
    assert timing.above(0.005) == (values >= 0.005).sum()
    assert timing.worst_s == values.max() and timing.count == 5000
    timing.add(7.0)
    assert timing.quantile(0.9999) == 7.0  # beyond the last bin
    timing.add(-1.0)
    assert timing.worst_s == 7.0 and timing.count == 5002


def test_histograms_are_found_without_their_empty_bins():
    stats = LoopStats()
    for late_s in (0.00025, 0.00021, 0.0071, 3.0):
        stats.step(late_s, 0, late_s)
    found = stats.histograms()
    assert found["late_histogram"] == "0.2: 2, 7.1: 1, 100.0: 1"
    assert found["gap_histogram"] == found["answer_histogram"] == ""


def test_more_than_one_percent_of_late_steps_warns():
    stats = LoopStats()
    for k in range(1000):
        stats.step(0.0, 0, 0.006 if k % 125 == 0 else 0.0)
    assert not stats.warning
    for k in range(500):
        stats.step(0.0, 0, 0.006 if k % 50 == 0 else 0.0)
    assert stats.warning
    stats.step(0.0, 3, 0.0)
    assert stats.summary()["skipped"] == 3
    assert stats.summary()["late_over_5ms"] == 18


def test_link_carries_answers_and_keeps_the_newest():
    left, right = make_link()
    end = SupervisorEnd(left)
    assert end.poll() is None and end.open
    for tick in (1, 2):
        proposal = Proposal(tick, tick + 7, np.arange(20.0) + tick, 0.25)
        right.send(encode_answer(answered(proposal, (0.1, 0.2), 1)))
    answer = end.poll()
    assert (answer.proposal.tick, answer.proposal.response, answer.policy) == (2, 9, 1)
    np.testing.assert_array_equal(answer.proposal.target_rad, np.arange(20.0) + 2)
    assert answer.proposal.command_age_s == 0.25
    np.testing.assert_array_equal(answer.command, answered(None, (0.1, 0.2)).command)
    right.close()
    assert end.poll() is None and not end.open


def test_link_carries_queries_and_keeps_the_newest():
    left, right = make_link()
    supervisor, policy = SupervisorEnd(left), PolicyEnd(right)
    assert policy.wait(0.0) is None and policy.open
    supervisor.send(dataclasses.replace(QUERY, tick=6))
    supervisor.send(QUERY)
    found = policy.wait(0.0)
    for field in dataclasses.fields(Query):
        wanted = getattr(QUERY, field.name)
        np.testing.assert_array_equal(getattr(found, field.name), wanted)
    left.close()
    assert policy.wait(0.0) is None and not policy.open


def test_a_link_that_nobody_reads_blocks_nothing():
    left, right = make_link()
    end = SupervisorEnd(left)
    for _ in range(5000):
        end.send(QUERY)
    assert end.open
    right.close()
    end.send(QUERY)
    assert not end.open


def test_a_policy_that_floods_the_link_does_not_hold_up_the_loop():
    left, right = make_link()
    end = SupervisorEnd(left)
    for tick in range(100):
        right.send(encode_answer(answered(Proposal(tick, 0, np.zeros(20)))))
    ticks = []
    while (answer := end.poll()) is not None:
        ticks.append(answer.proposal.tick)
    assert ticks[0] == 15 and ticks[-1] == 99 and len(ticks) == 7


def test_half_an_answer_and_noise_are_no_proposal():
    left, right = make_link()
    end, rng = SupervisorEnd(left), np.random.default_rng(0)
    right.send(b"half")
    assert end.poll() is None
    for _ in range(300):
        answer = decode_answer(rng.bytes(ANSWER.itemsize))
        assert len(answer.proposal.target_rad) <= 20
        assert isinstance(answer.proposal.fault, PolicyFault)


def test_partial_answers_keep_their_length():
    data = encode_answer(answered(Proposal(1, 2, np.zeros(7))))
    assert decode_answer(data).proposal.target_rad.shape == (7,)


def test_console_actions_and_its_loss():
    left, right = make_link()
    console = ConsoleLink(left, policies=4)
    assert console.poll(0.0) == Operator.NONE
    for word in ("policy 3", "nonsense", "arm"):
        right.send(word.encode())
    assert console.poll(0.0) == Operator.ARM and console.selected == 3
    console.report({"mode": "active"})
    assert right.recv(100) == b'{"mode": "active"}'
    right.close()
    assert console.poll(0.0) == Operator.STOP and console.quitting


@pytest.mark.parametrize("later", ["clear", "arm", "status"])
@pytest.mark.parametrize(
    ("word", "asked"), [("stop", Operator.STOP), ("off", Operator.OFF)]
)
def test_a_stop_outlasts_what_is_typed_after_it(word, asked, later):
    left, right = make_link()
    console = ConsoleLink(left)
    for each in ("arm", word, later):
        right.send(each.encode())
    assert console.poll(0.0) == asked


@pytest.mark.parametrize("words", [("stop", "off"), ("off", "stop"), ("off", "quit")])
def test_off_is_more_than_stop(words):
    left, right = make_link()
    console = ConsoleLink(left)
    for each in words:
        right.send(each.encode())
    assert console.poll(0.0) == Operator.OFF


@pytest.mark.parametrize(
    "word",
    [
        *("policy 2", "policy 2147483648", "policy -1", "policy ²", "policy"),
        *("policy 1_0", "key", "key x", "\x00", "policy " + "9" * 60_000),
        *("turn", "turn x", "turn nan", "turn 1e2", "turn 181", "turn 1 2"),
    ],
)
def test_words_that_no_console_sends_change_nothing(word):
    left, right = make_link()
    console = ConsoleLink(left, policies=2)
    right.send(word.encode())
    assert console.poll(0.0) == Operator.NONE
    assert console.selected is None and not console.keys
    assert console.turned_rad == 0.0


def test_turns_add_up():
    left, right = make_link()
    console = ConsoleLink(left)
    for word in ("turn 30", "turn -7.5", "turn 90"):
        right.send(word.encode())
    console.poll(0.0)
    assert console.turned_rad == pytest.approx(np.radians(112.5))


def test_a_console_that_falls_silent_is_gone():
    left, right = make_link()
    console = ConsoleLink(left)
    assert console.poll(100.0) == Operator.NONE  # one that has not begun is not silent
    right.send(ALIVE.encode())
    assert console.poll(101.0) == Operator.NONE
    assert console.poll(101.0 + SILENCE_S) == Operator.NONE
    assert console.poll(101.1 + SILENCE_S) == Operator.STOP and console.quitting


def test_keys_that_wait_are_bounded():
    left, right = make_link()
    console = ConsoleLink(left)
    for _ in range(10):
        for _ in range(60):
            right.send(b"key up")
        console.poll(0.0)
    assert len(console.keys) == 64


def test_an_impossible_number_of_joints_is_none():
    data = bytearray(encode_answer(answered(Proposal(1, 2, np.zeros(20)))))
    place = ANSWER.fields["joints"][1]
    for joints in (21, 25, -1, 2**31 - 1):
        data[place : place + 4] = joints.to_bytes(4, "little", signed=True)
        assert decode_answer(bytes(data)).proposal.target_rad.size == 0


def test_a_hand_that_cannot_be_opened_is_said_to_need_its_battery_cut(
    interface, monkeypatch
):
    def gone(options, interface):
        raise RuntimeError("the library gave up")

    monkeypatch.setitem(_OPENERS, "sim", gone)
    safe, words = guard_hand({"kind": "sim"}, interface)
    assert not safe and "gave up" in words and "CUT THE BATTERY" in words


_PREFER = """
import gc, os, sys, threading, time
threading.Thread(target=time.sleep, args=(5,), daemon=True).start()
from fingers_robot.runtime.realtime import prefer_this_process
if sys.argv[1] == "refused":
    def refuse(*args):
        raise PermissionError(1, "Operation not permitted")
    os.sched_setscheduler = refuse
print(prefer_this_process(ask=sys.argv[1] != "unasked"))
print(gc.isenabled(), gc.get_freeze_count() > 0)
ids = [t.native_id for t in threading.enumerate()]
print(*(os.sched_getscheduler(i) for i in ids))
"""


@pytest.mark.parametrize("case", ["asked", "refused", "unasked"])
def test_what_was_obtained_is_reported(case):
    done = subprocess.run(
        [sys.executable, "-c", _PREFER, case],
        capture_output=True,
        text=True,
        check=True,
    )
    said, collector, policies = done.stdout.splitlines()
    assert collector == "False True"
    if case != "asked":
        assert said.startswith("no real-time priority (")
        assert policies == "0 0"
    else:
        obtained = policies == f"{os.SCHED_FIFO} {os.SCHED_FIFO}"
        assert said == "SCHED_FIFO 50" if obtained else "no real-time" in said


@pytest.mark.parametrize(
    "number",
    ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGTTIN", "SIGTTOU"],
)
def test_an_interrupt_does_not_reach_the_hand_first(number):
    program = (
        "import os, signal;"
        "from fingers_robot.runtime.signals import ignore_interrupts;"
        f"ignore_interrupts(); os.kill(os.getpid(), signal.{number}); print('alive')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True
    )
    assert done.stdout == "alive\n" and done.returncode != -signal.SIGINT
