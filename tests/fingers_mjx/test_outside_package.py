"""An installed package brings a task, a driver and a log reader by entry points."""

import json
import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support.house import ROOT
from support.installed import EXAMPLE, install, install_example

from envs.config import plugins
from envs.errors import InputError
from envs.registry import get_task, task_names
from fingers_deploy import load_bundle
from fingers_mjx.cli.arguments.completion import candidates
from fingers_mjx.cli.main import main, make_parser
from fingers_robot.drivers.open import open_driver, prepare_driver
from fingers_robot.drivers.outside import outside_kinds
from sysid.logs.read import read_log

FEW = (
    *("num_envs=4", "iterations=2", "log_every=1", "ppo.unroll_length=6"),
    *("ppo.minibatches=2", "ppo.actor_layers=[16]", "ppo.critic_layers=[16]"),
)
BROKEN = {
    "fingers.tasks": {"absent": "no_such_module:TASK", "number": "math:pi"},
    "fingers.drivers": {"absent": "no_such_module:open"},
    "fingers.logs": {"bad": "json:loads", "none": "os.path:basename"},
}


@pytest.fixture
def example(monkeypatch, tmp_path):
    (tmp_path / "site").mkdir()
    install_example(monkeypatch, tmp_path / "site")
    yield
    plugins.found.cache_clear()


@pytest.fixture
def broken(monkeypatch, tmp_path):
    (tmp_path / "bad").mkdir()
    install(monkeypatch, tmp_path / "bad", "bad-package", BROKEN)
    yield
    plugins.found.cache_clear()


def test_its_task_is_trained_evaluated_exported_and_played(example, tmp_path, capsys):
    run, bundle = str(tmp_path / "run"), str(tmp_path / "bundle")
    words = ["--preset", "cpu", "--env.height-m", "0.05", "--env.episode-s", "0.2"]
    assert main(["train", "crouch", "--out", run, *words, "--set", *FEW]) == 0
    lines = (tmp_path / "run/metrics.jsonl").read_text("utf-8").splitlines()
    assert [json.loads(line)["iteration"] for line in lines] == [1, 2]
    assert main(["eval", run, "--episodes", "2", "--steps", "5"]) == 0
    assert main(["export", run, "--out", bundle]) == 0
    assert main(["play", bundle, "--seconds", "0.1"]) == 0, capsys.readouterr().err
    assert load_bundle(bundle).manifest.task == "crouch"


def test_it_is_listed_explained_and_completed(example, capsys):
    assert "crouch" in task_names()
    assert main(["tasks"]) == 0
    assert "hold the palm low over the fingertips (outside-task 0.1.0)" in (
        capsys.readouterr().out
    )
    assert candidates(make_parser(), ["train", "crouch", "--env.hei"]) == [
        "--env.height-m"
    ]
    assert main(["train", "crouc"]) == 2
    assert "did you mean crouch?" in capsys.readouterr().err


def test_its_driver_and_its_logs_are_known(example, tmp_path):
    assert "ideal" in outside_kinds()
    prepare_driver({"kind": "ideal"})
    joints = SimpleNamespace(joint_names=("a", "b"))
    hand = open_driver({"kind": "ideal"}, joints)
    hand.enable()
    hand.write(np.ones(2))
    assert hand.read().pos_rad.tolist() == [1.0, 1.0]
    file = tmp_path / "knee.rec"
    file.write_text("0 0.1 0\n0.01 0.1 0.05\n", "utf-8")
    log = read_log(file)
    assert log.column("pos.knee").tolist() == [0.0, 0.05]
    assert read_log(EXAMPLE / "knee.rec").column("cmd.knee").max() == 0.3


def test_without_it_all_three_are_unknown(tmp_path):
    """Negative control."""
    assert "crouch" not in task_names() and "ideal" not in outside_kinds()
    (tmp_path / "knee.rec").touch()
    with pytest.raises(InputError, match=r"\.rec"):
        read_log(tmp_path / "knee.rec")


@pytest.mark.parametrize("name", ["absent", "number"])
def test_a_broken_package_is_named_and_stops_only_who_needs_it(broken, name, capsys):
    assert main(["train", name]) == 2
    said = capsys.readouterr().err
    assert "bad-package 0.1.0" in said and said.count("\n") == 1 and len(said) < 320
    assert main(["train", "crawl", "--dry-run"]) == 0
    assert main(["tasks"]) == 0 and get_task("crawl")
    assert "cannot be used: package bad-package 0.1.0" in capsys.readouterr().out


def test_broken_drivers_and_readers_are_named(broken, tmp_path):
    with pytest.raises(InputError, match=r"bad-package 0.1.0.*no_such_module"):
        prepare_driver({"kind": "absent"})
    for suffix in ("bad", "none"):
        file = tmp_path / f"x.{suffix}"
        file.touch()
        with pytest.raises(InputError, match=r"bad-package 0\.1\.0"):
            read_log(file)


def test_one_name_of_two_packages_names_both(example, monkeypatch, tmp_path):
    (tmp_path / "other").mkdir()
    points = {"fingers.tasks": {"crouch": "other:TASK"}}
    install(monkeypatch, tmp_path / "other", "other-hand", points)
    with pytest.raises(InputError, match="one package") as caught:
        get_task("crouch")
    assert all(name in str(caught.value) for name in ("outside-task", "other-hand"))


@pytest.mark.slow
def test_the_example_installs_and_every_command_knows_it(tmp_path):
    site, run, bundle = (str(tmp_path / name) for name in ("site", "run", "bundle"))
    uv = shutil.which("uv") or str(ROOT / ".uv/bin/uv")
    how = ["--python", sys.executable, "--no-deps", "--quiet", "--target", site]
    subprocess.run([uv, "pip", "install", *how, str(EXAMPLE)], check=True)
    for words in (
        ["train", "crouch", "--preset", "cpu", "--out", run, "--set", *FEW],
        ["eval", run, "--episodes", "2", "--steps", "5"],
        ["export", run, "--out", bundle],
        ["play", bundle, "--seconds", "0.1"],
    ):
        subprocess.run(
            [sys.executable, "-m", "fingers_mjx.cli.main", *words],
            env=os.environ | {"PYTHONPATH": site},
            cwd=tmp_path,
            check=True,
        )
    assert load_bundle(bundle).manifest.task == "crouch"
