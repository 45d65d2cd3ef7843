"""The whole way from training to a played policy without any network (X1)."""

import os
import shutil
import subprocess
import sys

import pytest

WATCH = """
import sys

EVENTS = ("socket.connect", "socket.sendto", "socket.getaddrinfo", "socket.bind")

def hook(event, args):
    if event not in EVENTS:
        return
    address = args[0] if event == "socket.getaddrinfo" else args[-1]
    if isinstance(address, str | tuple):
        with open({log!r}, "a") as log:
            log.write(f"{{event}} {{address}} {{sys.argv[:2]}}\\n")

sys.addaudithook(hook)
"""
TINY = [
    *["num_envs=4", "iterations=2", "log_every=1", "checkpoint_every=1"],
    *["ppo.unroll_length=4", "ppo.epochs=1", "ppo.minibatches=2"],
    *["ppo.actor_layers=[16]", "ppo.critic_layers=[16]"],
]


def without_network():
    """Words that run a command in a network namespace of its own, where allowed."""
    words = ["unshare", "--map-root-user", "--net"]
    if not shutil.which("unshare"):
        return []
    possible = subprocess.run([*words, "true"], capture_output=True, check=False)
    return words if possible.returncode == 0 else []


@pytest.mark.slow
def test_everything_works_without_a_network(tmp_path):
    log = tmp_path / "attempts.txt"
    (tmp_path / "watch").mkdir()
    (tmp_path / "watch" / "sitecustomize.py").write_text(WATCH.format(log=str(log)))
    watch, path = str(tmp_path / "watch"), os.environ.get("PYTHONPATH", "")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([watch, path])}

    def python(*words):
        done = subprocess.run(
            [*without_network(), sys.executable, *words],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def fingers(*words):
        return python("-m", "fingers_mjx.cli.main", *map(str, words))

    run, bundle = tmp_path / "run", tmp_path / "bundle"
    fingers("train", "crawl", "--preset", "cpu", "--out", run, "--set", *TINY)
    fingers("export", run, "--out", bundle)
    measures = tmp_path / "eval.json"
    fingers("eval", bundle, "--episodes", 2, "--steps", 20, "--json", measures)
    fingers("play", bundle, "--seconds", 1, "--json", tmp_path / "play.json")
    assert measures.is_file() and (tmp_path / "play.json").is_file()
    assert not log.exists()

    # Negative control: the watch sees an attempt in a child like the ones above.
    python("-c", "import socket; socket.socket().connect_ex(('192.0.2.1', 9))")
    assert "192.0.2.1" in log.read_text()
