"""What the command line makes of `--here` and its folders."""

import pytest

from benchmarks.comparison import __main__ as command


def parsed(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["comparison", "--out", "build", *words])
    return command._place(command._arguments())


def test_peers_have_their_own_environments_unless_they_are_here(monkeypatch):
    assert parsed(monkeypatch).here is None
    assert parsed(monkeypatch, "--here", "--together").here == {}


def test_a_peer_here_can_have_a_folder_of_packages(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own").mkdir()
    found = parsed(monkeypatch, "--here", "mjlab=own").here
    assert found == {"mjlab": str(tmp_path / "own")}


@pytest.mark.parametrize("words", ["mjlab", "mjlab=", "mjlab=missing"])
def test_a_folder_that_is_not_there_ends_the_command(monkeypatch, words, capsys):
    with pytest.raises(SystemExit):
        parsed(monkeypatch, "--here", words)
    assert f"{words}: not PEER=DIR of a folder" in capsys.readouterr().err
