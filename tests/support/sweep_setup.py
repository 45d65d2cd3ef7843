"""A sweep of pretended trainings, for the tests of its parent."""

import json
import sys
from pathlib import Path

from support.sweep_worker import planned

from envs.config.typed import from_dict
from fingers_mjx.cli.main import main
from fingers_mjx.studies.sweep.book import Book
from fingers_mjx.studies.sweep.engines.engine import local
from fingers_mjx.studies.sweep.engines.population import population
from fingers_mjx.studies.sweep.engines.ray_cluster import LOOPBACK, ray_cluster
from fingers_mjx.studies.sweep.resolve import keep_sweep
from fingers_mjx.studies.sweep.run import run_sweep, sweep_lock
from fingers_mjx.studies.sweep.spec import Sweep

WORKER = (sys.executable, str(Path(__file__).with_name("sweep_worker.py")))
ENGINES = {"local": local, "population": population}
"""Engines of this machine by name; with `population` a worker has several members."""
TINY = {
    "num_envs": 8,
    "iterations": 3,
    "log_every": 1,
    "checkpoint_every": 1,
    "ppo.unroll_length": 4,
    "ppo.epochs": 1,
    "ppo.minibatches": 2,
    "ppo.actor_layers": [8],
    "ppo.critic_layers": [8],
    "env.episode_s": 1.0,
}


def written(**changes):
    """Returns a sweep of 2 configurations × 2 seeds as plain data, with changes."""
    return {
        "task": "crawl",
        "preset": "cpu",
        "backend": "cpu",
        "set": TINY,
        "configurations": {"plain": {}, "lift": {"env.weights.lift": 5.0}},
        "seeds": 2,
        "evaluate": {"episodes": 4},
        "engine": "local",
        "processes": 2,
    } | changes


def sweep(**changes):
    return from_dict(Sweep, written(**changes), "spec.yaml")


def pretend_warp(monkeypatch):
    """Lets a sweep be one on Warp, which need not be installed to pretend trainings."""
    monkeypatch.setattr("fingers_mjx.studies.sweep.check.find_spec", lambda name: name)


def plan_faults(root, faults):
    """Lets members fail: which fault in which of their attempts."""
    planned(root).write_text(json.dumps(faults), "utf-8")


def run_fake(root, make=local, **changes):
    """Runs a sweep with pretended trainings and returns its manifest."""
    with sweep_lock(root):
        spec = keep_sweep(sweep(**changes), root / "spec.yaml", root)
        book = Book(spec, root, lambda member: None)
        return run_sweep(book, make(spec, root, WORKER), lambda event: None)


def run_fake_on(root, engine, **changes):
    """As `run_fake`, on one of `ENGINES`."""
    return run_fake(root, ENGINES[engine], engine=engine, **changes)


def run_on_two_nodes(root, source=None):
    """Runs a sweep on a Ray cluster of two nodes on loopback.

    With a specification, `fingers sweep` trains it there; without, it is pretended.
    """
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 1, "node_ip_address": LOOPBACK, "include_dashboard": False}
    cluster = Cluster(initialize_head=True, head_node_args=node)
    cluster.add_node(**node)
    on = {"engine": "ray", "address": cluster.address}
    try:
        if source is None:
            run_fake(root, ray_cluster, **on)
        else:
            lines = [f"{name}: {value}\n" for name, value in on.items()]
            text = "".join([source.read_text("utf-8"), *lines])
            there = source.with_name("ray.yaml")
            there.write_text(text, "utf-8")
            assert main(["sweep", str(there), "-o", str(root)]) == 0
    finally:
        cluster.shutdown()


def summaries(root):
    """Returns the evaluations of a sweep by member."""
    found = sorted(root.glob("runs/*/*/*/eval/summary.json"))
    return {str(p.relative_to(root)): p.read_bytes() for p in found}


def states(manifest):
    return {str(m.key): m.state for m in manifest.members}


def journal(root):
    """Returns how often each member began and ended."""
    path = root / "journal.txt"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return [tuple(line.split()[:2]) for line in lines]


if __name__ == "__main__":
    root, *words = sys.argv[1:]
    if words[:1] == ["ray"]:
        run_on_two_nodes(Path(root), *map(Path, words[1:]))
    else:
        run_fake_on(Path(root), *words)
