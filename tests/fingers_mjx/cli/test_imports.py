"""What a command does not need is not imported: a mistake is reported at once."""

import subprocess
import sys

import pytest
from support.synthetic_sweep import study, write_sweep
from support.sysid_logs import small_log

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
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *argv],
        capture_output=True,
        text=True,
        check=False,
    )
    loaded = done.stdout.splitlines()[-1].split()
    assert loaded[0] == "loaded", done.stderr
    return done.returncode, done.stderr, loaded[1:]


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


def test_a_command_that_computes_imports_jax(tmp_path):
    """Negative control."""
    argv = ["train", "crawl", "--hand", str(tmp_path / "no.yaml")]
    status, said, loaded = run(*argv)
    assert status == 2 and "no.yaml" in said and {"jax", "mujoco"} <= set(loaded)
