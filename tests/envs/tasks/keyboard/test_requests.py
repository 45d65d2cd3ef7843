"""Requests: gaps, first events, time-outs; and the measures made of them."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.config.settings.keyboard import KeyboardConfig
from envs.errors import InputError
from envs.tasks.keyboard.measures import press_measures
from envs.tasks.keyboard.model import KEY_NAMES
from envs.tasks.keyboard.requests import (
    IDLE,
    RequestConfig,
    begin_requests,
    judge,
    next_request,
    one_hot,
)

DT_S, CONFIG = 0.02, RequestConfig(idle_s=(0.1, 0.2), timeout_s=0.3)
KEYS = len(KEY_NAMES)


def pressed(*names):
    return jnp.array([name in names for name in KEY_NAMES])


def asking(name, steps=0):
    requests = begin_requests(jax.random.key(0), CONFIG, DT_S)
    return dataclasses.replace(
        requests, key=jnp.array(KEY_NAMES.index(name)), steps=jnp.array(steps)
    )


def values(outcome):
    names = ("hit", "wrong", "timeout", "stray")
    return {name: float(getattr(outcome, name)) for name in names}


NOTHING = {"hit": 0.0, "wrong": 0.0, "timeout": 0.0, "stray": 0.0}


@pytest.mark.parametrize(
    ("keys", "steps", "expected", "latency_s"),
    [
        ((), 3, {}, 0.0),
        (("up",), 3, {"hit": 1.0}, 0.08),
        (("right_shift",), 0, {"wrong": 1.0}, 0.02),
        (("up", "end"), 3, {"wrong": 1.0, "stray": 1.0}, 0.08),
        ((), 13, {}, 0.0),
        ((), 14, {"timeout": 1.0}, 0.3),
        (("up",), 14, {"hit": 1.0}, 0.3),  # in the last moment
    ],
)
def test_the_first_event_decides(keys, steps, expected, latency_s):
    outcome = judge(asking("up", steps), pressed(*keys), CONFIG, DT_S)
    assert values(outcome) == NOTHING | expected
    assert outcome.latency_s == pytest.approx(latency_s)


def test_keys_in_a_gap_decide_nothing():
    requests = dataclasses.replace(asking("up"), key=jnp.array(IDLE))
    assert not one_hot(requests).any()
    outcome = judge(requests, pressed("left", "enter"), CONFIG, DT_S)
    assert values(outcome) == NOTHING | {"stray": 2.0}


def test_half_of_the_episodes_begin_with_a_request():
    keys = jax.random.split(jax.random.key(5), 400)
    first = jax.vmap(lambda key: begin_requests(key, CONFIG, DT_S).key)(keys)
    counts = np.bincount(np.asarray(first) - IDLE, minlength=5)
    assert 160 < counts[0] < 240 and counts[1:].min() > 25


@pytest.fixture(scope="module")
def answered():
    """Requests of 4,000 steps that are answered in the fifth step, after each step."""

    def step(requests, key):
        hit = pressed(*KEY_NAMES[:4]) & (jnp.arange(KEYS) == requests.key)
        outcome = judge(requests, hit & (requests.steps == 4), CONFIG, DT_S)
        requests = next_request(key, requests, outcome.hit > 0, CONFIG, DT_S)
        return requests, (requests.key, requests.steps, outcome.hit)

    start = begin_requests(jax.random.key(1), CONFIG, DT_S)
    keys = jax.random.split(jax.random.key(2), 4000)
    return [np.asarray(x) for x in jax.lax.scan(step, start, keys)[1]]


def test_gap_and_request_alternate_and_all_keys_come_equally_often(answered):
    key, steps, hit = answered
    begins = np.flatnonzero((key != IDLE) & (steps == 0))
    counts = np.bincount(key[begins], minlength=4)
    assert len(counts) == 4 and counts.min() > 0.8 * counts.mean()
    gaps = np.diff(begins) - 5
    assert gaps.min() >= 5 and gaps.max() <= 10 and len(set(gaps)) > 3
    assert hit.sum() >= len(begins) - 1
    # The same key may come twice, and does.
    assert (np.diff(key[begins]) == 0).any()


def test_times_that_cannot_be_are_refused():
    with pytest.raises(InputError, match="idle_s"):
        RequestConfig(idle_s=(0.5, 0.1))
    with pytest.raises(InputError, match=r"requests\.idle_s"):
        KeyboardConfig(control_dt_s=0.05, requests=RequestConfig(idle_s=(0.02, 1.0)))
    with pytest.raises(InputError, match="weights"):
        KeyboardConfig(weights={"hitt": 1.0})


def recorded(steps=100):
    zero = np.zeros(steps)
    return {
        **{name: zero.copy() for name in ("hit", "wrong", "timeout", "stray")},
        "latency_s": zero.copy(),
        "tilt_deg": zero.copy(),
        "key_pressed": np.zeros((steps, KEYS)),
        "support_pos_w": np.zeros((steps, 4, 2)),
        "support_force_n": np.full((steps, 4), 2.0),
    }


def measured(trace, counts=None):
    counts = np.ones(100, bool) if counts is None else counts
    found = press_measures(jax.tree.map(jnp.asarray, trace), jnp.asarray(counts))
    return {name: float(value) for name, value in found.items()}


def test_measures_of_an_episode():
    trace = recorded()
    for step, latency in ((10, 0.1), (30, 0.2), (50, 0.4)):
        trace["hit"][step], trace["latency_s"][step] = 1, latency
    trace["wrong"][70] = trace["timeout"][90] = 1
    trace["latency_s"][[70, 90]] = 9.0
    trace["key_pressed"][[10, 30, 50], 3] = 1
    trace["key_pressed"][70, KEY_NAMES.index("right_shift")] = 1
    trace["stray"][80] = 1
    trace["tilt_deg"][20] = 5.0
    trace["support_pos_w"][50:] = [0.003, 0.004]
    trace["support_force_n"][50:75, 2] = 0.0
    trace["support_force_n"][90:, 0] = 0.0
    found = measured(trace)
    assert found["requests"] == 5 and found["correct_fraction"] == pytest.approx(0.6)
    assert found["latency_median_s"] == pytest.approx(0.2)
    assert 0.2 < found["latency_95_s"] <= 0.4
    wrong = {name: found[f"wrong_{name}"] for name in KEY_NAMES}
    assert wrong == dict.fromkeys(KEY_NAMES, 0.0) | {"right_shift": 1.0}
    assert (found["wrong_presses"], found["timeouts"]) == (1.0, 1.0)
    assert (found["stray_presses"], found["max_tilt_deg"]) == (1.0, 5.0)
    assert found["stance_drift_mm"] == pytest.approx(5.0, rel=1e-5)
    assert found["least_support_fraction"] == 0.75


def test_only_steps_that_count_are_measured():
    trace = recorded()
    trace["hit"][[10, 60]], trace["latency_s"][[10, 60]] = 1, 0.2
    trace["tilt_deg"][60:] = 90.0
    trace["support_pos_w"][40:] = 1.0
    trace["support_force_n"][40:] = 0.0
    found = measured(trace, np.arange(100) < 40)
    assert found["requests"] == 1 and found["max_tilt_deg"] == 0.0
    assert found["stance_drift_mm"] == 0.0
    assert found["least_support_fraction"] == 1.0
    empty = measured(trace, np.zeros(100, bool))
    assert np.isnan(empty["correct_fraction"]) and np.isnan(empty["latency_median_s"])
