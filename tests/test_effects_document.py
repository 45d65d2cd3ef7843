"""`docs/reference/effects.md` describes the effects that there are."""

import re
from pathlib import Path

import yaml
from support.effects_table import table

from envs.actuator.effect import Stage
from envs.config.typed import from_dict, to_dict
from envs.hand.hand_file import HandFile, load_hand_file

TEXT = (Path(__file__).parents[1] / "docs/reference/effects.md").read_text("utf-8")


def test_the_table_is_that_of_the_catalogue():
    """`python tests/support/effects_table.py` prints the table as it should be."""
    assert TEXT.endswith(table())
    assert not TEXT.endswith(table().replace("backlash", "backlsh"))


def test_all_stages_are_named():
    named = " ".join(re.findall(r"^\| ([a-z, ]+) \|", TEXT, re.MULTILINE))
    assert {stage.value for stage in Stage} <= set(re.findall("[a-z]+", named))


def test_the_example_is_a_hand_file():
    (example,) = re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)
    data = to_dict(load_hand_file()) | yaml.safe_load(example)
    hand = from_dict(HandFile, data, "docs/reference/effects.md")
    assert [effect.name for effect in hand.effects] == ["backlash", "joint_coupling"]
