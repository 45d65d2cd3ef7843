"""A GPU that stays idle is named once, with the command; no device is needed here."""

import importlib.machinery
import logging
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pytest

from fingers_mjx.cli import main
from fingers_mjx.cli.machine import gpu
from fingers_mjx.cli.machine.gpu import chose_cpu, failed_cuda, idle_gpu, sees_gpu
from fingers_mjx.cli.play import CRAWL_POLICY

NATIVE, WSL = "dev/nvidia3", "usr/lib/wsl/lib/libcuda.so.1"


@pytest.fixture(params=[NATIVE, WSL])
def machine(tmp_path, request):
    """A file system with a GPU."""
    return with_files(tmp_path, request.param)


def with_files(root, *names):
    for name in names:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).touch()
    return root


def install(monkeypatch, cuda, warp):
    """Pretends that JAX's plugin for CUDA, or Warp, is installed or is not."""
    plugin = EntryPoint("xla_cuda12", "jax_plugins.xla_cuda12", "jax_plugins")
    found = {"jax_plugins": [plugin] if cuda else []}
    monkeypatch.setattr(gpu.metadata, "entry_points", lambda group: found[group])
    spec = importlib.machinery.ModuleSpec("warp", None) if warp else None
    monkeypatch.setattr(gpu.importlib.util, "find_spec", lambda name: spec)


@pytest.mark.parametrize("warp", [False, True])
def test_a_jax_without_cuda_is_named_with_the_command(monkeypatch, machine, warp):
    install(monkeypatch, cuda=False, warp=warp)
    sentence = idle_gpu(None, {}, machine)
    assert sentence is not None and "an NVIDIA GPU is idle" in sentence
    assert "(make cuda12)" in sentence and "\n" not in sentence


def test_elsewhere_than_in_a_checkout_the_command_is_pip(monkeypatch, machine):
    install(monkeypatch, cuda=False, warp=False)
    monkeypatch.setattr(gpu, "source_tree", lambda: None)
    assert '(pip install "fingers-mjx[cuda12]")' in (idle_gpu(None, {}, machine) or "")


@pytest.mark.parametrize(("path", "uv"), [("/bin/uv", "uv"), (None, ".uv/bin/uv")])
def test_other_extras_are_added_by_the_uv_that_make_uses(monkeypatch, path, uv):
    """Not by pip, which an environment that uv made does not have."""
    monkeypatch.setattr(gpu.shutil, "which", lambda name: path)
    assert gpu.install_command("wandb") == f"{uv} sync --inexact --extra wandb"
    assert gpu.install_command("cuda13") == "make cuda13"


def test_cuda_without_warp_leaves_the_physics_behind(monkeypatch, machine):
    install(monkeypatch, cuda=True, warp=False)
    assert "Warp is not installed" in (idle_gpu(None, {}, machine) or "")
    assert idle_gpu("jax", {}, machine) is None  # chosen, and on the GPU


def test_nothing_is_said_where_all_is_there(monkeypatch, machine):
    install(monkeypatch, cuda=True, warp=True)
    assert idle_gpu(None, {}, machine) is None


@pytest.mark.parametrize("files", [[], ["dev/nvidiactl"], ["dev/dxg"]])
def test_nothing_is_said_without_a_gpu(monkeypatch, tmp_path, files):
    """The driver's control file is there without any GPU in a container."""
    install(monkeypatch, cuda=False, warp=False)
    assert not sees_gpu(with_files(tmp_path, *files))
    assert idle_gpu(None, {}, tmp_path) is None


def test_a_cuda_that_does_not_start_is_named_with_what_jax_says(monkeypatch, machine):
    install(monkeypatch, cuda=True, warp=True)
    assert failed_cuda("no driver\nat all", {}, machine) == (
        "an NVIDIA GPU is idle, JAX cannot start its CUDA plugin: no driver at all "
        "(fingers doctor)"
    )


