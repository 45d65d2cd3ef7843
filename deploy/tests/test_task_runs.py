"""The committed policies of other tasks under the supervisor, in their scenes."""

import pytest
from task_runs import get_up, push_cube, type_keys

from envs.tasks.keyboard.model import ARROWS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("scenes")


def test_keys_are_typed_one_by_one(folder):
    typed = type_keys(folder, ARROWS, seed=0)
    assert typed["keys"] == 4 and typed["correct"] >= 3 and typed["faults"] == []


def test_a_cube_is_pushed_by_what_a_camera_sends(folder):
    """Under the whole table of the supervisor."""
    pushed = push_cube(folder, seed=2)
    assert pushed["delivered"] and pushed["faults"] == []


@pytest.mark.parametrize("number", [0, 20])
def test_a_fallen_hand_gets_up_and_stands_under_the_other_policy(folder, number):
    assert get_up(folder, number)["up"]
