"""`fingers doctor` and `fingers tasks`: what is there, and what is wrong with it."""

import re
from importlib import metadata

import pytest
from packaging.requirements import Requirement

from fingers_mjx.cli import doctor
from fingers_mjx.cli.machine import gpu, installation
from fingers_mjx.cli.main import main
from fingers_mjx.ppo.config import PRESETS

HEALTHY = {"devices": ["cpu cpu"], "backend": "cpu", "broken": []}
DRAWS = {"renderer": "ray casting on the CPU"}
CUDA = {"devices": ["gpu NVIDIA H200"], "backend": "warp", "broken": []}


def wrong(findings):
    return [text for state, text in findings if state == doctor.WRONG]


def test_this_installation_is_healthy(monkeypatch, capsys):
    monkeypatch.setattr(gpu, "sees_gpu", lambda: False)
    monkeypatch.setattr(doctor, "probed", lambda *_, **__: HEALTHY | DRAWS)
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert f"jax {metadata.version('jax')}" in said and "backend of training" in said
    assert "renderer of videos: ray casting on the CPU\n" in said
    assert all(line[:5] in ("ok   ", "note ") for line in said.splitlines())


def test_jax_is_asked_in_a_process_of_its_own():
    answer = doctor.probed()
    assert answer["devices"] and answer["backend"] in ("cpu", "warp")
    assert answer["broken"] == []


@pytest.mark.parametrize(
    ("program", "limit_s", "said"),
    [
        ("import time; time.sleep(60)", 0.2, "no answer within 0.2 s"),
        ("raise RuntimeError('no such device')", 60, "no such device"),
    ],
)
def test_a_jax_that_hangs_or_fails_is_wrong(program, limit_s, said):
    (sentence,) = wrong(doctor.device_findings(doctor.probed(program, limit_s), {}))
    assert said in sentence


def test_the_renderer_is_asked_in_a_process_of_its_own():
    finding = doctor.renderer_finding(doctor.probed(doctor.DRAWING, what="renderer"))
    assert finding.state == doctor.OK
    assert re.search(r"renderer of videos: (OpenGL on .|ray casting)", finding.text)


def test_a_renderer_that_fails_is_wrong():
    answer = doctor.probed("raise RuntimeError('no EGL')", what="renderer")
    assert doctor.renderer_finding(answer) == (
        doctor.WRONG,
        "renderer: RuntimeError: no EGL",
    )


def test_all_extras_are_looked_at_but_those_of_a_gpu():
    table = installation.source_tree()
    assert table is not None
    declared = table["project"]["optional-dependencies"]
    assert set(doctor.EXTRAS) == set(declared) - {"cuda12", "cuda13"}


@pytest.mark.parametrize("extra", ["viz", "data", "viewer"])
def test_every_package_of_an_extra_is_looked_for(extra):
    """By its modules; the other extras have one package each."""
    table = installation.source_tree()
    assert table is not None
    texts = table["project"]["optional-dependencies"][extra]
    wanted = {Requirement(text).name.lower() for text in texts}
    bring = metadata.packages_distributions()
    found = {d.lower() for m in doctor.EXTRAS[extra] for d in bring[m]}
    assert wanted <= found


def test_an_extra_that_lacks_a_module_is_named_with_all_that_it_lacks(monkeypatch):
    monkeypatch.setattr(
        doctor.importlib.util,
        "find_spec",
        lambda name: None if name in ("mjviser", "rerun") else name,
    )
    said = [finding.text for finding in doctor.extra_findings()]
    assert "extra viz" in said and "extra wandb" in said
    assert any(text.startswith("extra viewer: no mjviser (") for text in said)
    assert any(text.startswith("extra rerun: no rerun (") for text in said)


@pytest.mark.parametrize(
    ("answer", "sees", "environment", "said"),
    [
        (HEALTHY, False, {}, []),
        (CUDA, True, {}, []),
        (HEALTHY, True, {}, ["JAX does not use"]),
        (HEALTHY, True, {"JAX_PLATFORMS": "cpu"}, []),
        (CUDA | {"backend": "cpu"}, True, {}, ["Warp is not installed"]),
        (HEALTHY | {"broken": ["package a 1: found x"]}, False, {}, ["package a 1"]),
    ],
)
def test_devices(answer, sees, environment, said, monkeypatch):
    monkeypatch.setattr(gpu, "sees_gpu", lambda: sees)
    found = wrong(doctor.device_findings(answer, environment))
    assert len(found) == len(said)
    assert all(part in text for part, text in zip(said, found, strict=True))


@pytest.mark.parametrize(
    ("plugin", "reason"),
    [(True, "its CUDA plugin does not start: no driver"), (False, "make cuda12")],
)
def test_a_cuda_that_is_installed_and_does_not_start(monkeypatch, plugin, reason):
    monkeypatch.setattr(gpu, "sees_gpu", lambda: True)
    monkeypatch.setattr(gpu, "has_cuda_jax", lambda: plugin)
    answer = HEALTHY | {"cuda": "no driver"}
    (sentence,) = wrong(doctor.device_findings(answer, {}))
    assert reason in sentence


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        ({}, []),
        ({"MUJOCO_GL": "egl"}, []),
        ({"MUJOCO_GL": "elg"}, ["MUJOCO_GL=elg"]),
        ({"FINGERS_COMPILE_CACHE": "off"}, []),
        ({"FINGERS_COMPILE_CACHE": "/dev/null/cache"}, ["compile cache: /dev/null"]),
    ],
)
def test_variables(environment, said):
    found = wrong(doctor.environment_findings(environment))
    assert len(found) == len(said)
    assert all(part in text for part, text in zip(said, found, strict=True))


@pytest.mark.parametrize(
    ("version", "hangs"),
    [("0.9.2", False), ("0.10.0", True), ("0.11.0", True), ("0.11.1", False)],
)
def test_versions_of_jaxlib_that_hang(version, hangs):
    assert doctor.hangs(version) == hangs


def test_a_foreign_package_and_a_wrong_version_are_named(monkeypatch, capsys):
    def foreign():
        raise installation.UnsupportedInstallation("package envs: found /elsewhere")

    monkeypatch.setattr(installation, "check_places", foreign)
    monkeypatch.setattr(installation, "requirements", lambda: (">=3.11", ["numpy<1"]))
    assert main(["doctor"]) == doctor.SICK
    said = capsys.readouterr().out
    assert "WRONG  package envs: found /elsewhere" in said
    assert "WRONG  numpy: found" in said and "devices: not asked" in said


def test_tasks_presets_and_tables_are_listed(capsys):
    assert main(["tasks"]) == 0
    said = capsys.readouterr().out
    names = ("crawl", "recovery", "push", "keyboard", *PRESETS, "steering")
    assert all(f"  {name} " in said or name in said for name in names)
