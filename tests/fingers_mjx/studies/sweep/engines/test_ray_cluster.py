"""The engine `ray`, on a cluster of two nodes on loopback."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import sweep_setup
from support.sweep_setup import plan_faults, states, summaries, sweep

from envs.errors import InputError
from fingers_mjx.studies.sweep.engines import ray_cluster
from fingers_mjx.studies.sweep.manifest import read_manifest

HAS_RAY = importlib.util.find_spec("ray") is not None


def run_on_two_nodes(root):
    """Runs a sweep on a cluster, in a process of its own."""
    here = Path(__file__).parents[5]
    path = os.pathsep.join(map(str, (here, here / "tests", here / "deploy")))
    command = [sys.executable, sweep_setup.__file__, str(root), "ray"]
    # Other tests beside this one may keep the cores busy while the nodes start.
    patience = {"RAY_raylet_start_wait_time_s": "300"}
    environment = {**os.environ, "PYTHONPATH": path, **patience}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]


@pytest.mark.slow
@pytest.mark.skipif(not HAS_RAY, reason="needs the extra ray")
def test_two_nodes_train_what_one_machine_does(tmp_path):
    """Pretended trainings, faults included."""
    faults = {"lift/1": ["nan"], "plain/0": ["killed"], "lift/0": ["memory", "memory"]}
    plan_faults(tmp_path / "ray", faults)
    plan_faults(tmp_path / "local", faults)
    run_on_two_nodes(tmp_path / "ray")
    manifest = sweep_setup.run_fake(tmp_path / "local")
    assert states(read_manifest(tmp_path / "ray")) == states(manifest)
    assert len(set(states(manifest).values())) == 3
    assert summaries(tmp_path / "ray") == summaries(tmp_path / "local")


def test_a_machine_without_ray_gets_one_sentence(monkeypatch, tmp_path):
    def missing(name):
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(ray_cluster.importlib, "import_module", missing)
    with pytest.raises(InputError, match="the extra ray"):
        ray_cluster.ray_cluster(sweep(engine="ray"), tmp_path)
