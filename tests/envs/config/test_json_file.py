import os

import pytest

from envs.config.json_file import MAX_JSON_DEPTH, parse_json, read_json, read_table
from envs.errors import InputError


@pytest.mark.parametrize("depth", [MAX_JSON_DEPTH + 1, 900, 1000, 100_000])
@pytest.mark.parametrize(("opened", "closed"), [("[", "]"), ('{"a":', "}")])
def test_deep_nesting_is_refused_in_one_sentence(depth, opened, closed):
    text = opened * depth + "0" + closed * depth
    with pytest.raises(InputError) as found:
        parse_json(text, "run.json")
    assert len(str(found.value)) <= 300


def test_what_we_write_is_not_that_deep():
    text = "[" * MAX_JSON_DEPTH + "]" * MAX_JSON_DEPTH
    assert parse_json(text, "run.json")


@pytest.mark.parametrize("content", [b"", b"{", b"\xff", b"\xff\xfe{\0}\0", b"nul"])
def test_what_is_no_json_is_refused(tmp_path, content):
    path = tmp_path / "run.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"run\.json"):
        read_json(path)


@pytest.mark.parametrize("content", ["[1]", "7", "null", '"text"'])
def test_a_table_is_an_object(tmp_path, content):
    path = tmp_path / "run.json"
    path.write_text(content)
    with pytest.raises(InputError, match="a JSON object"):
        read_table(path)


def test_only_regular_files_are_read(tmp_path):
    os.mkfifo(tmp_path / "run.json")
    with pytest.raises(InputError, match="named pipe"):
        read_json(tmp_path / "run.json")
