"""No code in data: what is banned from the sources, and what loading does (X1-X3)."""

import ast
import contextlib
import os
import pickle  # the bait of the negative controls
import socket
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support import train_setup
from support.cli_setup import make_bundle, make_setup

from envs.config.typed import load_yaml
from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
from fingers_deploy import load_bundle
from fingers_mjx.policy.actor import load_policy
from fingers_mjx.ppo.config import TrainConfig
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.setup import load_setup

ROOT = Path(__file__).parents[1]
SOURCES = ("rewards", "envs", "sysid", "fingers_mjx", "deploy", "benchmarks", "tests")
MODULES = {"pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "torch"}
CALLS = {"eval", "exec", "yaml.load", "yaml.unsafe_load", "yaml.full_load", "os.system"}
CALLS |= {"torch.load"}
PEERS = Path("benchmarks/comparison/workers")
"""Programs that run in a peer's environment, whose tensors are torch's; they load no
file with it."""


def banned(source):
    """Yields what `source` has of the ban list, as "line: name"."""
    for node in ast.walk(ast.parse(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names if a.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            names = [module] if module.split(".")[0] in MODULES else []
        elif isinstance(node, ast.Call):
            names = list(banned_call(node))
        yield from (f"{node.lineno}: {name}" for name in names)


def banned_call(node):
    name = ast.unparse(node.func)
    keywords = {k.arg: ast.unparse(k.value) for k in node.keywords}
    if name in CALLS:
        yield name
    if name in ("np.load", "numpy.load") and keywords.get("allow_pickle") != "False":
        yield f"{name} without allow_pickle=False"
    if keywords.get("shell", "False") != "False":
        yield f"{name} with shell"


def refused(path):
    """What of it is refused there."""
    for hit in banned(path.read_text(encoding="utf-8")):
        if not (path.is_relative_to(ROOT / PEERS) and hit.endswith(": torch")):
            yield hit


def test_sources_keep_to_the_ban_list():
    """X2, over everything but this file."""
    files = [p for name in SOURCES for p in (ROOT / name).rglob("*.py")]
    files = [p for p in files if p != Path(__file__)]
    assert len(files) > 100
    found = {
        str(p.relative_to(ROOT)): hits for p in files if (hits := list(refused(p)))
    }
    assert found == {}


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from joblib import load",
        "import torch.nn",
        "torch.load(path)",
        "eval('1')",
        "yaml.load(text, Loader=yaml.Loader)",
        "np.load(path)",
        "np.load(path, allow_pickle=True)",
        "subprocess.run(text, shell=True)",
    ],
)
def test_ban_list_is_applied(source):
    """Negative control."""
    assert list(banned(source))
    assert not list(banned("np.load(path, allow_pickle=False)\nyaml.safe_load(text)"))


def test_loading_runs_no_code_of_the_file(tmp_path, watch):
    """X3: every kind of artefact that the commands read."""
    watch.loading = False
    train_setup.run(tmp_path / "run", iterations=2)
    bundle = make_bundle(tmp_path / "bundle", make_setup())
    watch.loading = True

    load_policy(tmp_path / "run")
    checkpoint.load(checkpoint.newest(tmp_path / "run" / "checkpoints", print))
    load_bundle(bundle)
    load_bundle(bundle / "policy.onnx")
    load_hand_file(DEFAULT_HAND_FILE)
    load_setup(bundle / "config.yaml", bundle / "hand.yaml", "crawl")
    with contextlib.suppress(ValueError):
        load_yaml(TrainConfig, tmp_path / "run" / "config.yaml")
    assert watch.unsafe == []

    # Negative control: what the watch is there for.
    pickle.loads(pickle.dumps(np.zeros(1)))
    subprocess.run("true", shell=True, check=True)
    os.system("true")
    kinds = {event for event, _ in watch.unsafe}
    assert kinds == {"pickle.find_class", "subprocess.Popen", "os.system"}


def test_attempts_to_reach_another_machine_are_seen(watch):
    """Negative control of X1, which every test of the suite checks."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        assert watch.network == []
        with contextlib.suppress(OSError):
            probe.connect(("192.0.2.1", 9))  # an address that no machine has
    assert [event for event, _ in watch.network] == ["socket.connect"]
    watch.network.clear()
