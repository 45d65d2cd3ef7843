"""Effects that are switched on and off: which hand files that makes."""

import dataclasses

import pytest
from support.cli_setup import default_hand

from envs.actuator.catalogue import CATALOGUE
from envs.hand.drive.chain import in_chain
from envs.hand.hand_file import Effect
from envs.hand.quantity import Quantity
from fingers_mjx.play.viewer.switches import (
    OFFERED,
    own_effects,
    switched,
    switches,
)


def with_own(*effects: Effect):
    return dataclasses.replace(default_hand(), effects=effects)


def coupling():
    names = ("stiffness_nm_rad", "effort_share")
    units = CATALOGUE["joint_coupling"].units()
    values = {name: Quantity(0.1, units[name], "user") for name in names}
    joints = default_hand().nominal.joint_names
    return Effect("joint_coupling", values, (joints[3],), other=joints[2])


def test_what_is_offered_acts_in_the_chain():
    for name in OFFERED:
        assert in_chain(CATALOGUE[name])
        assert CATALOGUE[name].scope == "joint"


def test_a_hand_without_effects_begins_with_all_off():
    assert own_effects(default_hand()) == {}
    assert [s.name for s in switches(default_hand())] == list(OFFERED)
    for switch in switches(default_hand()):
        assert 0.0 < switch.size < switch.high


def test_off_means_identity_and_on_means_the_size():
    hand = switched(default_hand(), {"deadband": 0.03})
    values = {e.name: e.parameters for e in hand.effects}
    assert values["deadband"]["half_width_rad"].value == 0.03
    assert values["backlash"]["gap_rad"].value == 0.0
    assert set(values) == set(OFFERED)


def test_hands_that_differ_by_switches_have_the_same_effects():
    names = [
        [(e.name, e.where) for e in switched(default_hand(), on).effects]
        for on in ({}, {"deadband": 0.03}, {"backlash": 0.1, "compliance": 0.2})
    ]
    assert names[0] == names[1] == names[2]


def test_an_effect_of_the_hand_keeps_its_place_and_its_partner():
    hand = with_own(coupling())
    assert list(own_effects(hand)) == ["joint_coupling"]
    kept = switched(hand, own_effects(hand)).effects[0]
    assert kept == hand.effects[0]
    off = switched(hand, {}).effects[0]
    assert (off.where, off.other) == (kept.where, kept.other)
    assert off.parameters["stiffness_nm_rad"].value == 0.0


def test_a_size_outside_what_the_effect_can_be_is_refused():
    with pytest.raises(Exception, match="0 to"):
        switched(default_hand(), {"deadband": 5.0})
