"""This project's training killed with SIGKILL and resumed, and its exported policy."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks.comparison.plan import ours
from benchmarks.comparison.workers.report import (
    DIFFERENCE,
    EXPORT,
    arguments,
    largest,
    say,
)
from fingers_mjx.export.run import export_run
from fingers_mjx.runs import checkpoint

HALF = 2
SMALL = ("ppo.actor_layers=[256,128]", "ppo.critic_layers=[256,128]", "log_every=1")


def main() -> None:
    """Trains whole and with a kill, compares, exports, compares."""
    args = arguments()
    shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True)
    whole, killed = args.out / "whole", args.out / "killed"
    new = ["crawl", "--preset", "cpu", "--backend", args.backend]
    new += ["--seed", str(args.seed), "--set", f"iterations={2 * HALF}"]
    new += [f"num_envs={args.worlds}", "checkpoint_every=1", *SMALL]
    _train([*new, "--out", str(whole)])
    _train([*new, "--out", str(killed)], kill_after=HALF)
    _train(["--resume", str(killed)])
    one, two = (_end(run) for run in (whole, killed))
    assert one.keys() == two.keys()
    apart = largest(*([x[k].astype(float) for k in one] for x in (one, two)))
    alike = sum(one[k].tobytes() == two[k].tobytes() for k in one)
    note = f"kill -9 after {HALF} of {2 * HALF} iterations; of {len(one)} arrays of the"
    note += f" checkpoint {alike} are alike bit for bit; largest of all"
    shared = {"peer": ours("ours_resume", args.backend).peer, "unit": "1"}
    shared["version"] = f"jax {version('jax')}, brax {version('brax')}"
    say(quantity=DIFFERENCE, value=apart, note=note, **shared)
    report = export_run(whole, args.out / "bundle")
    note = f"its export's own check, {report.observations:,} observations, some extreme"
    say(quantity=EXPORT, value=report.onnxruntime, note=note, **shared)
    say(done=True)


def _train(words: list[str], kill_after: int | None = None) -> None:
    """Runs `fingers train`; kills it when a checkpoint of an iteration is reported."""
    command = [sys.executable, "-m", "fingers_mjx.cli.main", "train", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        for line in process.stdout:
            event = json.loads(line) if line.startswith("{") else {}
            saved = event.get("event") == "checkpoint"
            if saved and event["iteration"] == kill_after:
                process.kill()
    if process.returncode != (-9 if kill_after else os.EX_OK):
        raise SystemExit(f"RuntimeError: training ended with {process.returncode}")


def _end(run: Path) -> Mapping[str, np.ndarray]:
    """Returns every array of the newest checkpoint."""
    newest = checkpoint.newest(run / "checkpoints", print)
    assert newest and int(newest.name) == 2 * HALF
    return checkpoint.load(newest).arrays


if __name__ == "__main__":
    main()
