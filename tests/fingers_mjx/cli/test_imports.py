"""What a command does not need is not imported: a mistake is reported at once."""

import shutil
import subprocess
import sys
from dataclasses import replace

import pytest
from support.house import ROOT
from support.synthetic_sweep import study, write_sweep
from support.sysid_logs import small_log

from envs.hand.hand_file import DEFAULT_HAND_FILE
from fingers_mjx.cli.play import CRAWL_POLICY
from fingers_mjx.runs.directory import open_run, record_run
from fingers_mjx.runs.seal import seal
from fingers_mjx.runs.setup import load_setup
from sysid.logs.read import write_log

HEAVY = ("jax", "brax", "mujoco", "flax", "onnxruntime", "onnx", "scipy", "numpy")
PROGRAM = f"""
import sys
from fingers_mjx.cli.main import main
try:
    status = main(sys.argv[1:])
except SystemExit as done:  # argparse's help
    status = done.code
print("loaded", *sorted(set({HEAVY!r}) & set(sys.modules)))
sys.exit(status)
"""


def run(*argv):
    """Runs a command; returns its status, what it said and what it imported."""
    return printed(*argv)[1:]


def printed(*argv):
    """As `run`, with what it printed before them."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *argv],
        capture_output=True,
        text=True,
        check=False,
    )
    *lines, last = done.stdout.splitlines()
    loaded = last.split()
    assert loaded[0] == "loaded", done.stderr
    return lines, done.returncode, done.stderr, loaded[1:]


@pytest.mark.parametrize(
    ("argv", "nearest"),
    [
        (["train", "crawll"], "did you mean crawl?"),
        (["train", "crawl", "--preset", "fats"], "did you mean fast?"),
        (["train", "crawl", "--backend", "cpuu"], "did you mean cpu?"),
        (["train", "crawl", "--set", "iteratons=3"], "did you mean iterations?"),
        (["train", "crawl", "--set", "ppo.clp=0.1"], "did you mean clip?"),
        (["train", "push", "--set", "env.targt_m=[0,1]"], "did you mean target_m?"),
    ],
)
def test_a_typo_is_reported_before_anything_heavy_is_imported(argv, nearest):
    status, said, loaded = run(*argv)
    assert (status, loaded) == (2, [])
    assert said.startswith("fingers: ") and said.count("\n") == 1 and nearest in said


CRAWL, HAND = str(CRAWL_POLICY), str(DEFAULT_HAND_FILE)
MJCF = ["--mjcf", "no.xml"]
NOT_THERE = [
    (["eval", "no"], "no: found no such file"),
    (["eval", CRAWL, "--json", "/proc/no.json"], "--json: found /proc/no.json"),
    (["steer", "no"], "no: found no such file"),
    (["steer", CRAWL, "--json", "/proc/no.json"], "--json: found /proc/no.json"),
    (["play", "no"], "no: found no such file"),
    (["play", CRAWL, "--then", "no"], "no: found no such file"),
    (["play", CRAWL, "--keys", "up,lft"], "did you mean left?"),
    (["play", CRAWL, "--video", "x.mp3"], "found .mp3; valid: one of .mp4"),
    (["play", "--viewer", "--ghost", "no.csv"], "no.csv: found no such file"),
    (["export", "no"], "no: found no directory"),
    (["demo", "--policy", "no"], "no: found no such file"),
    (["compare", "no", "--baseline", "base"], "no/sweep.json: found no sweep"),
    (["train", "crawl", "--hand", "no.yaml"], "no.yaml: found No such file"),
    (["train", "crawl", "--hand", "bad.yaml"], "bad.yaml: schema: found 7"),
    (["train", "crawl", "--warm-start", "no"], "no: found no such file"),
    (["hand", "show", "--hand", "no.yaml"], "no.yaml: found No such file"),
    (["hand", "stance", "--hand", "no.yaml"], "no.yaml: found No such file"),
    (["hand", "import", "no.xml", "-o", "hand.yaml"], "valid: a readable MJCF file"),
    (
        ["hand", "import", "no.xml", "-o", "hand.yaml", "--joint-map", "no.yaml"],
        "no.yaml: found No such file",
    ),
    (["sysid", "describe", "no.csv", *MJCF], "no.csv: found no such file"),
    (["sysid", "describe", "knee.csv", *MJCF], "valid: a readable MJCF file"),
    (["sysid", "excite", "--hand", "no.yaml"], "no.yaml: found No such file"),
    (["sysid", "excite", "-o", "/proc/no"], "-o: found /proc/no"),
    (["sysid", "excite", "-o", "knee.csv"], "-o: found knee.csv (Not a directory"),
    (["sysid", "calibrate", "knee.csv", "-o", "/proc/no"], "-o: found /proc/no"),
    (["sysid", "diagnose", "knee.csv", "-o", "/proc/no"], "-o: found /proc/no"),
    (["sysid", "describe", "knee.csv", *MJCF, "-o", "/proc/n.yaml"], "-o: found /proc"),
    (["sysid", "calibrate", "no.csv"], "no.csv: found no such file"),
    (["sysid", "diagnose", "no.csv"], "no.csv: found no such file"),
    (["sysid", "diagnose", "knee.csv", *MJCF], "valid: --hand, or --mjcf with --drive"),
    (
        ["sysid", "diagnose", "knee.csv", *MJCF, "--drive", "no.yaml"],
        "no.xml: found [Errno 2] No such file",
    ),
    (
        ["sysid", "diagnose", "knee.csv", "--mjcf", "arm.xml", "--drive", "no.yaml"],
        "no.yaml: found No such file",
    ),
    (
        ["sysid", "transfer", "--real", "no.yaml", "--extended", "bad.yaml"],
        "no.yaml: found No such file",
    ),
    (
        ["sysid", "transfer", "--real", HAND, "--policies", CRAWL, "no"],
        "no: found no such file",
    ),
    (
        ["sysid", "transfer", "--real", HAND, "--extended", HAND, "--task", "crawll"],
        "did you mean crawl?",
    ),
]


@pytest.mark.parametrize(
    ("argv", "sentence"),
    NOT_THERE,
    ids=[" ".join(argv).replace(f"{ROOT}/", "") for argv, _ in NOT_THERE],
)
def test_what_is_not_there_is_reported_before_jax_is_imported(
    argv, sentence, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    write_log(small_log(), tmp_path / "knee.csv")
    (tmp_path / "arm.xml").write_text("<mujoco/>")
    bad = DEFAULT_HAND_FILE.read_text().replace("schema: 1", "schema: 7")
    (tmp_path / "bad.yaml").write_text(bad)
    status, said, loaded = run(*argv)
    assert status == 2 and set(loaded) <= {"numpy"}
    assert said.startswith("fingers: ") and said.count("\n") == 1 and sentence in said


@pytest.mark.parametrize("argv", [["--help"], ["train", "--help"], ["play", "--help"]])
def test_help_imports_nothing_heavy(argv):
    assert run(*argv) == (0, "", [])


@pytest.mark.parametrize(
    ("argv", "most"),
    [
        (["--version"], set()),
        (["tasks"], set()),
        (["sysid", "info", "knee.csv"], {"numpy"}),
        (["log", "convert", "knee.csv", "knee.parquet"], {"numpy"}),
        (["log", "convert", "knee.csv", "knee.mcap"], {"numpy"}),
        (["hand", "mjcf", "-o", "hand.xml"], {"numpy", "mujoco"}),
    ],
)
def test_a_command_that_reads_files_leaves_jax_alone(argv, most, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_log(small_log(), tmp_path / "knee.csv")
    status, said, loaded = run(*argv)
    assert (status, said) == (0, "") and set(loaded) <= most


@pytest.mark.parametrize(
    ("argv", "most"),
    [
        (["sweep", "status", "s"], {"numpy"}),
        (["compare", "s", "--baseline", "base"], {"numpy", "scipy"}),
    ],
)
def test_a_sweep_is_looked_at_without_jax(argv, most, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_sweep(tmp_path / "s", study({"lift": 0.02}, 2))
    status, _, loaded = run(*argv)
    assert status == 0 and set(loaded) <= most


def make_policies(path):
    """Makes runs with and without a checkpoint, and a bundle that was changed."""
    for name, task in (("run", "crawl"), ("unsaved", "crawl"), ("keys", "keyboard")):
        source = CRAWL_POLICY.with_name(task) / "config.yaml"
        setup = load_setup(source, DEFAULT_HAND_FILE, task)
        env = replace(setup.env, weights={}, schedule_scale={})
        with open_run(path / name, resume=False) as made:
            settings = {"train": setup.train, "env": env}
            record_run(made, settings, {"train": {"task": task}}, setup.hand)
    for name in ("run", "keys"):
        (path / name / "checkpoints/00000001").mkdir(parents=True)
        seal(path / name / "checkpoints/00000001", 1)
    shutil.copytree(CRAWL_POLICY, path / "changed")
    with (path / "changed/hand.yaml").open("a") as file:
        file.write("\n")


@pytest.mark.parametrize(
    ("argv", "shown"),
    [
        (["eval", CRAWL], "task: crawl"),
        (
            ["eval", "run", "--nominal", "--command", "0", "0", "0.4"],
            "yaw_rate_rps: [0.4, 0.4]",
        ),
        (["eval", f"{CRAWL_POLICY.with_name('recovery')}"], "falls: held_out"),
        (["play", "--viewer"], "task: crawl"),
        (["play", "run", "--friction", "0.25"], "tip_friction: [0.25, 0.25]"),
        (["play", "keys"], "height_m: 0.0"),
    ],
)
def test_a_policys_settings_are_shown_without_jax(argv, shown, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_policies(tmp_path)
    lines, status, said, loaded = printed(*argv, "--dry-run")
    assert (status, said) == (0, "") and set(loaded) <= {"numpy"}
    assert shown in map(str.strip, lines)


def test_settings_that_name_rewards_need_their_tables_and_no_simulator():
    policy = CRAWL_POLICY.with_name("keyboard")
    lines, status, said, loaded = printed("play", f"{policy}", "--dry-run")
    assert (status, said) == (0, "") and set(loaded) <= {"numpy", "jax", "flax"}
    assert "height_m: 0.0" in map(str.strip, lines)
    others = "support: 5.0, slide: -10.0, approach: -12.0, drift: -2000.0"
    assert f"weights: {{{others}, shear: -20.0}}" in map(str.strip, lines)


@pytest.mark.parametrize("command", ["eval", "play"])
@pytest.mark.parametrize(
    ("policy", "sentence"),
    [
        ("unsaved", "unsaved/checkpoints: found no checkpoint"),
        ("changed", "valid: the files of this policy's export"),
    ],
)
def test_settings_of_what_is_no_whole_policy_are_not_shown(
    command, policy, sentence, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    make_policies(tmp_path)
    status, said, loaded = run(command, policy, "--dry-run")
    assert status == 2 and set(loaded) <= {"numpy"}
    assert said.startswith("fingers: ") and sentence in said


def test_a_command_that_computes_imports_jax(tmp_path, monkeypatch):
    """Negative control."""
    monkeypatch.chdir(tmp_path)
    status, said, loaded = run("train", "crawl", "--schedules", "keep")
    assert status == 2 and "--warm-start" in said and {"jax", "mujoco"} <= set(loaded)
