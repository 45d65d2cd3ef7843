"""What is said of a directory that is no policy."""

import pytest

from fingers_mjx.cli.main import main


@pytest.mark.parametrize("command", ["eval", "export", "play"])
def test_a_population_names_its_members(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "many" / "members" / "00").mkdir(parents=True)
    assert main([command, "many"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("fingers: many: found a directory without ")
    assert error.endswith("; valid: one of its members, many/members/00 …\n")


@pytest.mark.parametrize("command", ["eval", "play"])
def test_of_another_directory_it_says_what_a_policy_is(command, tmp_path, capsys):
    assert main([command, str(tmp_path)]) == 2
    assert "a directory with policy.onnx" in capsys.readouterr().err
