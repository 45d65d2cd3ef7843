"""Bad input: one sentence naming what is wrong; nothing written and nothing lost."""

import json
import subprocess
import sys

import onnx
import pytest
from support.cli_setup import contents, make_bundle, make_run, make_setup

from fingers_deploy.manifest import Interface
from fingers_mjx.cli.main import main
from fingers_mjx.policy.interface import interface_of
from fingers_mjx.runs.setup import make_env


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    path, setup = tmp_path_factory.mktemp("originals"), make_setup()
    make_bundle(path / "bundle", setup)
    make_run(path / "run", setup)
    swapped = _swapped(interface_of(make_env(setup, 1, "cpu")))
    make_bundle(path / "swapped", setup, interface=swapped)
    return path


def _swapped(interface: Interface) -> Interface:
    names = list(interface.joint_names)
    names[2], names[3] = names[3], names[2]
    return type(interface)(**(vars(interface) | {"joint_names": tuple(names)}))


@pytest.fixture
def here(originals, tmp_path, monkeypatch):
    """A directory of its own with links to nothing: copies that may be spoilt."""
    import shutil

    shutil.copytree(originals, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refuse(here, capsys, argv):
    """Runs a command that must be refused and returns its one sentence."""
    before = contents(here)
    assert main(argv) == 2
    said = capsys.readouterr()
    assert contents(here) == before
    assert said.err.startswith("fingers: ")
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    return said.err


FILE = "run/run.json/below"
SETTINGS = [
    (["train"], ["TASK", "crawl"]),
    (["train", "crawll"], ["crawll", "crawl"]),
    (["train", "crawl", "--preset", "fats"], ["preset", "fats", "did you mean fast"]),
    (["train", "crawl", "--preset", "adapt"], ["--preset", "adapt", "--warm-start"]),
    (["train", "crawl", "--set", "env.rewards=stok"], ["stok", "did you mean stock"]),
    (
        ["train", "crawl", "--set", "env.rewards=stock", "env.weights.lift=1"],
        ["env.weights.lift", "feet_air_time"],
    ),
    (["train", "push", "--set", "env.rewards=stock"], ["env.rewards", "weights"]),
    (["train", "crawl", "--backend", "gpu"], ["--backend", "gpu", "cpu, jax, warp"]),
    (["train", "crawl", "--seed", "-1"], ["--seed", "-1", "whole number"]),
    (["train", "crawl", "--seed", "many"], ["--seed", "many", "whole number"]),
    (["train", "crawl", "--frob"], ["--frob"]),
    (["train", "crawl", "--num-envs", "abc"], ["fingers: --num-envs: found 'abc'"]),
    (["train", "crawl", "--num_envs=7"], ["fingers: --num_envs: found 7", "multiple"]),
    (["train", "crawl", "--set", "num_envs=abc"], ["fingers: --set: num_envs: found"]),
    (["train", "crawl", "--env.weights", "lfit=1"], ["--env.weights: lfit: found"]),
    (["train", "crawl", "--env.episode-s", "[1"], ["--env.episode-s: found", "YAML"]),
    (["eval", "bundle", "--env.episode-s", "x"], ["fingers: --env.episode-s: found"]),
    (
        ["train", "crawl", "--set", "num_envs=x", "--iterations", "3"],
        ["fingers: --set: num_envs: found 'x'"],
    ),
    (["train", "crawl", "--set", "ppo.entropycost=1"], ["ppo.entropycost", "_cost"]),
    (["train", "crawl", "--set", "ppo.clip=x"], ["ppo.clip", "x", "finite number"]),
    (["train", "crawl", "--set", "ppo.clip"], ["--set", "ppo.clip", "="]),
    (["train", "crawl", "--set", "num_envs=7"], ["num_envs", "7", "minibatches"]),
    (["train", "crawl", "--set", "iterations=0"], ["iterations", "0", ">= 1"]),
    (["train", "crawl", "--set", "env.clip=1"], ["env.clip", "action_clip"]),
    (["train", "crawl", "--set", "env.action_clip=nan"], ["env.action_clip", "nan"]),
    (["train", "crawl", "--set", "env.action_clip=-1"], ["env.action_clip", "-1"]),
    (["train", "crawl", "--set", "env.weights.lfit=1"], ["weights.lfit", "lift"]),
    (["train", "crawl", "--set", "env.control_dt_s=0.007"], ["control_dt_s", "0.007"]),
    (["train", "crawl", "--hand", "no.yaml"], ["no.yaml", "No such file"]),
    (["train", "crawl", "--out", "run"], ["run", "in use", "--resume"]),
    (["train", "crawl", "--out", "bundle/policy.onnx"], ["policy.onnx", "Not a dir"]),
    (["train", "crawl", "--warm-start", "no"], ["no", "checkpoint"]),
    (["train", "crawl", "--schedules", "keep"], ["--schedules", "--warm-start RUN"]),
    (["train", "crawl", "--schedules", "on"], ["--schedules", "on", "keep", "restart"]),
    (
        ["train", "crawl", "--warm-start", "bundle", "--schedules", "keep"],
        ["--schedules keep", "bundle", "a run or checkpoint"],
    ),
    (["train", "--resume", "run", "--schedules", "keep"], ["--schedules", "--resume"]),
    (["train", "--resume", "bundle"], ["bundle", "no run", "fingers train"]),
    (["train", "--resume", "run", "--seed", "5"], ["run", "seed", "5", "0, as saved"]),
    (["train", "--resume", "run", "--hand", "x.yaml"], ["--hand", "x.yaml"]),
    (["train", "--resume", "run", "--set", "ppo.clip=0.3"], ["ppo.clip", "0.3", "0.2"]),
    (["train", "--resume", "run", "--set", "num_envs=8"], ["num_envs", "8", "4"]),
    (["eval", "nothing"], ["nothing", "no such file", "run directory"]),
    (["eval", "."], ["policy.onnx", "run directory"]),
    (["eval", "bundle", "--episodes", "0"], ["--episodes", "0", "at least 1"]),
    (["eval", "bundle", "--steps", "x"], ["--steps", "x"]),
    (["eval", "bundle", "--command", "0.1", "0", "inf"], ["--command", "inf"]),
    (["eval", "bundle", "--command", "0.1", "0"], ["--command", "3"]),
    (["eval", "bundle", "--set", "ppo.clip=1"], ["--set", "ppo.clip=1", "env."]),
    (["eval", "bundle", "--set", "env.episode_s=-1"], ["env.episode_s", "-1"]),
    (["eval", "bundle", "--backend", "tpu"], ["--backend", "tpu"]),
    (["steer", "nothing"], ["nothing", "no such file", "run directory"]),
    (["steer", "bundle", "--seconds", "3"], ["--seconds", "3", "at least 4"]),
    (["steer", "bundle", "--gain", "-1"], ["--gain", "-1", "at least 0"]),
    (["eval", "swapped"], ["joint_names[2]", "finger1_joint4", "finger1_joint3"]),
    (["play", "swapped"], ["joint_names[2]", "finger1_joint4", "finger1_joint3"]),
    (["play", "bundle", "--video", "x.avi"], ["--video", ".avi", ".mp4"]),
    (["play", "bundle", "--friction", "-1"], ["--friction", "-1", "at least 0"]),
    (["play", "bundle", "--runtime", "torch"], ["--runtime", "torch", "numpy"]),
    (["export", "nothing"], ["nothing", "no directory", "fingers train"]),
    (["export", "bundle"], ["bundle", "fingers train"]),
    (["export", "run", "--out", "run/run.json"], ["run/run.json"]),
    (["export", "run", "--command-gain", "1", "1"], ["--command-gain", "3"]),
    (["export", "run", "--command-gain", "0", "1", "1"], ["--command-gain", "0.1"]),
    (["export", "bundle", "--command-gain", "1", "1", "1"], ["--out", "another"]),
    (["hand", "stance", "--hand", "no.yaml"], ["no.yaml", "No such file"]),
    (["hand", "show", "--hand", "bundle/config.yaml"], ["bundle/config.yaml"]),
    (["dance"], ["COMMAND: found dance; valid: one of train, eval, "]),
    (["trian"], ["COMMAND: found trian; valid: one of train, ", "mean train?)"]),
    (["log", "convrt"], ["ACTION: found convrt", "(did you mean convert?)"]),
    (["hand", "shw"], ["ACTION: found shw", "(did you mean show?)"]),
    (["sysid", "inof"], ["ACTION: found inof", "(did you mean info?)"]),
    (["play", "--renderer", "mujocoo"], ["--renderer: found mujocoo", "mean mujoco?)"]),
    (["train", "crawl", "--schedules", "kep"], ["--schedules: found kep", "mean keep"]),
    (["train", "crawl", "--set", "task=recovery"], ["task", "recovery", "TASK"]),
    (["train", "crawl", "--set", "preset=fast"], ["preset", "fast", "--preset"]),
    (["train", "crawl", "--set", "num_envs=100000000000"], ["num_envs", "<= 1048576"]),
    (["train", "crawl", "--out", FILE], ["--out", FILE, "Not a directory"]),
    (["train", "crawl", "--out", "/proc/run"], ["--out", "/proc", "No such file"]),
    (["train", "crawl", "--hand", "run"], ["run", "a folder"]),
    (["train", "crawl", "--hand", "bundle/policy.onnx"], ["policy.onnx", "UTF-8"]),
    (["eval", FILE], [FILE, "no such file"]),
    (["eval", "run/run.json"], ["run.json", "SHA-256"]),
    (["eval", "bundle", "--json", "run"], ["--json", "run", "a directory"]),
    (["eval", "bundle", "--json", FILE], ["--json", FILE, "Not a directory"]),
    (["eval", "bundle", "--json", "/proc/x.json"], ["--json", "/proc/x.json"]),
    (["eval", "bundle", "--out", FILE], ["--out", FILE]),
    (["eval", "bundle", "--out", "bundle/policy.onnx"], ["--out", "policy.onnx"]),
    (["eval", "bundle", "--set", "env.episode_s=1e9"], ["env.episode_s", "<= 1000000"]),
    (["play", "bundle", "--json", "run"], ["--json", "run", "a directory"]),
    (["play", "bundle", "--video", f"{FILE}.mp4"], ["--video", FILE]),
    (["play", "."], ["policy.onnx", "run directory"]),
    (["export", "run", "--out", FILE], ["--out", FILE]),
    (["hand", "show", "--out", FILE], ["--out", FILE]),
    (["hand", "stance", "--out", "run"], ["--out", "run", "a directory"]),
    (["demo", "--out", FILE], ["--out", FILE]),
    (["demo", "--policy", "run"], ["run", "policy.onnx"]),
]


@pytest.mark.parametrize(
    ("argv", "named"), SETTINGS, ids=[" ".join(argv) for argv, _ in SETTINGS]
)
def test_bad_word(here, capsys, argv, named):
    sentence = refuse(here, capsys, argv)
    missing = [word for word in named if word not in sentence]
    assert not missing, sentence


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def replace(old, new):
    def change(path):
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    return change


def foreign(path):
    """A valid ONNX model of somebody else."""
    node = onnx.helper.make_node("Relu", ["x"], ["y"])
    ends = [
        onnx.helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1, 3])
        for name in ("x", "y")
    ]
    graph = onnx.helper.make_graph([node], "g", ends[:1], ends[1:])
    onnx.save(onnx.helper.make_model(graph), path)


