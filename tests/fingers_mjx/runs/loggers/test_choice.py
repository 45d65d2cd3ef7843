"""Loggers are chosen by name, and looked for before anything is made."""

import importlib.util
import typing
from types import SimpleNamespace

import pytest

from envs.errors import InputError
from fingers_mjx.cli.machine.gpu import install_command
from fingers_mjx.cli.main import main
from fingers_mjx.ppo.config import TrainConfig, check_config
from fingers_mjx.runs.loggers import choice
from fingers_mjx.runs.loggers.base import About, Kept
from fingers_mjx.runs.loggers.tensorboard import TensorBoard
from fingers_mjx.runs.metrics import MetricsLog

NOTHING = About("run", "", {})


class Listed:
    """A logger that keeps what it gets."""

    def __init__(self, about: About, kept: Kept):
        self.about, self.got = about, list(kept.rows)

    def append(self, row):
        self.got.append(row)

    def append_video(self, iteration, path):
        self.got.append(iteration)

    def close(self):
        self.got.append("closed")


def test_the_setting_takes_what_there_is():
    kind = typing.get_type_hints(TrainConfig)["loggers"]
    assert set(typing.get_args(typing.get_args(kind)[0])) == set(choice.OPTIONAL)
    with pytest.raises(InputError, match="loggers"):
        check_config(TrainConfig(loggers=("mlflow",)))


def test_tensorboard_stays():
    assert choice.chosen((), NOTHING) == [TensorBoard]


def test_a_chosen_logger_gets_the_rows_kept_and_those_after(tmp_path, monkeypatch):
    opened = []

    def listed(about, kept):
        opened.append(Listed(about, kept))
        return opened[-1]

    monkeypatch.setattr(choice, "OPTIONAL", {"listed": listed})
    for iteration in (1, 2):
        with MetricsLog(tmp_path, 9, choice.chosen(("listed",), NOTHING)) as log:
            log.append({"iteration": iteration, "time_s": 1.0})
    first, second = (
        [g if g == "closed" else g["iteration"] for g in o.got] for o in opened
    )
    assert first == [1, "closed"] and second == [1, 2, "closed"]


@pytest.mark.parametrize("found", [None, SimpleNamespace(origin=None)])
def test_one_that_is_not_installed_is_one_sentence(
    tmp_path, monkeypatch, capsys, found
):
    """A folder `wandb`, in which wandb keeps runs, is not the package."""
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name, *more: found if name == "wandb" else find(name, *more),
    )
    out = tmp_path / "run"
    assert main(["train", "crawl", "--out", str(out), "--loggers", "wandb"]) == 2
    said = capsys.readouterr().err
    assert said == f"fingers: wandb is not installed; {install_command('wandb')}\n"
    assert not out.exists()
