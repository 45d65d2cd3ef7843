import contextlib
import json
import resource
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from fuzz_bundles import loaded_unchecked
from fuzz_bundles import measure as damage_bundles

from fingers_mjx.export.bundle import write_bundle
from fingers_robot.cli.main import main
from fingers_robot.record import read_log
from fingers_robot.safety import Mode


def test_check_prints_what_a_bundle_needs(bundle_dir, capsys):
    main(["check", str(bundle_dir)])
    said = capsys.readouterr().out
    for word in (
        "crawl, 50 Hz",
        "8 known answers",
        "joint_pos[20]x8",
        "finger5_joint4",
    ):
        assert word in said
    assert "ms of one core per step" in said


def test_check_survives_a_runtime_that_dies_when_imported(
    bundle_dir, capsys, monkeypatch
):
    import fingers_robot.cli.check as module

    monkeypatch.setattr(module, "_PROBE", "import os; os.abort()")
    main(["check", str(bundle_dir)])
    assert "not usable here" in capsys.readouterr().out


SIM = ("--driver", "sim", "--model", "x")
NO_MODEL = ("--driver", "sim", "--model", "nowhere.xml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "nowhere"], "nowhere"),
        (["run", "nowhere", "--driver", "sim", "--model", "x"], "nowhere"),
        (["run", "BUNDLE", "--driver", "sim"], "--model"),
        (["run", "BUNDLE", "--driver", "replay"], "--log"),
        (["run", "BUNDLE", "--driver", "wuji", "--arm"], "typing arm"),
        (["run", "BUNDLE", *SIM, "--loop-hz", "7"], "50"),
        (["run", "BUNDLE", *SIM, "--sticks", "nan", "0", "0"], "from -1 to 1"),
        (["run", "BUNDLE", *SIM, "--sticks", "5"], "from -1 to 1"),
        (["run", "BUNDLE", *SIM, "--heading-hold", "inf", "0"], "finite"),
        (["run", "BUNDLE", *SIM, "--duration", "-1"], "above 0"),
        (["run", "BUNDLE", *SIM, "--joystick-quiet", "nan"], "or more"),
        (["run", "BUNDLE", *SIM, "--out", "nowhere"], "existing folder"),
        (["run", "BUNDLE", *SIM, "--keys", "up"], "a keyboard policy"),
        (["run", "BUNDLE", *SIM, "--keyboard", "/dev/none"], "a keyboard policy"),
        (["run", "BUNDLE", *SIM, "--tracker", "t"], "no policy that reads a camera"),
        (["run", "BUNDLE", "--unattended", *NO_MODEL], "nowhere.xml"),
        (["run", "BUNDLE", *SIM], "--unattended"),
        (["run", "BUNDLE", *SIM, "--sticks", "1_0"], "no number"),
        (["run", "BUNDLE", *SIM, "--seed", "١"], "no whole number"),
        (["run", "BUNDLE", *SIM, "--out", ""], "empty"),
        (["run", "BUNDLE", "--driver", "sim", "--model", ""], "empty"),
        (["runn"], "COMMAND: found runn; valid: one of check, run, record, guard, log"),
        (["runn"], "(did you mean run?)"),
        (["run", "BUNDLE", "--driver", "sym"], "--driver: found sym; valid: one of"),
        (["run", "BUNDLE", "--driver", "a" * 5000], "…"),
        (["run", "BUNDLE", *SIM, "--keys", "left", "upp"], "(did you mean up?)"),
        (["check", "n" * 5000], "found"),
        ([], "COMMAND"),
        (["log", "nowhere"], "nowhere"),
        (["guard", "BUNDLE", *SIM], "--socket"),
    ],
)
def test_bad_input_is_one_sentence_and_status_2(bundle_dir, capsys, arguments, words):
    assert main([a.replace("BUNDLE", str(bundle_dir)) for a in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1 and words in said.err
    assert len(said.err) <= 320


def test_damaged_bundles_are_refused_before_anything_is_opened(marching):
    result = damage_bundles(marching, 300, seed=1)
    assert result["accepted"] == 0 and result["not_one_line"] == 0
    # Negative control: without our checks nearly all of them load.
    assert loaded_unchecked(marching, 50, seed=1) >= 45


@pytest.mark.slow
def test_ten_thousand_damaged_bundles(marching):
    result = damage_bundles(marching, 10_000, seed=2)
    print(json.dumps(result))
    assert result["accepted"] == 0 and result["not_one_line"] == 0


def test_a_bundle_that_is_an_archive_is_refused_not_unpacked(tmp_path, capsys):
    import zipfile

    path = tmp_path / "bundle.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("../outside", "x")
    assert main(["check", str(path)]) == 2
    assert list(tmp_path.iterdir()) == [path]
    assert "SHA-256" in capsys.readouterr().err


def _run(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "fingers_robot", *map(str, arguments)]
        + ["--unattended"] * (arguments[0] in ("run", "record")),
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def recorded(hand_model, marching_dir, tmp_path_factory):
    """A whole run from the command line: processes, socket, recording.

    A machine that stalls for a lease (60 ms) while the hand is arming stops it
    rightly, with status 5, and records no walk: only such a run is made again.
    """
    arguments = ["run", marching_dir, "--driver", "sim", "--model", hand_model, "--arm"]
    arguments += ["--wiggle", "one", "--duration", "3", "--sticks", "1", "0", "0"]
    for _ in range(4):
        out = tmp_path_factory.mktemp("run")
        done = _run(*arguments, "--out", out)
        if done.returncode != 5 or "arming -> active" in done.stdout:
            break
    return done, next(out.glob("*.mcap"))


def test_a_run_from_the_command_line(recorded):
    done, file = recorded
    assert done.stderr == ""
    log = read_log(file)
    lines = [line for _, line in log.events]
    assert "arming -> active" in lines, done.stdout
    assert log.complete and lines[-1].startswith("de-energized")
    # A loaded machine may stop the hand, never crash: 0, or 5 and a fault's name.
    assert done.returncode == 0 or (done.returncode == 5 and "-> hold" in done.stdout)
    assert "control steps" in done.stdout
    assert "m from the origin" in done.stdout.splitlines()[-1]
    assert (log.rows["mode"] == Mode.ACTIVE).any()


def test_a_recording_keeps_the_timing_of_its_run(recorded, capsys):
    _, file = recorded
    log = read_log(file)
    counts = [
        int(entry.partition(":")[2])
        for entry in log.summary["late_histogram"].split(", ")
    ]
    assert sum(counts) == int(log.summary["control_steps"]) == len(log.rows)
    assert main(["log", str(file)]) == 0
    said = capsys.readouterr().out
    for name in ("late_p999_ms", "skipped", "gap_max_ms", "realtime"):
        assert f"  {name:15} {log.summary[name]}\n" in said


def test_a_recording_converts_to_csv(recorded, tmp_path, capsys):
    _, file = recorded
    out = tmp_path / "run.csv"
    assert main(["log", str(file), "--csv", str(out)]) == 0
    header, *lines = out.read_text().splitlines()
    table = np.array([line.split(",") for line in lines], float)
    columns = dict(zip(header.split(","), table.T, strict=True))
    rows = read_log(file).rows
    np.testing.assert_array_equal(
        columns["pos.finger3_joint2"].astype(np.float32), rows["pos"][:, 9]
    )
    assert main(["log", str(file), "--csv", str(out)]) == 2  # never written over


@pytest.mark.parametrize("armed", [True, False])
def test_a_recording_replays_as_a_dry_run(recorded, marching_dir, tmp_path, armed):
    """It ends with its log, without an alarm for a hand that is not there."""
    _, file = recorded
    arguments = ["run", marching_dir, "--driver", "replay", "--log", file]
    arguments += ["--out", tmp_path] + ["--arm"] * armed
    done = _run(*arguments)
    assert "Traceback" not in done.stderr
    # A loaded machine may be too late for its own log.
    late = armed and done.returncode in (5, 6)
    assert late or done.returncode == 0
    assert late or "the recording is over" in done.stdout
    assert late or "BATTERY" not in done.stdout


def test_a_dry_run_does_everything_but_energize(hand_model, marching_dir, tmp_path):
    """Nothing follows: the wiggle of the joints is left out, the policy runs."""
    arguments = ["run", marching_dir, "--driver", "sim", "--model", hand_model]
    arguments += ["--dry-run", "--arm", "--duration", "2", "--out", tmp_path]
    done = _run(*arguments)
    late = done.returncode == 5 and "-> hold" in done.stdout
    assert late or (done.returncode == 0 and "arming -> active" in done.stdout)
    rows = read_log(next(tmp_path.glob("*.mcap"))).rows
    moved = {name: np.ptp(rows[name], axis=0).max() for name in ("pos", "cmd")}
    # The joints give a little; the policy, to which they seem stuck, asks for more.
    assert late or moved["pos"] < 0.25 * moved["cmd"], moved


def test_policies_for_other_filters_are_refused_by_the_supervisor(
    hand_model, marching_dir, bundle_factory, interface, tmp_path
):
    """Two bundles that cannot be switched between: nothing starts."""
    path = replace(interface.command_path, lowpass_hz=5.0)
    write_bundle(tmp_path, bundle_factory(replace(interface, command_path=path)))
    arguments = ["run", marching_dir, tmp_path, "--driver", "sim"]
    done = _run(*arguments, "--model", hand_model, "--no-record", "--arm")
    assert done.returncode == 2
    assert "command_path.lowpass_hz" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["run", "--joystick", "/dev/none"], "a gamepad"),
        (["record", "--plan", "nowhere.csv"], "nowhere.csv"),
        (["run", "--socket", "nowhere"], "driver: "),
    ],
)
def test_what_a_process_refuses_ends_the_run(hand_model, marching_dir, more, words):
    name, *options = more
    driver = ["--driver", "sim", "--model", hand_model, "--no-record"]
    done = _run(name, marching_dir, *driver, *options)
    assert done.returncode in (2, 6) and words in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_terminal_that_goes_away_ends_nothing(hand_model, marching_dir):
    program = [sys.executable, "-m", "fingers_robot", "run", str(marching_dir)]
    program += ["--driver", "sim", "--model", str(hand_model), "--no-record"]
    process = subprocess.Popen(
        [*program, "--duration", "2", "--unattended"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    process.stdout.close()
    assert process.wait(timeout=60) == 0
    assert process.stderr.read() == ""
    process.stderr.close()


def _small_files():
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))


def test_a_full_disk_is_reported_at_once(hand_model, marching_dir, tmp_path):
    program = [sys.executable, "-m", "fingers_robot", "run", str(marching_dir)]
    program += ["--driver", "sim", "--model", str(hand_model), "--out", str(tmp_path)]
    done = subprocess.run(
        [*program, "--duration", "4", "--unattended"],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=60,
        check=False,
        preexec_fn=_small_files,
    )
    before, warning, _ = done.stdout.partition("NOT RECORDING: ")
    assert warning and "the run goes on" in done.stdout
    assert "control steps" not in before  # that is the report at the end
    assert done.returncode == 0 and done.stderr == ""


def test_a_reader_that_goes_away_gets_no_traceback(bundle_dir):
    program = [sys.executable, "-u", "-m", "fingers_robot", "check", str(bundle_dir)]
    process = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait(timeout=60) == 1
    process.stderr.close()


def test_help_says_what_there_is():
    said = _run("--help").stdout
    for word in ("check", "run", "record", "guard", "log"):
        assert word in said
    with contextlib.suppress(SystemExit):
        main(["run", "--help"])
