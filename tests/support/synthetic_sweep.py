"""Sweep directories with known results, as `fingers sweep` leaves them."""

import json
import math

import numpy as np

from fingers_mjx.evaluation.files import summary_document, write_summary
from fingers_mjx.studies.sweep.manifest import Manifest, Member, write_manifest

STAGES = ("stand", "walk")
ITERATIONS = 10
STEPS = 1000
"""Control steps of one stage."""


def write_sweep(path, values, states=None, task="crawl", curves=True):
    """Writes a sweep.

    Args:
        path: its directory.
        values: configuration and seed to measures by name; NaN for an undefined one.
        states: (configuration, seed) to (state, reason) of members that are not done.
        task: by name.
        curves: whether members have learning curves.
    """
    states, members = states or {}, []
    for name, seeds in values.items():
        for seed, measures in seeds.items():
            state, reason = states.get((name, seed), ("done", ""))
            run = f"runs/{name}/{seed}/{STAGES[-1]}"
            came = ITERATIONS if state == "done" else 4
            row = (state, reason, 1, STAGES[-1], came, run)
            members.append(Member(name, seed, *row))
            if curves:
                write_curves(path / "runs" / name / str(seed), seed, state == "done")
            if state == "done":
                write_evaluation(path / run, measures, task)
    path.mkdir(exist_ok=True)
    write_manifest(path, Manifest(task, STAGES, tuple(values), tuple(members)))
    return path


def write_evaluation(run, measures, task="crawl", **changes):
    """Writes `eval/summary.json`; each measure has the same value in all episodes."""
    columns = {name: np.full(4, value, float) for name, value in measures.items()}
    found = summary_document(columns, task, "run", 0, 2 * STEPS, None)
    (run / "eval").mkdir(parents=True, exist_ok=True)
    about = {**found, "conditions": {"backend": "cpu"}, **changes}
    write_summary(run / "eval" / "summary.json", about)


def write_curves(member, seed, done):
    """Writes `metrics.jsonl` of both stages; a member that failed stops halfway."""
    for stage in STAGES:
        (member / stage).mkdir(parents=True, exist_ok=True)
        rows = []
        for iteration in range(1, ITERATIONS + 1):
            steps = iteration * STEPS // ITERATIONS
            level = 10 - 8 * math.exp(-steps / 300) + 0.3 * math.sin(7 * seed + steps)
            row = {"iteration": iteration, "env_steps": steps, "time_s": 0.0}
            rows.append({**row, "episode/return": level, "episode/length": 50 * level})
        if stage == STAGES[-1] and not done:
            rows = rows[: ITERATIONS // 2]
        text = "".join(json.dumps(row) + "\n" for row in rows)
        (member / stage / "metrics.jsonl").write_text(text)


def study(gains, seeds=5, seed=4):
    """Values of configurations whose task speed differs from `base` by known gains.

    Args:
        gains: configuration to its gain [m/s] on each seed, or on all.
        seeds: how many.
        seed: of the noise that seeds have in common.
    """
    rng = np.random.default_rng(seed)
    level = 0.08 + 0.01 * rng.normal(size=seeds)
    slip = 0.5 + 0.05 * rng.normal(size=seeds)
    found = {}
    for name, gain in {"base": 0.0, **gains}.items():
        speed = level + np.broadcast_to(gain, seeds)
        found[name] = {
            i: {
                "task_speed_mps": speed[i],
                "turn_rate_error_rad_s": slip[i] - 2 * (speed[i] - level[i]),
                "survival": 1.0,
                "energy_j": 10 + i,
            }
            for i in range(seeds)
        }
    return found