def test_nothing_is_said_of_a_cuda_that_cannot_be_meant(monkeypatch, machine, tmp_path):
    """Declined, without a GPU, or not installed, of which `idle_gpu` speaks."""
    install(monkeypatch, cuda=True, warp=True)
    assert failed_cuda("no driver", {"JAX_PLATFORMS": "cpu"}, machine) is None
    assert failed_cuda("no driver", {}, tmp_path / "elsewhere") is None
    install(monkeypatch, cuda=False, warp=True)
    assert failed_cuda("no driver", {}, machine) is None


CPU = [
    {"JAX_PLATFORMS": "cpu"},
    {"JAX_PLATFORM_NAME": "cpu"},
    {"CUDA_VISIBLE_DEVICES": ""},
    {"CUDA_VISIBLE_DEVICES": "-1"},
]
GPU = [
    {"JAX_PLATFORMS": ""},
    {"JAX_PLATFORMS": "cuda,cpu"},
    {"JAX_PLATFORMS": "cpu, gpu"},
    {"CUDA_VISIBLE_DEVICES": "0,1"},
]


@pytest.mark.parametrize("environment", CPU, ids=str)
def test_who_chose_the_cpu_is_left_alone(monkeypatch, machine, environment):
    install(monkeypatch, cuda=False, warp=False)
    assert chose_cpu(environment)
    assert idle_gpu(None, environment, machine) is None
    assert idle_gpu("cpu", {}, machine) is None


@pytest.mark.parametrize("environment", GPU, ids=str)
def test_who_did_not_is_not(monkeypatch, machine, environment):
    """Negative control."""
    install(monkeypatch, cuda=False, warp=False)
    assert idle_gpu(None, environment, machine) is not None


CRAWL = str(CRAWL_POLICY)
COMPUTING = [
    ["train", "crawl"],
    ["eval", CRAWL],
    ["demo"],
    ["sysid", "diagnose", "log.csv"],
    ["sysid", "calibrate", "log.csv"],
]
OTHER = [["export", "run"], ["play", CRAWL], ["sysid", "info", "log.csv"]]
REFUSED = [
    ["train", "no-task"],
    ["train", "crawl", "--hand", "/dev/null"],
    ["eval", CRAWL, "--json", "/dev/null/file"],
    ["sysid", "diagnose", "no-log"],
]


@pytest.mark.parametrize("words", COMPUTING + OTHER, ids=" ".join)
def test_every_command_that_computes_says_it_once(monkeypatch, capsys, words):
    make = main.make_parser

    def parse(given):
        args = make().parse_args(given)
        args.check = lambda args: None
        return args

    monkeypatch.setattr(main, "make_parser", lambda: SimpleNamespace(parse_args=parse))
    monkeypatch.setattr(main, "_run", lambda args: 0)
    monkeypatch.setattr(main, "idle_gpu", lambda backend: "idle")
    assert main.main(words) == 0
    assert capsys.readouterr().err.count("fingers: idle\n") == (words in COMPUTING)


@pytest.mark.parametrize("words", REFUSED, ids=" ".join)
def test_a_command_that_is_refused_does_not_say_it(monkeypatch, capsys, words):
    monkeypatch.setattr(main, "idle_gpu", lambda backend: "idle")
    assert main.main(words) == 2
    assert "idle" not in capsys.readouterr().err


def test_jax_does_not_say_it_again(monkeypatch, caplog):
    """JAX's own sentence has no command; its other warnings stay."""
    xla_bridge = pytest.importorskip("jax._src.xla_bridge")
    hardware = xla_bridge.hardware_utils
    monkeypatch.setattr(hardware, "has_visible_nvidia_gpu", lambda: True)
    monkeypatch.setattr(xla_bridge, "_default_backend", xla_bridge.get_backend("cpu"))
    log = logging.getLogger("jax._src.xla_bridge")
    monkeypatch.setattr(log, "filters", [])
    monkeypatch.setattr(log, "propagate", True)
    xla_bridge._suggest_missing_backends()
    assert "CUDA-enabled" in caplog.text
    caplog.clear()
    gpu.quiet_jax()
    xla_bridge._suggest_missing_backends()
    assert caplog.text == ""
    log.warning("another")
    assert "another" in caplog.text
