"""What YAML may cost, and what it may hold."""

import time

import pytest

from envs.config.strict_yaml import MAX_YAML_BYTES, MAX_YAML_NODES, parse_yaml
from envs.config.typed import load_yaml
from envs.errors import InputError
from envs.hand.hand_file import DEFAULT_HAND_FILE, HandFile, load_hand_file


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\n" * (MAX_YAML_BYTES // 5 + 1),
        "[" + "1," * (MAX_YAML_NODES + 1) + "1]",
        "? a\n: " * 20_000,
        "{" + ",".join(f"k{k}: 0" for k in range(12_000)) + "}",
        "- " * 30_000,
        '"' + "a" * MAX_YAML_BYTES + '"',
    ],
)
def test_what_costs_minutes_is_refused_in_seconds(text):
    begin = time.process_time()
    with pytest.raises(InputError):
        parse_yaml(text, "hand.yaml")
    assert time.process_time() - begin < 20  # it was 130 s for 900 kB


@pytest.mark.parametrize(
    "text", ['"\\ud800"', '{"a": "\\udfff"}', '"\\0"', '"\\x1b[31m"']
)
def test_a_character_that_no_file_can_hold_is_refused(text):
    with pytest.raises(InputError, match="a character that is no text"):
        parse_yaml(text, "hand.yaml")


def test_letters_of_any_script_are_text():
    assert parse_yaml('note: "Größe \\u00e9"', "x") == {"note": "Größe é"}
    assert parse_yaml("note: Größe 手\n", "x") == {"note": "Größe 手"}


def test_a_hand_without_torque_is_refused(tmp_path):
    """MuJoCo has no model of it, and training ended in a traceback."""
    path = tmp_path / "hand.yaml"
    text = DEFAULT_HAND_FILE.read_text("utf-8")
    head, part = text.split("torque_scale:")
    first, rest = part.split("value:", 1)
    number = rest.split(",")[0].split("\n")[0]
    path.write_text(
        f"{head}torque_scale:{first}value: 0.0{rest[len(number) :]}", "utf-8"
    )
    with pytest.raises(InputError, match="torque_scale"):
        load_hand_file(path)


@pytest.mark.parametrize("path", ["/dev/zero", "x" * 5000, "/"])
def test_only_regular_files_are_read(path):
    with pytest.raises(InputError) as found:
        load_yaml(HandFile, path)
    assert len(str(found.value)) <= 300
