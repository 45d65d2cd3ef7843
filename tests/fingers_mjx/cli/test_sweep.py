"""`fingers sweep`: words, refusals, and exit statuses."""

import json

import pytest
from support import sweep_setup
from support.sweep_setup import WORKER, plan_faults, run_fake, written

from envs.config.strict_yaml import write_yaml
from fingers_mjx.cli.main import main
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
