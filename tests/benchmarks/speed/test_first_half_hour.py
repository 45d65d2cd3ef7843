"""What a newcomer types exists, and a step that fails is no measurement."""

import re
import subprocess
import sys

import pytest
from support.house import ROOT

from benchmarks.speed import first_half_hour
from fingers_mjx.cli.main import make_parser


@pytest.mark.parametrize("step", first_half_hour.STEPS)
def test_the_commands_of_the_table_exist(step):
    _, command, _ = first_half_hour.STEPS[step]
    program, *words = command.split()
    if program == "fingers":
        make_parser().parse_args(words)
    if program == "make":
        makefile = (ROOT / "Makefile").read_text("utf-8")
        assert re.search(rf"^{words[0]}:", makefile, re.MULTILINE)


def measured(monkeypatch, tmp_path, step):
    monkeypatch.setattr(first_half_hour, "STEPS", {"one": ("it is there", "do", step)})
    monkeypatch.setattr(sys, "argv", ["it", "--out", str(tmp_path / "new")])
    first_half_hour.main()


def test_each_step_is_a_row(monkeypatch, tmp_path, capsys):
    folders = []
    measured(monkeypatch, tmp_path, folders.append)
    assert folders == [tmp_path / "new" / "copy"]
    assert re.search(
        r"^\| it is there \| `do` \| 0 \| 0 \|", capsys.readouterr().out, re.M
    )


def test_a_command_that_ends_too_early_is_no_measurement(monkeypatch, tmp_path, capsys):
    def step(copy):
        command = [sys.executable, "-c", "pass"]
        with first_half_hour._running(command, copy.parent) as process:
            first_half_hour._wait(process, lambda: False)

    with pytest.raises(SystemExit, match="ended too early"):
        measured(monkeypatch, tmp_path, step)
    assert "it is there" not in capsys.readouterr().out


def test_a_command_that_fails_is_no_measurement(monkeypatch, tmp_path):
    def step(copy):
        first_half_hour._run([sys.executable, "-c", "raise SystemExit(3)"], copy.parent)

    with pytest.raises(subprocess.CalledProcessError):
        measured(monkeypatch, tmp_path, step)


def test_a_folder_that_is_there_is_refused(monkeypatch, tmp_path):
    (tmp_path / "new").mkdir()
    with pytest.raises(SystemExit, match="2"):
        measured(monkeypatch, tmp_path, lambda copy: None)
