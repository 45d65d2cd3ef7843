"""Interfaces that count as the same."""

from dataclasses import replace
from pathlib import Path

import pytest

import fingers_mjx
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from fingers_deploy import load_bundle
from fingers_mjx.policy.interface import check_interface

COMMITTED = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
SPEEDS = tuple(load_hand_file().per_joint("speed_limit").tolist())


def with_speeds(value):
    interface = load_bundle(COMMITTED).manifest.interface
    path = replace(interface.command_path, slew_rad_s=value)
    return replace(interface, command_path=path)


def test_each_joint_has_its_own_speed():
    assert min(SPEEDS) < max(SPEEDS) and len(SPEEDS) == 20


@pytest.mark.parametrize("stated", [SPEEDS, min(SPEEDS)], ids=["each", "lowest"])
def test_speeds_as_stated_now_and_by_earlier_exports(stated):
    check_interface("bundle", with_speeds(stated), with_speeds(SPEEDS))


@pytest.mark.parametrize("stated", [SPEEDS[::-1], max(SPEEDS), None], ids=str)
def test_other_speeds_are_refused_by_name(stated):
    with pytest.raises(InputError, match="slew_rad_s"):
        check_interface("bundle", with_speeds(stated), with_speeds(SPEEDS))
