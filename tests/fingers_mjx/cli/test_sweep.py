"""`fingers sweep`: words, refusals, and exit statuses."""

import json

import pytest
from support import sweep_setup
from support.sweep_setup import WORKER, plan_faults, run_fake, written

from envs.config.strict_yaml import write_yaml
from fingers_mjx.cli.machine import gpu
from fingers_mjx.cli.main import main
from fingers_mjx.studies.sweep import resolve
from fingers_mjx.studies.sweep.engines import by_name
from fingers_mjx.studies.sweep.engines.engine import local


@pytest.fixture
def source(tmp_path, monkeypatch):
    """A specification, whose trainings are pretended."""
    pretended = lambda spec, root: local(spec, root, WORKER)  # noqa: E731
    monkeypatch.setattr(by_name, "local", pretended)
    path = tmp_path / "spec.yaml"
    path.write_text(write_yaml(written()), "utf-8")
    return path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["status"], "fingers sweep status: DIR: found nothing"),
        (["spec.yaml"], "-o: found nothing; valid: the directory of the sweep"),
        (["spec.yaml", "x", "-o", "y"], "found x; valid: one specification"),
        (["none.yaml", "-o", "y"], "none.yaml: found"),
        (["status", "nowhere"], "nowhere/sweep.json: found no sweep"),
    ],
)
def test_words_that_do_not_fit_are_refused_in_one_sentence(
    words, said, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(["sweep", *words]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def idle(monkeypatch):
    """A GPU that stays idle unless the backend is cpu, as `idle_gpu` says."""
    say = lambda backend: None if backend == "cpu" else f"idle: {backend}"  # noqa: E731
    monkeypatch.setattr("fingers_mjx.cli.main.idle_gpu", say)


@pytest.mark.usefixtures("idle")
@pytest.mark.parametrize(
    ("backend", "said"),
    [("cpu", ""), ("jax", "fingers: idle: jax\n"), (None, "fingers: idle: None\n")],
)
def test_a_gpu_that_the_specification_declines_is_left_alone(
    source, backend, said, capsys
):
    source.write_text(write_yaml(written(backend=backend)), "utf-8")
    assert main(["sweep", str(source), "--dry-run"]) == 0
    assert capsys.readouterr().err == said
    assert main(["sweep", str(source), "--dry-run", "--backend", "cpu"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("idle")
def test_to_ask_how_a_sweep_stands_no_gpu_is_looked_for(tmp_path, capsys):
    assert main(["sweep", "status", str(tmp_path)]) == 2
    assert "idle" not in capsys.readouterr().err


@pytest.mark.parametrize(("backend", "times"), [(None, 1), ("cpu", 0)])
def test_a_cuda_that_does_not_start_is_named_once(
    source, tmp_path, monkeypatch, capsys, backend, times
):
    def machine_backend(on_fault):
        on_fault("no driver")
        return "cpu"

    sentence = "JAX cannot start CUDA: no driver"
    monkeypatch.setattr(resolve, "machine_backend", machine_backend)
    monkeypatch.setattr(gpu, "failed_cuda", lambda said: sentence)
    source.write_text(write_yaml(written(backend=backend)), "utf-8")
    assert main(["sweep", str(source), "-o", str(tmp_path / "sweep")]) == 0
    assert capsys.readouterr().err.count(f"fingers: {sentence}\n") == times


def test_a_sweep_ends_in_a_report(source, tmp_path, capsys):
    root = tmp_path / "sweep"
    assert main(["sweep", str(source), "-o", str(root)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == f"next: fingers compare {root} --baseline plain"
    events = [json.loads(line) for line in lines if line.startswith("{")]
    assert {"sweep", "member"} == {event["event"] for event in events}
    # What it has kept is a specification, and the same sweep.
    assert main(["sweep", str(root / "spec.yaml"), "-o", str(root)]) == 0


def test_missing_members_show_in_the_status(source, tmp_path, capsys):
    root = tmp_path / "sweep"
    plan_faults(root, {"plain/0": ["nan"]})
    assert main(["sweep", str(source), "-o", str(root)]) == 5
    assert "missing: plain/0 (diverged" in capsys.readouterr().out


def test_a_full_disk_is_status_4(source, tmp_path, capsys):
    root = tmp_path / "sweep"
    plan_faults(root, {"plain/0": ["full"]})
    assert main(["sweep", str(source), "-o", str(root)]) == 4
    assert "no room for x" in capsys.readouterr().err


def test_a_changed_specification_is_refused_by_name(source, tmp_path, capsys):
    root = tmp_path / "sweep"
    run_fake(root)
    changed = sweep_setup.written(evaluate={"episodes": 9})
    source.write_text(write_yaml(changed), "utf-8")
    assert main(["sweep", str(source), "-o", str(root)]) == 2
    error = capsys.readouterr().err
    assert f"{source}: evaluate.episodes: found 9; valid: 4, as the sweep" in error
