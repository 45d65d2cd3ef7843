import dataclasses
import math
import os
import random

import numpy as np
import pytest

from envs.actuator.catalogue import CATALOGUE
from envs.config.typed import dump_yaml, from_dict, override, to_dict
from envs.errors import InputError
from envs.hand.hand_file import (
    DEFAULT_HAND_FILE,
    Effect,
    HandFile,
    load_hand_file,
    save_hand_file,
)
from envs.hand.nominal import vendor_hand
from envs.hand.quantity import Quantity

SEED = 20260102
HAND = load_hand_file()
JOINTS = vendor_hand().joint_names


def test_masses_are_those_of_the_weighed_hand():
    links = sum(vendor_hand().per_joint("mass"))
    assert HAND.palm_mass.value + links == pytest.approx(0.738, abs=1e-9)
    total = HAND.palm_mass.value + links + HAND.payload_mass.value
    assert total == pytest.approx(0.818, abs=1e-9)


def test_payload_lies_on_the_back():
    front = HAND.payload_pos.value[0] + HAND.payload_size.value[0] / 2
    assert front == pytest.approx(vendor_hand().palm.bounds_min[0], abs=1e-9)


def test_damping_keeps_the_nominal_damping_ratio():
    """kd / (2 sqrt(kp I)) does not change when kp is scaled by s and kd by sqrt(s)."""
    expected = math.sqrt(HAND.per_joint("stiffness_scale")[0])
    np.testing.assert_allclose(HAND.per_joint("damping_scale"), expected, rtol=1e-6)


def test_abduction_is_slower():
    speeds = HAND.per_joint("speed_limit").reshape(5, 4)
    np.testing.assert_array_equal(speeds, np.tile([2.8, 2.5, 2.8, 2.8], (5, 1)))


def test_default_file_is_written_back_byte_for_byte(tmp_path):
    save_hand_file(HAND, tmp_path / "hand.yaml")
    assert (tmp_path / "hand.yaml").read_bytes() == DEFAULT_HAND_FILE.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["hand.yaml"]


def test_random_hands_survive_a_round_trip_exactly(tmp_path):
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    for _ in range(20):
        scales = [float(scale) for scale in rng.uniform(1, 30, 20)]
        as_dict = dict(zip(JOINTS, scales, strict=True))
        data = to_dict(HAND)
        data["stiffness_scale"] |= {"value": scales, "low": None, "high": as_dict}
        data["torque_scale"]["value"] = {k: v / 30 for k, v in as_dict.items()}
        data["delay_s"]["value"] = float(rng.uniform(0, 0.2))
        hand = from_dict(HandFile, data, "memory")
        save_hand_file(hand, tmp_path / "hand.yaml")
        assert load_hand_file(tmp_path / "hand.yaml") == hand
        assert load_hand_file(tmp_path / "hand.yaml").sha256 == hand.sha256


def test_forms_of_a_per_joint_quantity_agree():
    values = np.arange(1.0, 21.0)
    shuffled = list(range(20))
    random.Random(SEED).shuffle(shuffled)
    by_name = {JOINTS[i]: float(values[i]) for i in shuffled}
    forms = (tuple(values.tolist()), by_name)
    for form in forms:
        scale = dataclasses.replace(
            HAND.stiffness_scale, value=form, low=None, high=None
        )
        np.testing.assert_array_equal(scale.per_joint(JOINTS), values)
    scalar = dataclasses.replace(HAND.torque_scale, value=0.5)
    np.testing.assert_array_equal(scalar.per_joint(JOINTS), np.full(20, 0.5))


def test_digest_is_of_the_contents(tmp_path):
    path = tmp_path / "hand.yaml"
    text = "# mine\n" + DEFAULT_HAND_FILE.read_text("utf-8").replace("0.08,", "8e-2,")
    path.write_text(text, encoding="utf-8")
    assert load_hand_file(path).sha256 == HAND.sha256
    path.write_text(text.replace("8e-2,", "8.1e-2,"), encoding="utf-8")
    assert load_hand_file(path).sha256 != HAND.sha256


def test_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "hand.yaml"
    save_hand_file(HAND, path)

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        save_hand_file(dataclasses.replace(HAND, name="other"), path)
    assert load_hand_file(path) == HAND
    assert [item.name for item in tmp_path.iterdir()] == ["hand.yaml"]


