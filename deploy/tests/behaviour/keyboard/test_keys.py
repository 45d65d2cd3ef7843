"""The list of keys: gaps, first events, time-outs, retries."""

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.keyboard.keys import (
    ARROWS,
    KeyTimes,
    begin_keys,
    keys_step,
)

DT_S = 0.02
TIMES = KeyTimes(idle_s=0.1, timeout_s=0.3)


def play(keys, keyboard, times=TIMES, limit=1000):
    """Steps until done; `keyboard` answers (state, time) with the keys pressed."""
    state, requests = begin_keys(keys, 0.0), []
    for tick in range(limit):
        requests.append(state.request)
        if state.done:
            return state, np.array(requests)
        t = (tick + 1) * DT_S
        state = keys_step(state, keyboard(state, t), t, times)
    raise AssertionError("never done")


def after(delay_s, answer):
    """A keyboard on which `answer` goes down so long after a request."""

    def keyboard(state, t):
        waited = t - state.since_s
        due = state.asking and waited >= delay_s - 1e-9
        return (answer(state.keys[0]),) if due else ()

    return keyboard


def test_a_good_hand_plays_the_list():
    keys = ("up", "up", "left", "down", "right")
    state, requests = play(keys, after(0.2, lambda asked: asked))
    assert [o.asked for o in state.outcomes] == list(keys)
    assert all(o.correct for o in state.outcomes)
    assert [o.latency_s for o in state.outcomes] == pytest.approx([0.2] * 5)
    assert set(requests.sum(axis=1)) == {0.0, 1.0}
    starts = np.flatnonzero(np.diff(requests.sum(axis=1)) > 0) + 1
    assert [ARROWS[requests[i].argmax()] for i in starts] == list(keys)
    # Between two requests lies the gap, in which nothing is asked.
    assert np.diff(starts) == pytest.approx(np.full(4, (0.2 + 0.1) / DT_S))


def test_the_first_event_decides_and_a_wrong_key_is_not_asked_for_again():
    def two_keys(state, t):
        return ("right_shift", "up") if state.asking else ()

    times = KeyTimes(idle_s=0.1, timeout_s=0.3, retries=5)
    state, _ = play(("up", "left"), two_keys, times)
    assert [(o.pressed, o.correct) for o in state.outcomes] == [
        ("right_shift", False),
        ("right_shift", False),
    ]


def test_a_key_in_a_gap_decides_nothing():
    def stray(state, t):
        return () if state.asking else ("down",)

    state, _ = play(("down",), stray)
    assert [(o.pressed, o.latency_s) for o in state.outcomes] == [
        ("", pytest.approx(0.3))
    ]


@pytest.mark.parametrize("retries", [0, 2])
def test_time_outs_are_retried_as_often_as_asked(retries):
    times = KeyTimes(idle_s=0.1, timeout_s=0.3, retries=retries)
    state, _ = play(("up", "left"), after(9.0, str), times)
    assert [o.asked for o in state.outcomes] == ["up"] * (retries + 1) + ["left"] * (
        retries + 1
    )
    assert all(o.pressed == "" and not o.correct for o in state.outcomes)


def test_a_retry_that_works_goes_on_with_the_next_key():
    def second_time(state, t):
        return (state.keys[0],) if state.asking and state.tries else ()

    times = KeyTimes(idle_s=0.1, timeout_s=0.3, retries=1)
    state, _ = play(("up", "left"), second_time, times)
    assert [(o.asked, o.pressed) for o in state.outcomes] == [
        ("up", ""),
        ("up", "up"),
        ("left", ""),
        ("left", "left"),
    ]


def test_an_unknown_key_is_refused_and_an_empty_list_is_done():
    with pytest.raises(InputError, match=r"keys: 1: found space; valid: one of left"):
        begin_keys(("up", "space"), 0.0)
    state = begin_keys((), 0.0)
    assert state.done and not state.request.any()
    assert keys_step(state, ("up",), 9.0, TIMES) == state
