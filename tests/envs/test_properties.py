"""What holds for any input of the environments (F7)."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support.properties import counts, holds

from envs.config.typed import dump_yaml, from_dict, load_yaml, override, to_dict
from envs.hand.hand_file import HandFile, load_hand_file, save_hand_file
from envs.hand.nominal import vendor_hand
from envs.hand.quantity import JointQuantity
from envs.randomize import RandomizeConfig
from envs.registry import make_env
from envs.tasks.crawl import CrawlConfig

ENV = make_env("crawl")
HAND = load_hand_file()
JOINTS = vendor_hand().joint_names
ANY = arrays(np.float32, 20, elements=st.floats(width=32))
LOW, HIGH = np.asarray(ENV.plant.joint_range).T
INSIDE = arrays(np.float32, 20, elements=st.floats(0, 1, width=32)).map(
    lambda share: np.float32(LOW + share * (HIGH - LOW))
)


@jax.jit
def target_of(target, action):
    clip = ENV.config.action_clip
    clipped = jnp.clip(action, -clip, clip)
    return ENV.plant.next_target(target, clipped, ENV.config.action_scale_rad)


@counts
def test_a_target_is_in_its_limits_whatever_the_action(count):
    """Any float32; NaN alone passes as NaN, by which the step becomes invalid."""

    def check(target, action):
        after = np.asarray(target_of(target, action))
        unknown = np.isnan(action)
        np.testing.assert_array_equal(np.isnan(after), unknown)
        known = after[~unknown]
        assert (known >= LOW[~unknown]).all() and (known <= HIGH[~unknown]).all()
        moved = np.abs(known - np.clip(target, LOW, HIGH)[~unknown])
        assert (moved <= ENV.config.action_scale_rad + 1e-6).all()

    holds(count, check, INSIDE, ANY)


@counts
def test_joints_by_name_are_joints_in_order(count):
    """A reordering of the names undoes itself."""

    def check(order, values):
        named = {JOINTS[i]: float(values[i]) for i in order}
        quantity = JointQuantity(named, "1", "user")
        np.testing.assert_array_equal(quantity.per_joint(JOINTS), values.astype(float))

    finite = arrays(np.float32, 20, elements=st.floats(-1e6, 1e6, width=32))
    holds(count, check, st.permutations(range(20)), finite)


def between(low, high):
    return st.floats(low, high, allow_nan=False)


@st.composite
def hands(draw):
    scale = st.one_of(
        between(0.01, 30),
        st.lists(between(0.01, 30), min_size=20, max_size=20),
        st.permutations(JOINTS).flatmap(
            lambda names: st.fixed_dictionaries(
                {name: between(0.01, 30) for name in names}
            )
        ),
    )
    values = {
        "palm_mass": draw(between(0.01, 5)),
        "payload_pos": draw(st.lists(between(-0.2, 0.2), min_size=3, max_size=3)),
        "stiffness_scale": draw(scale),
        "torque_scale": draw(between(0.001, 10)),
        "delay_s": draw(between(0, 0.2)),
    }
    data = to_dict(HAND)
    data["name"] = draw(st.text(st.characters(codec="utf-8", exclude_categories=["C"])))
    for name, value in values.items():
        data[name] = data[name] | {"value": value, "low": None, "high": None}
    return from_dict(HandFile, data, "memory")


@counts
def test_a_hand_file_is_read_as_it_was_written(count, tmp_path):
    def check(hand):
        save_hand_file(hand, tmp_path / "hand.yaml")
        again = load_hand_file(tmp_path / "hand.yaml")
        assert again == hand and again.sha256 == hand.sha256

    holds(count // 3, check, hands())


def ordered(low, high):
    return st.lists(between(low, high), min_size=2, max_size=2).map(
        lambda pair: tuple(sorted(pair))
    )


@counts
def test_settings_are_read_as_they_were_written(count, tmp_path):
    make = partial(dataclasses.replace, CrawlConfig())
    configs = st.builds(
        make,
        episode_s=between(0.1, 1e4),
        control_dt_s=st.sampled_from([0.005, 0.01, 0.02, 0.025]),
        weights=st.dictionaries(st.sampled_from(["lift", "torque"]), between(-9, 9)),
        randomize=st.builds(
            RandomizeConfig,
            tip_friction=ordered(0, 10),
            gain_scale=ordered(0.01, 10),
            imu_tilt_rad=between(0, 3),
        ),
        contacts_per_world=st.integers(1, 10**6),
    )

    def check(config):
        path = tmp_path / "config.yaml"
        path.write_text(dump_yaml(config), encoding="utf-8")
        assert load_yaml(CrawlConfig, path) == config

    holds(count // 3, check, configs)


def test_a_written_file_with_one_digit_changed_is_another(tmp_path):
    """Negative control of both."""
    path = tmp_path / "hand.yaml"
    save_hand_file(HAND, path)
    path.write_text(path.read_text("utf-8").replace("0.38908", "0.38909"), "utf-8")
    assert load_hand_file(path) != HAND
    changed = override(CrawlConfig(), ["episode_s=20.000001"])
    assert from_dict(CrawlConfig, to_dict(changed), "memory") != CrawlConfig()


@pytest.mark.parametrize("joint", [0, 19])
def test_the_limits_are_those_of_the_hand(joint):
    """Negative control: the target can reach the limit and is stopped by it."""
    target = np.clip(np.zeros(20, np.float32), LOW, HIGH)
    action = np.zeros(20, np.float32)
    action[joint] = np.inf
    for _ in range(100):
        target = np.asarray(target_of(target, action))
    assert target[joint] == HIGH[joint] and target[1] != HIGH[1]
