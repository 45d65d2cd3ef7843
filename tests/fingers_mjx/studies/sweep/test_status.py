"""How a sweep stands, as table, as JSON lines and while it runs."""

import dataclasses
import io
import json

import pytest
from rich.console import Console
from support.sweep_setup import plan_faults, run_fake

from envs.errors import InputError
from fingers_mjx.cli.main import main
from fingers_mjx.studies.sweep.display import display
from fingers_mjx.studies.sweep.manifest import read_manifest, write_manifest
from fingers_mjx.studies.sweep.report import report
from fingers_mjx.studies.sweep.resolve import LOCK_FILE
from fingers_mjx.studies.sweep.run import sweep_lock
from fingers_mjx.studies.sweep.status import counts, in_progress, standings, table


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A sweep with one member of each kind, of which one is made to run."""
    root = tmp_path_factory.mktemp("status") / "sweep"
    plan_faults(root, {"lift/0": ["nan"], "plain/1": ["input"]})
    manifest = run_fake(root)
    member = next(m for m in manifest.members if str(m.key) == "lift/1")
    running = dataclasses.replace(member, state="running", iterations=0)
    write_manifest(root, manifest.with_member(running))
    row = {"iteration": 7, "iterations": 30, "steps_per_s": 1234.0, "eta_s": 61.0}
    curve = root / running.run / "metrics.jsonl"
    curve.write_text(json.dumps(row) + '\n{"iterat', "utf-8")
    return root


def test_a_running_member_stands_where_its_curve_is(root):
    with sweep_lock(root):
        found = {str(one.member.key): one for one in standings(root)}
    one = found["lift/1"]
    assert (one.member.iterations, one.iterations) == (7, 30)
    assert (one.steps_per_s, one.eta_s) == (1234.0, 61.0)
    assert found["plain/0"].steps_per_s is None
    text = counts(list(found.values()))
    assert text == "4 members: 1 running, 1 failed, 1 diverged, 1 done, 1,234 steps/s"


def test_the_table_shows_what_runs_first_and_why_others_do_not(root):
    console = Console(file=io.StringIO(), width=120)
    with sweep_lock(root):
        console.print(table(standings(root)))
    lines = console.file.getvalue().splitlines()
    assert lines[2].split() == ["lift/1", "running", "train", "7/30", "1234", "0:01:01"]
    assert "plain/1" in lines[3] and "env.x: found 1" in lines[3]
    assert "the same seed would" in lines[4]
    assert lines[5].split()[:2] == ["plain/0", "done"]


def test_what_ran_in_a_sweep_that_was_killed_waits(root):
    (root / LOCK_FILE).unlink(missing_ok=True)
    root.chmod(0o555)
    try:
        found = {str(one.member.key): one for one in standings(root)}
    finally:
        root.chmod(0o755)
    one = found["lift/1"]
    assert (one.member.state, one.member.iterations) == ("waiting", 7)
    assert one.member.reason == "stopped; the same command goes on"
    assert (one.steps_per_s, one.eta_s) == (None, None)
    assert not (root / LOCK_FILE).exists()


def test_one_member_is_one_member(root):
    found = standings(root)
    assert counts(found[:1]).startswith("1 member: ")
    assert counts(found).startswith("4 members: ")


def test_without_a_terminal_status_is_json_lines(root, capsys):
    assert main(["sweep", "status", str(root)]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["state"] for row in rows].count("done") == 1
    assert {"configuration", "seed", "reason", "eta_s"} <= rows[0].keys()


def test_a_sweep_is_in_progress_while_it_is_held(root):
    assert not in_progress(root)
    with sweep_lock(root):
        assert in_progress(root)


def test_the_display_keeps_lines_where_there_is_no_terminal(root):
    stream = io.StringIO()
    with display(stream, root) as show:
        show.event({"event": "note", "text": "here"})
        show.member(read_manifest(root).members[0])
    rows = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert {row["event"] for row in rows} == {"sweep", "note", "member"}


def test_the_display_is_a_table_on_a_terminal(root):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    with display(stream, root) as show:
        show.event({"event": "note", "text": "stopping after this iteration"})
    assert "stopping after this iteration" in stream.getvalue()
    assert "plain/0" in stream.getvalue()


def test_a_directory_without_a_sweep_is_refused(tmp_path):
    with pytest.raises(InputError, match="no sweep"):
        standings(tmp_path)


def test_the_report_of_one_member_is_of_one_member(root):
    manifest = read_manifest(root)
    one = dataclasses.replace(manifest, members=manifest.members[:1])
    assert report(root, one)[0] == "1 of 1 member done"
