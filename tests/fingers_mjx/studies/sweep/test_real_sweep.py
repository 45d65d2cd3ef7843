"""A sweep as a user runs it: killed or on another engine, it gives the same tables."""

import importlib.util
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support import sweep_setup
from support.sweep_setup import ENGINES, TINY, states
from support.train_setup import assert_same_end

from envs.config.strict_yaml import write_yaml
from fingers_mjx.evaluation.files import read_table
from fingers_mjx.studies.sweep.manifest import read_manifest

ROOT = Path(__file__).parents[4]
KILLS = 3
LONGEST_S = {"local": 60.0, "population": 25.0}
"""Time after which a kill comes at the latest, by engine: two programs are over
sooner than six members, one after the other [s]."""
SPEC = {
    "task": "crawl",
    "preset": "cpu",
    "backend": "cpu",
    "set": TINY,
    "configurations": {"plain": {}, "lift": {"env.weights.lift": 5.0}},
    "seeds": 3,
    "stages": [
        {"name": "walk"},
        {"name": "adapt", "set": {"iterations": 2}, "schedules": "keep"},
    ],
    "evaluate": {"episodes": 4},
    "processes": 2,
}
HAS_RAY = importlib.util.find_spec("ray") is not None


def environment():
    path = os.pathsep.join(map(str, (ROOT, ROOT / "tests", ROOT / "deploy")))
    patience = {"RAY_raylet_start_wait_time_s": "300"}
    return {**os.environ, "PYTHONPATH": path, **patience}


def start(root, engine="local"):
    """Starts `fingers sweep` in a process group of its own."""
    spec = root.with_name("spec.yaml")
    # Bits depend on the threads, of which a population would have all cores.
    spec.write_text(write_yaml(SPEC | {"engine": engine, "threads": 1}), "utf-8")
    command = [sys.executable, "-m", "fingers_mjx.cli.main", "sweep", str(spec)]
    with root.with_name(f"{root.name}.txt").open("a") as log:
        return subprocess.Popen(
            [*command, "-o", str(root)], env=environment(), stdout=log, stderr=log
        )


def workers(root):
    """Returns the worker processes of a sweep."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"fingers_mjx.studies.sweep.worker" in words and os.fsencode(root) in words:
            found.append(int(path.parent.name))
    return found


def kill_some(root, engine, rng):
    """Kills the parent or a worker at random moments, and starts the sweep again.

    Each time some worker has been at it for a while. Of each parent one worker at most:
    whose second is killed has failed twice.
    """
    parent, killed = start(root, engine), []
    while len(killed) < KILLS:
        while not workers(root) and parent.poll() is None:
            time.sleep(0.5)
        time.sleep(rng.uniform(0.0, LONGEST_S[engine]))
        if parent.poll() is not None:
            break
        running = workers(root)
        if running and killed[-1:] != ["worker"] and rng.random() < 0.4:
            os.kill(rng.choice(running), signal.SIGKILL)
            killed.append("worker")
        else:
            parent.kill()
            parent.wait()
            killed.append("parent")
            parent = start(root, engine)
    return parent.wait(), killed


def assert_same_tables(one, two):
    members = read_manifest(one).members
    assert set(states(read_manifest(one)).values()) == {"done"}
    assert states(read_manifest(one)) == states(read_manifest(two))
    for member in members:
        tables = [
            read_table(x / member.run / "eval/episodes.parquet") for x in (one, two)
        ]
        assert tables[0].keys() == tables[1].keys()
        for name, values in tables[0].items():
            np.testing.assert_array_equal(values, tables[1][name], err_msg=name)
        assert_same_end(one / member.run, two / member.run)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    root = tmp_path_factory.mktemp("undisturbed") / "sweep"
    begun_s = time.monotonic()
    assert start(root).wait() == 0
    print(f"undisturbed: {time.monotonic() - begun_s:.0f} s")
    return root


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("engine", ENGINES)
def test_three_kills_change_no_table(tmp_path, undisturbed, engine):
    seed = random.randrange(10**6)
    begun_s = time.monotonic()
    status, killed = kill_some(tmp_path / "sweep", engine, random.Random(seed))
    print(f"seed {seed}, killed {killed}: {time.monotonic() - begun_s:.0f} s")
    assert (status, len(killed)) == (0, KILLS)
    assert_same_tables(undisturbed, tmp_path / "sweep")


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not HAS_RAY, reason="needs the extra ray")
def test_two_nodes_give_the_same_tables(tmp_path, undisturbed):
    root, spec = tmp_path / "sweep", tmp_path / "spec.yaml"
    spec.write_text(write_yaml(SPEC), "utf-8")
    begun_s = time.monotonic()
    command = [sys.executable, sweep_setup.__file__, str(root), "ray", str(spec)]
    subprocess.run(command, env=environment(), check=True)
    print(f"two nodes: {time.monotonic() - begun_s:.0f} s")
    assert_same_tables(undisturbed, root)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_one_program_gives_the_same_tables(tmp_path, undisturbed):
    root = tmp_path / "sweep"
    assert start(root, "population").wait() == 0
    assert_same_tables(undisturbed, root)