def remove(path):
    path.unlink()


HAND = "bundle/hand.yaml"
SPOILT = [
    ("bundle/policy.onnx", cut, ["eval", "bundle"], ["policy.onnx", "SHA-256"]),
    ("bundle/policy.onnx", flip, ["play", "bundle"], ["policy.onnx", "SHA-256"]),
    ("bundle/policy.onnx", foreign, ["eval", "bundle/policy.onnx"], ["policy.onnx"]),
    ("bundle/manifest.json", remove, ["eval", "bundle"], ["manifest.json"]),
    ("bundle/manifest.json", cut, ["eval", "bundle"], ["manifest.json"]),
    ("bundle/config.yaml", remove, ["eval", "bundle"], ["config.yaml"]),
    (
        "bundle/config.yaml",
        replace("action_scale_rad: 0.06", "action_scale_rad: 0.07"),
        ["play", "bundle"],
        ["bundle", "config.yaml", "SHA-256", "export"],
    ),
    (HAND, remove, ["play", "bundle"], ["hand.yaml"]),
    (
        HAND,
        replace("value: 0.88", "value: 0.90"),
        ["eval", "bundle"],
        ["bundle", "hand.yaml", "SHA-256"],
    ),
    (
        HAND,
        replace("schema: 1", "schema: 7"),
        ["train", "crawl", "--hand", HAND],
        [HAND, "schema", "7", "1"],
    ),
    (
        HAND,
        replace("unit: Hz", "unit: rpm"),
        ["train", "crawl", "--hand", HAND],
        [HAND, "lowpass_hz.unit", "rpm", "Hz"],
    ),
    (
        HAND,
        replace("value: 18.7", "value: {finger9_joint1: 18.7}"),
        ["train", "crawl", "--hand", HAND],
        [HAND, "stiffness_scale", "finger9_joint1", "finger1_joint1"],
    ),
    (HAND, cut, ["hand", "stance", "--hand", HAND], [HAND]),
    (
        HAND,
        replace("schema: 1", "schema: [1"),
        ["train", "crawl", "--hand", HAND],
        [HAND, "line", "strict YAML"],
    ),
    (
        "run/run.json",
        replace('"format": 1', '"format": 9'),
        ["eval", "run"],
        ["run.json", "format", "9", "1"],
    ),
    (
        "run/run.json",
        replace('"format": 1', '"format": 9'),
        ["train", "--resume", "run"],
        ["run.json", "format", "9", "1"],
    ),
    (
        "run/run.json",
        replace('"task": "crawl"', '"task": "juggle"'),
        ["export", "run"],
        ["juggle", "crawl"],
    ),
    (
        "run/run.json",
        replace('"control_rate_hz": 50.0', '"control_rate_hz": 100.0'),
        ["eval", "run"],
        ["run.json", "interface.control_rate_hz", "100.0", "50.0"],
    ),
    ("run/run.json", cut, ["export", "run"], ["run", "fingers train"]),
    (
        "run/config.yaml",
        replace("iterations:", "iteratons:"),
        ["eval", "run"],
        ["config.yaml", "train.iteratons", "did you mean iterations"],
    ),
    (
        "run/config.yaml",
        replace("discount: 0.99", "discount: 0.9"),
        ["train", "--resume", "run"],
        ["train.ppo.discount", "0.9", "0.99", "as saved"],
    ),
    (
        "run/hand.yaml",
        replace("value: 0.88", "value: 0.90"),
        ["train", "--resume", "run"],
        ["hand_sha256", "as saved"],
    ),
    (
        "run/checkpoints/00000001/meta.json",
        flip,
        ["eval", "run"],
        ["checkpoints", "damaged"],
    ),
    ("run/hand.yaml", remove, ["export", "run"], ["hand.yaml", "No such file"]),
]