@pytest.mark.parametrize(
    ("assignment", "field", "valid"),
    [
        ("schema=2", "schema", "1"),
        ("palm_mass.value=-1", "palm_mass.value", "0.01 to 5 [kg]"),
        ("palm_mass.value=.nan", "palm_mass.value", "a finite number"),
        ("palm_mass.unit=g", "palm_mass.unit", "kg"),
        ("palm_mass.source=guess", "palm_mass.source", "identified from"),
        ("palm_mass.source='identified from '", "palm_mass.source", "identified from"),
        ("palm_mas.value=1", "palm_mas", "did you mean palm_mass?"),
        ("stiffness_scale.value=30", "stiffness_scale.value", "high is 22.0"),
        ("stiffness_scale.low=20", "stiffness_scale.value", "low is 20.0"),
        ("stiffness_scale.value=[18, 18, 18]", "stiffness_scale.value", "20 numbers"),
        (
            "torque_scale.value={finger1_joint5: 1}",
            "torque_scale.value.finger1_joint5",
            "did you mean finger1_joint",
        ),
        ("torque_scale.value={finger1_joint1: 1}", "torque_scale.value", "also finger"),
        ("speed_limit.value.3=1000", "speed_limit.value", "0.01 to 100 [rad/s]"),
        ("delay_s.value=0.5", "delay_s.value", "0 to 0.2 [s]"),
        ("payload_pos.value=[0, 0]", "payload_pos.value", "a list of 3"),
        ("effects=[{name: backlsh}]", "effects.0.name", "did you mean backlash"),
        ("effects=[{name: backlash}]", "effects.0.parameters", "gap_rad"),
        ("effects=[backlash]", "effects.0", "a mapping of name, parameters"),
    ],
)
def test_mistakes_are_named(assignment, field, valid):
    with pytest.raises(InputError) as caught:
        override(HAND, [assignment])
    assert caught.value.field == field
    assert valid in str(caught.value)


def test_sources():
    for source in ("paper", "vendor", "ours", "user", "identified from 3f2a"):
        assert Quantity(1.0, "1", source).source == source


def test_missing_field_and_malformed_file(tmp_path):
    path = tmp_path / "hand.yaml"
    data = to_dict(HAND)
    del data["lowpass_hz"]
    path.write_text(dump_yaml(data), encoding="utf-8")
    with pytest.raises(InputError, match="lowpass_hz"):
        load_hand_file(path)
    path.write_bytes(DEFAULT_HAND_FILE.read_bytes()[:700])
    with pytest.raises(InputError, match=r"hand\.yaml"):
        load_hand_file(path)


def with_effects(*effects):
    return from_dict(HandFile, to_dict(HAND) | {"effects": list(effects)}, "memory")


def gap(**changes):
    given = {"value": 0.01, "unit": "rad", "source": "identified from 3f2a"}
    return {"name": "backlash", "parameters": {"gap_rad": given | changes}}


def test_effects_are_checked_against_the_catalogue():
    hand = with_effects(gap() | {"where": ["index", "finger1_joint3", "abduction"]})
    assert isinstance(hand.effects[0], Effect)
    assert from_dict(HandFile, to_dict(hand), "memory") == hand
    bad = gap()
    bad["parameters"] = bad["parameters"] | {"more": bad["parameters"]["gap_rad"]}
    coupling = entry("joint_coupling")
    for effect, field in (
        (gap() | {"name": "backlsh"}, "name"),
        (gap() | {"parameters": {}}, "parameters"),
        (gap(unit="deg"), "parameters"),
        (gap(value=0.31), "parameters.gap_rad.value"),
        (bad, "parameters"),
        (gap() | {"where": ["indx"]}, "where"),
        (gap() | {"where": []}, "effects.0.where"),
        (gap() | {"other": "finger1_joint1"}, "other"),
        (entry("floor_tilt") | {"where": ["index"]}, "effects.0.where"),
        (entry("tip_friction") | {"where": ["pip"]}, "where"),
        (coupling, "effects.0.other"),
        (coupling | {"other": "finger1_joint1"}, "effects.0.other"),
    ):
        with pytest.raises(InputError) as caught:
            with_effects(effect)
        assert field in caught.value.field


def entry(name):
    """An effect at the centers of its priors."""
    return {
        "name": name,
        "parameters": {
            key: {"value": p.prior.center, "unit": p.unit, "source": "user"}
            for key, p in CATALOGUE[name].parameters.items()
        },
    }


def test_a_place_has_an_effect_once():
    index, thumb = (gap() | {"where": [w]} for w in ("index", "thumb"))
    assert len(with_effects(index, thumb, entry("deadband")).effects) == 3
    with pytest.raises(InputError, match=r"effects\.2\.where"):
        with_effects(index, thumb, gap() | {"where": ["finger2_joint3"]})
    with pytest.raises(InputError, match=r"effects\.1\.where"):
        with_effects(entry("floor_tilt"), entry("floor_tilt"))


def test_a_hand_with_effects_is_written_and_read(tmp_path):
    path = tmp_path / "hand.yaml"
    coupling = entry("joint_coupling") | {
        "where": ["finger2_joint4"],
        "other": "finger2_joint3",
    }
    hand = with_effects(gap() | {"where": ["pip"]}, coupling)
    save_hand_file(hand, path)
    assert load_hand_file(path) == hand
    assert hand.without_effects == HAND