@pytest.mark.parametrize(
    ("file", "spoil", "argv", "named"),
    SPOILT,
    ids=[f"{s[0]}-{getattr(s[1], '__name__', 'x')}-{s[2][0]}" for s in SPOILT],
)
def test_bad_file(here, capsys, file, spoil, argv, named):
    spoil(here / file)
    sentence = refuse(here, capsys, argv)
    missing = [word for word in named if word not in sentence]
    assert not missing, sentence


def test_run_without_a_checkpoint(here, capsys):
    import shutil

    shutil.rmtree(here / "run/checkpoints/00000001")
    assert "no checkpoint" in refuse(here, capsys, ["eval", "run"])


def test_a_bundle_of_another_version_of_the_task(here, capsys):
    """A manifest whose observation is not the one that the task makes today."""
    interface = interface_of(make_env(make_setup(), 1, "cpu"))
    reference = (*interface.reference_angles_rad[:19], 0.1)
    changed = vars(interface) | {"reference_angles_rad": reference}
    make_bundle(here / "old", make_setup(), interface=Interface(**changed))
    sentence = refuse(here, capsys, ["eval", "old"])
    assert "reference_angles_rad[19]" in sentence
    assert "0.1" in sentence


def test_the_real_command(here):
    before = contents(here)
    command = [sys.executable, "-m", "fingers_mjx.cli.main", "eval", "swapped"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "finger1_joint3" in done.stderr
    assert contents(here) == before


def test_help_is_quick_to_come(here):
    """It must not wait for JAX or MuJoCo."""
    code = (
        "import json, sys\n"
        "from fingers_mjx.cli.main import main\n"
        "try:\n    main(['train', '--help'])\n"
        "except SystemExit as end:\n    status = end.code\n"
        "heavy = sorted({'jax', 'mujoco', 'brax', 'numpy'} & set(sys.modules))\n"
        "print(json.dumps([status, heavy]))\n"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == [0, []]
    assert "--resume" in done.stdout
